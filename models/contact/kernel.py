"""One contact, from curvatures and load to creep forces, for compiled callers: nothing is allocated, no exception is
raised.

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

from models.contact.fastsim import LEAST_CELLS, MOST_CELLS
from models.contact.fastsim_grid import MOST_STRIPS, grid, strips_of
from models.contact.fastsim_kernels import SECOND_ORDER
from models.contact.fastsim_many import BLENDED, forces_within
from models.contact.fastsim_records import BLOCK, CONTACT, FORCES, SLIP, Workspace, cells_in, strips_in
from models.contact.hertz import FLATTEST, LARGEST_AXIS, LEAST_AXIS, aspect, integrals
from models.contact.inputs import (
    LARGEST_APPROACH,
    LARGEST_CREEPAGE,
    LARGEST_LOAD,
    LARGEST_SPIN,
    NEGLIGIBLE_BOUND,
    Array,
)
from models.contact.linear_theory import LARGEST_PATCH, coefficient_at, flexibilities_at
from models.core.errors import InputError
from models.machine.compiled import compiled
from models.machine.records import record, records_at_pointer, size_of, stack_records
from models.machine.stack import array, beyond, call_at_address, doubles

INPUT = record("shape_x", "shape_y", "pressing", "mu", "xi_x", "xi_y", "spin", "G", "nu")
"""Record of the inputs, as in ``kernel.h``: A, B (1/m) or a, b (m); load (N) or approach (m); mu; xi_x, xi_y; spin
(1/m); G (Pa), nu.
"""
OUTPUT = record("fx", "fy", "mz", "a", "b", "approach", "load", "stick")
"""Record of the outputs: fx, fy (N), mz (N m), a, b, approach (m), load (N), share of the area that sticks."""
INPUTS, OUTPUTS = size_of(INPUT), size_of(OUTPUT)
BY_LOAD, BY_APPROACH, AXES_BY_LOAD, AXES_BY_APPROACH = range(4)
"""Meaning of the first three inputs: A, B, load; A, B, approach; a, b, load; a, b, approach."""
FINE, NOT_FINITE, NOT_PLAUSIBLE, NOT_KNOWN = range(4)
"""Status of a contact: solved; an input that is not finite; an input out of its range; an unknown kind of inputs."""
LARGEST_CURVATURE, SLENDEREST, LARGEST_FRICTION = 1e12, 1e9, 10.0
GRID_HEAD = record("cells", "first", "count")
"""Record at the head of the grid's table: cells per strip, strips of the first grid, number of grids. Then the rows of
the cells, and the middle and the rows of the strips of one grid after another.
"""
HEADER = size_of(GRID_HEAD)
DISTANCE_HEAD = record("cells", "law")
"""Record at the head of a distance's table: a number below zero in place of the cells, and the address of the
callback.
"""


@lru_cache(maxsize=64)
def net(cells: int) -> Array:
    """Table of the grids for ``cells`` cells per strip, from 3 to 2000, or 0 for the linear theory; raises InputError.
    Must not be modified.

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
def contact(kind, inputs, table, outputs):
    """Solve one contact and fill ``outputs``; returns its status, FINE or another.

    kind : BY_LOAD or another; inputs : pointer to an INPUT; table : pointer to a ``net`` or to the table of a
    distance; outputs : pointer to an OUTPUT. A load or an approach of zero or less has zeros all over.
    """
    values, out, head = (
        records_at_pointer(inputs, 1, INPUT)[0],
        records_at_pointer(outputs, 1, OUTPUT)[0],
        records_at_pointer(table, 1, DISTANCE_HEAD)[0],
    )
    any_shape, answers = head.cells < 0.0, array(outputs, (OUTPUTS,))
    status = _status(kind, values, array(inputs, (INPUTS,)), any_shape)
    answers[:] = 0.0 if status == FINE else math.nan
    if status != FINE or (values.pressing <= 0.0 and not any_shape):
        return status
    if any_shape:
        return call_at_address(int(head.law), inputs, table, outputs)
    if not _press(kind, values, out):
        answers[:] = math.nan
        return NOT_PLAUSIBLE
    if head.cells == 0.0:
        _linear(values, out)
    elif values.mu * out.load > NEGLIGIBLE_BOUND:
        _creep(values, table, out)
    return FINE


