"""One contact, from curvatures and load to creep forces, for compiled callers: nothing is allocated, nothing raised.

Hertz' contact (``hertz``), Kalker's coefficients (``linear_theory``) and the second-order march of FASTSIM with the
blended flexibilities and the intermediate bound (``fastsim``), to the last digits the numbers of these modules. What
they refuse by an exception is refused here by a status, and every result is then not a number.

The net of cells is a table of doubles that ``net`` makes for a number of cells, good for ellipses of every shape. That
of zero cells stands for the linear theory: forces of small creepages, which no friction limits. In the place of a net
stands the ``table`` of an undeformed distance (``kernel_simplified``) where the contact is no ellipse: Kalker's theory
of 1983, by the approach alone; A and B are not read, a and b come out as half the lengths of the patch. That table
holds the address of its law, so that who has none pays nothing for it.
"""

import math
from functools import lru_cache

import numpy as np
from numba import carray

from models.contact.fastsim import LEAST_CELLS, MOST_CELLS
from models.contact.fastsim_grid import MOST_STRIPS, grid, strips_of
from models.contact.fastsim_kernels import SECOND_ORDER
from models.contact.fastsim_many import (
    BLENDED,
    L1,
    L2,
    L3,
    LOAD,
    MU,
    PER_SLIP,
    ROOM,
    SPIN,
    XI_X,
    XI_Y,
    A,
    B,
    forces_within,
)
from models.contact.hertz import FLATTEST, LARGEST_AXIS, LEAST_AXIS, aspect, integrals
from models.contact.inputs import LARGEST_APPROACH, LARGEST_CREEPAGE, LARGEST_LOAD, LARGEST_SPIN, NOTHING, Array
from models.contact.linear_theory import LARGEST_PATCH, coefficient_at, flexibilities_at
from models.core.errors import InputError
from models.machine.compiled import compiled
from models.machine.stack import ask, beyond, doubles

(SHAPE_X, SHAPE_Y, PRESSING, FRICTION, CREEP_X, CREEP_Y, TURNING, MODULUS, POISSON) = range(9)
"""What goes in: A, B (1/m) or a, b (m); load (N) or approach (m); mu; xi_x, xi_y; spin (1/m); G (Pa), nu."""
INPUTS = 9
FX, FY, MZ, AXIS_A, AXIS_B, APPROACH, NORMAL, STICK = range(8)
"""What comes out: fx, fy (N), mz (N m), a, b, approach (m), load (N), share of the area that sticks."""
OUTPUTS = 8
BY_LOAD, BY_APPROACH, AXES_BY_LOAD, AXES_BY_APPROACH = range(4)
"""What the first three inputs are: A, B, load; A, B, approach; a, b, load; a, b, approach."""
FINE, NOT_FINITE, NOT_PLAUSIBLE, NOT_KNOWN = range(4)
"""Status: an answer; an input that is not finite; one out of its range; a word for the inputs that is none."""
LARGEST_CURVATURE, SLENDEREST, LARGEST_FRICTION = 1e12, 1e9, 10.0
_CELLS, _FIRST, _COUNT, _ALONG = range(4)
"""Places in the net: cells per strip, strips of the first net, how many nets, where the rows of the cells begin."""
_LAW = 1
"""Place of the law's address where the first number is below zero."""
_CONTACT, _FORCES = 10, 4
"""Columns of a contact and of its forces, as ``forces_within`` has them."""


@lru_cache(maxsize=64)
def net(cells: int) -> Array:
    """Table for ``cells`` per strip, from 3 to 2000, or 0 for the linear theory; raises InputError. Not to be changed.

    Narrow ellipses have more strips: there is one net for every number of strips that may be asked for.
    """
    if isinstance(cells, bool) or not isinstance(cells, int) or not (cells == 0 or LEAST_CELLS <= cells <= MOST_CELLS):
        raise InputError(
            "", "cells", cells, f"must be a whole number from {LEAST_CELLS} to {MOST_CELLS}, or 0 for the linear theory"
        )
    parts, counts = [], range(0)
    if cells:
        counts = range(int(strips_of(np.array(1.0), cells)), int(strips_of(np.array(1e-9), cells)) + 2, 2)
        nets = [grid(cells, count, "intermediate") for count in counts]
        parts = [nets[0].cells.ravel(), *(np.append(row.middle, row.strips) for row in nets)]
    table = np.concatenate(([cells, counts.start, len(counts)], *parts), dtype=float)
    table.setflags(write=False)
    return table


@compiled
def contact(given, inputs, table, outputs):
    """Status of one contact, FINE or another; fills ``outputs``.

    given : BY_LOAD or another; inputs : pointer to INPUTS doubles; table : pointer to a ``net`` or to the table of
    a distance; outputs : pointer to OUTPUTS doubles. A load or an approach of zero or less has zeros all over.
    """
    values, out = carray(inputs, (INPUTS,)), carray(outputs, (OUTPUTS,))
    any_shape = carray(table, (1,))[_CELLS] < 0.0
    status = _status(given, values, any_shape)
    out[:] = 0.0 if status == FINE else math.nan
    if status != FINE or (values[PRESSING] <= 0.0 and not any_shape):
        return status
    if any_shape:
        return ask(int(carray(table, (2,))[_LAW]), inputs, table, outputs)
    if not _press(given, values, out):
        out[:] = math.nan
        return NOT_PLAUSIBLE
    if carray(table, (1,))[_CELLS] == 0.0:
        _linear(values, out)
    elif values[FRICTION] * out[NORMAL] > NOTHING:
        _creep(values, table, out)
    return FINE


@compiled
def _status(given, values, any_shape):
    """Whether the inputs are numbers, and numbers in SI."""
    if not BY_LOAD <= given <= AXES_BY_APPROACH or (any_shape and given != BY_APPROACH):
        return NOT_KNOWN
    for value in values:
        if not math.isfinite(value):
            return NOT_FINITE
    most = LARGEST_LOAD if given in (BY_LOAD, AXES_BY_LOAD) else LARGEST_APPROACH
    small, large = min(values[SHAPE_X], values[SHAPE_Y]), max(values[SHAPE_X], values[SHAPE_Y])
    if any_shape:
        shaped = True
    elif given in (BY_LOAD, BY_APPROACH):
        shaped = small > 0.0 and FLATTEST <= large <= LARGEST_CURVATURE
    else:  # without a load the axes may be none
        shaped = (small >= LEAST_AXIS or values[PRESSING] <= 0.0) and small >= 0.0 and large <= LARGEST_AXIS
    plausible = (
        shaped
        and values[PRESSING] <= most
        and 0.0 <= values[FRICTION] <= LARGEST_FRICTION
        and abs(values[CREEP_X]) <= LARGEST_CREEPAGE
        and abs(values[CREEP_Y]) <= LARGEST_CREEPAGE
        and abs(values[TURNING]) <= LARGEST_SPIN
        and values[MODULUS] > 0.0
        and 0.0 <= values[POISSON] <= 0.5
    )
    return FINE if plausible else NOT_PLAUSIBLE


@compiled
def _press(given, values, out):
    """Axes, approach and load by Hertz; whether the ellipse is one that the theories of rolling take."""
    x, y, elastic = values[SHAPE_X], values[SHAPE_Y], values[MODULUS] / (1.0 - values[POISSON])
    small, large = min(x, y), max(x, y)
    if given in (BY_LOAD, BY_APPROACH):
        if large > SLENDEREST**1.6 * small:  # beyond it a/b, about the power 2/3 of this, is so in any case
            return False
        ratio, cosine, sine = aspect(small / large)
        whole = cosine + sine
        if given == BY_LOAD:
            load = values[PRESSING]
            short = np.cbrt(1.5 * load * cosine / (math.pi * elastic * large) * ratio)
        else:
            short = np.sqrt(values[PRESSING] * cosine / (large * whole))
            load = 2.0 / 3.0 * math.pi * elastic * values[PRESSING] * short / (ratio * whole)
        long = short / ratio
        out[AXIS_A], out[AXIS_B] = (long, short) if x <= y else (short, long)
    else:
        cosine, sine = integrals(small / large) if small * SLENDEREST >= large else (1.0, 1.0)
        whole, short, long = cosine + sine, small, large
        by_load = given == AXES_BY_LOAD
        load = (
            values[PRESSING] if by_load else 2.0 / 3.0 * math.pi * x * y * values[PRESSING] * elastic / (small * whole)
        )
        out[AXIS_A], out[AXIS_B] = x, y
    out[NORMAL] = load
    out[APPROACH] = 1.5 * load / (math.pi * short * long) * short * whole / elastic
    rolls = short >= LEAST_AXIS and long <= SLENDEREST * short and short * long <= LARGEST_PATCH**2
    return rolls and load <= LARGEST_LOAD


@compiled
def _linear(values, out):
    """Forces as long as nothing slips."""
    a, b, shear = out[AXIS_A], out[AXIS_B], values[MODULUS]
    area, ratio, nu = a * b, a / b, values[POISSON]
    c = carray(doubles(4), (4,))
    for kind in range(4):  # a loop, as numba compiles one function for each number that is written out
        c[kind] = coefficient_at(kind, ratio, nu)
    out[FX] = -shear * area * c[0] * values[CREEP_X]
    out[FY] = -shear * (area * c[1] * values[CREEP_Y] + area**1.5 * c[2] * values[TURNING])
    out[MZ] = shear * (area**1.5 * c[2] * values[CREEP_Y] - area**2 * c[3] * values[TURNING])
    out[STICK] = 1.0


@compiled
def _creep(values, table, out):
    """FASTSIM on one ellipse: as ``fastsim_many.forces``, all arrays on the stack."""
    head = carray(table, (_ALONG,))
    n, first = int(head[_CELLS]), int(head[_FIRST])
    wide = n * min(max((0.5 / (out[AXIS_A] / out[AXIS_B])) ** 0.6, 1.0), 1.0 * MOST_STRIPS)
    m = 2 * math.ceil(wide / 2.0 - 1e-9)
    k = (m - first) // 2
    at = _ALONG + 5 * n + k * (1 + 4 * first) + 4 * k * (k - 1)
    cells, strips = carray(beyond(table, _ALONG), (5, n)), carray(beyond(table, at + 1), (4, m))
    contacts, slips = carray(doubles(_CONTACT), (1, _CONTACT)), carray(doubles(PER_SLIP), (1, PER_SLIP))
    forces, lanes = carray(doubles(_FORCES), (1, _FORCES)), carray(doubles(ROOM), (ROOM,))
    row = contacts[0]
    row[A], row[B], row[LOAD], row[MU] = out[AXIS_A], out[AXIS_B], out[NORMAL], values[FRICTION]
    row[XI_X], row[XI_Y], row[SPIN] = values[CREEP_X], values[CREEP_Y], values[TURNING]
    row[L1], row[L2], row[L3] = flexibilities_at(row[A], row[B], values[MODULUS], values[POISSON])
    middle = carray(beyond(table, at), (1,))[0]
    forces_within(contacts, strips, cells, middle, BLENDED, SECOND_ORDER, slips, lanes, forces)
    out[FX], out[FY], out[MZ], out[STICK] = forces[0]