@compiled
def _status(kind, values, numbers, any_shape):
    """Status code of the inputs: whether all are finite, and plausible in SI units."""
    if not BY_LOAD <= kind <= AXES_BY_APPROACH or (any_shape and kind != BY_APPROACH):
        return NOT_KNOWN
    for value in numbers:
        if not math.isfinite(value):
            return NOT_FINITE
    most = LARGEST_LOAD if kind in (BY_LOAD, AXES_BY_LOAD) else LARGEST_APPROACH
    small, large = min(values.shape_x, values.shape_y), max(values.shape_x, values.shape_y)
    if any_shape:
        shaped = True
    elif kind in (BY_LOAD, BY_APPROACH):
        shaped = small > 0.0 and FLATTEST <= large <= LARGEST_CURVATURE
    else:  # without a load the axes may be none
        shaped = (small >= LEAST_AXIS or values.pressing <= 0.0) and small >= 0.0 and large <= LARGEST_AXIS
    plausible = (
        shaped
        and values.pressing <= most
        and 0.0 <= values.mu <= LARGEST_FRICTION
        and abs(values.xi_x) <= LARGEST_CREEPAGE
        and abs(values.xi_y) <= LARGEST_CREEPAGE
        and abs(values.spin) <= LARGEST_SPIN
        and values.G > 0.0
        and 0.0 <= values.nu <= 0.5
    )
    return FINE if plausible else NOT_PLAUSIBLE


@compiled
def _press(kind, values, out):
    """Fill semi-axes, approach and load by Hertz' theory. Returns whether rolling theories can handle this ellipse."""
    x, y, elastic = values.shape_x, values.shape_y, values.G / (1.0 - values.nu)
    small, large = min(x, y), max(x, y)
    if kind in (BY_LOAD, BY_APPROACH):
        if large > SLENDEREST**1.6 * small:  # beyond it a/b, about the power 2/3 of this, is so in any case
            return False
        ratio, cosine, sine = aspect(small / large)
        integral_sum = cosine + sine
        if kind == BY_LOAD:
            load = values.pressing
            short = np.cbrt(1.5 * load * cosine / (math.pi * elastic * large) * ratio)
        else:
            short = np.sqrt(values.pressing * cosine / (large * integral_sum))
            load = 2.0 / 3.0 * math.pi * elastic * values.pressing * short / (ratio * integral_sum)
        long = short / ratio
        out.a, out.b = (long, short) if x <= y else (short, long)
    else:
        cosine, sine = integrals(small / large) if small * SLENDEREST >= large else (1.0, 1.0)
        integral_sum, short, long = cosine + sine, small, large
        by_load = kind == AXES_BY_LOAD
        load = (
            values.pressing
            if by_load
            else 2.0 / 3.0 * math.pi * x * y * values.pressing * elastic / (small * integral_sum)
        )
        out.a, out.b = x, y
    out.load = load
    out.approach = 1.5 * load / (math.pi * short * long) * short * integral_sum / elastic
    rolls = short >= LEAST_AXIS and long <= SLENDEREST * short and short * long <= LARGEST_PATCH**2
    return rolls and load <= LARGEST_LOAD


@compiled
def _linear(values, out):
    """Fill the forces of the linear theory, in which nothing slips."""
    a, b, shear = out.a, out.b, values.G
    area, ratio, nu = a * b, a / b, values.nu
    c = array(doubles(4), (4,))
    for kind in range(4):  # a loop, as numba compiles one function for each number that is written out
        c[kind] = coefficient_at(kind, ratio, nu)
    out.fx = -shear * area * c[0] * values.xi_x
    out.fy = -shear * (area * c[1] * values.xi_y + area**1.5 * c[2] * values.spin)
    out.mz = shear * (area**1.5 * c[2] * values.xi_y - area**2 * c[3] * values.spin)
    out.stick = 1.0


@compiled
def _creep(values, table, out):
    """Fill the forces of FASTSIM on one ellipse, as by ``fastsim_many.forces``, with all arrays on the stack."""
    head = records_at_pointer(table, 1, GRID_HEAD)[0]
    n, first = int(head.cells), int(head.first)
    wide = n * min(max((0.5 / (out.a / out.b)) ** 0.6, 1.0), 1.0 * MOST_STRIPS)
    m = 2 * math.ceil(wide / 2.0 - 1e-9)
    k = (m - first) // 2
    at = HEADER + 5 * n + k * (1 + 4 * first) + 4 * k * (k - 1)
    strips = strips_in(array(beyond(table, at + 1), (4, m)))
    cells = cells_in(array(beyond(table, HEADER), (5, n)), array(beyond(table, at), (1,))[0])
    contacts, answers = stack_records(1, CONTACT), stack_records(1, FORCES)
    contact, answer = contacts[0], answers[0]
    contact.a, contact.b, contact.load, contact.mu = out.a, out.b, out.load, values.mu
    contact.xi_x, contact.xi_y, contact.spin = values.xi_x, values.xi_y, values.spin
    contact.l1, contact.l2, contact.l3 = flexibilities_at(out.a, out.b, values.G, values.nu)
    workspace = Workspace(stack_records(1, SLIP), stack_records(1, BLOCK))
    forces_within(contacts, strips, cells, BLENDED, SECOND_ORDER, workspace, answers)
    out.fx, out.fy, out.mz, out.stick = answer.fx, answer.fy, answer.mz, answer.stick
