"""One contact, from curvatures and load to creep forces, for compiled callers: nothing is allocated, no exception is
raised.

Hertz' contact (``hertz``), Kalker's coefficients (``linear_theory``) and the second-order march of FASTSIM with the
blended flexibilities and the intermediate bound (``fastsim``), to the last digits the numbers of these modules. What
they refuse by an exception is refused here by a status, and every result is then not a number.

The net of cells is a table of doubles that ``grid_table`` makes for a number of cells, good for ellipses of every
shape. That
of zero cells stands for the linear theory: forces of small creepages, which no friction limits. In the place of a net
stands the ``table`` of an undeformed distance (``kernel_simplified``) where the contact is no ellipse: Kalker's theory
of 1983, by the approach alone; A and B are not read, a and b come out as half the lengths of the patch. That table
holds the address of its law, so that who has none pays nothing for it.
"""

import math
from functools import lru_cache

import numpy as np

from models.contact.fastsim import LEAST_CELLS, MOST_CELLS
from models.contact.fastsim_grid import STRIPS_PER_CELL_LIMIT, count_of_strips, ellipse_grid
from models.contact.fastsim_kernels import SECOND_ORDER
from models.contact.fastsim_many import BLENDED, fill_contact_forces_in_place
from models.contact.fastsim_records import BLOCK, CONTACT, FORCES, SLIP, MarchWorkspace, cells_in, strips_in
from models.contact.hertz import LARGEST_AXIS, LEAST_AXIS, LEAST_CURVATURE, axis_ratio_and_integrals, elliptic_integrals
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

INPUT_RECORD = record("shape_x", "shape_y", "pressing", "mu", "xi_x", "xi_y", "spin", "G", "nu")
"""Record of the inputs, as in ``kernel.h``: A, B (1/m) or a, b (m); load (N) or approach (m); mu; xi_x, xi_y; spin
(1/m); G (Pa), nu.
"""
OUTPUT_RECORD = record("fx", "fy", "mz", "a", "b", "approach", "load", "stick")
"""Record of the outputs: fx, fy (N), mz (N m), a, b, approach (m), load (N), share of the area that sticks."""
INPUT_COUNT, OUTPUT_COUNT = size_of(INPUT_RECORD), size_of(OUTPUT_RECORD)
BY_LOAD, BY_APPROACH, AXES_BY_LOAD, AXES_BY_APPROACH = range(4)
"""Meaning of the first three inputs: A, B, load; A, B, approach; a, b, load; a, b, approach."""
FINE, NOT_FINITE, NOT_PLAUSIBLE, NOT_KNOWN = range(4)
"""Status of a contact: solved; an input that is not finite; an input out of its range; an unknown kind of inputs."""
LARGEST_CURVATURE, SLENDEREST, LARGEST_FRICTION = 1e12, 1e9, 10.0
GRID_HEAD = record("cells", "first", "count")
"""Record at the head of the grid's table: cells per strip, strips of the first grid, number of grids. Then the rows of
the cells, and the middle and the rows of the strips of one grid after another.
"""
GRID_HEAD_SIZE = size_of(GRID_HEAD)
DISTANCE_HEAD = record("cells", "law")
"""Record at the head of a distance's table: a number below zero in place of the cells, and the address of the
callback.
"""


@lru_cache(maxsize=64)
def grid_table(cell_count: int) -> Array:
    """Table of the grids for ``cell_count`` cells per strip, from 3 to 2000, or 0 for the linear theory; raises
    InputError. Must not be modified.

    Narrow ellipses have more strips: there is one net for every number of strips that may be asked for.
    """
    if (
        isinstance(cell_count, bool)
        or not isinstance(cell_count, int)
        or not (cell_count == 0 or LEAST_CELLS <= cell_count <= MOST_CELLS)
    ):
        raise InputError(
            "",
            "cells",
            cell_count,
            f"must be a whole number from {LEAST_CELLS} to {MOST_CELLS}, or 0 for the linear theory",
        )
    parts, counts = [], range(0)
    if cell_count:
        counts = range(
            int(count_of_strips(np.array(1.0), cell_count)), int(count_of_strips(np.array(1e-9), cell_count)) + 2, 2
        )
        nets = [ellipse_grid(cell_count, count, "intermediate") for count in counts]
        parts = [nets[0].cells.ravel(), *(np.append(row.middle, row.strips) for row in nets)]
    table = np.concatenate(([cell_count, counts.start, len(counts)], *parts), dtype=float)
    table.setflags(write=False)
    return table


@compiled
def solve_contact(input_kind, input_pointer, table_pointer, output_pointer):
    """Solve one contact and fill ``output_pointer``; returns its status, FINE or another.

    input_kind : BY_LOAD or another; input_pointer : pointer to an INPUT; table_pointer : pointer to a ``grid_table`` or
    to the table of a distance; output_pointer : pointer to an OUTPUT. A load or an approach of zero or less has zeros
    all over.
    """
    values, out, head = (
        records_at_pointer(input_pointer, 1, INPUT_RECORD)[0],
        records_at_pointer(output_pointer, 1, OUTPUT_RECORD)[0],
        records_at_pointer(table_pointer, 1, DISTANCE_HEAD)[0],
    )
    any_shape, answers = head.cells < 0.0, array(output_pointer, (OUTPUT_COUNT,))
    status = _input_status(input_kind, values, array(input_pointer, (INPUT_COUNT,)), any_shape)
    answers[:] = 0.0 if status == FINE else math.nan
    if status != FINE or (values.pressing <= 0.0 and not any_shape):
        return status
    if any_shape:
        return call_at_address(int(head.law), input_pointer, table_pointer, output_pointer)
    if not _fill_normal_contact(input_kind, values, out):
        answers[:] = math.nan
        return NOT_PLAUSIBLE
    if head.cells == 0.0:
        _fill_linear_forces(values, out)
    elif values.mu * out.load > NEGLIGIBLE_BOUND:
        _fill_fastsim_forces(values, table_pointer, out)
    return FINE


@compiled
def _input_status(input_kind, input_record, input_values, has_any_shape):
    """Status code of the inputs: whether all are finite, and plausible in SI units."""
    if not BY_LOAD <= input_kind <= AXES_BY_APPROACH or (has_any_shape and input_kind != BY_APPROACH):
        return NOT_KNOWN
    for value in input_values:
        if not math.isfinite(value):
            return NOT_FINITE
    most = LARGEST_LOAD if input_kind in (BY_LOAD, AXES_BY_LOAD) else LARGEST_APPROACH
    small, large = min(input_record.shape_x, input_record.shape_y), max(input_record.shape_x, input_record.shape_y)
    if has_any_shape:
        shaped = True
    elif input_kind in (BY_LOAD, BY_APPROACH):
        shaped = small > 0.0 and LEAST_CURVATURE <= large <= LARGEST_CURVATURE
    else:  # without a load the axes may be none
        shaped = (small >= LEAST_AXIS or input_record.pressing <= 0.0) and small >= 0.0 and large <= LARGEST_AXIS
    plausible = (
        shaped
        and input_record.pressing <= most
        and 0.0 <= input_record.mu <= LARGEST_FRICTION
        and abs(input_record.xi_x) <= LARGEST_CREEPAGE
        and abs(input_record.xi_y) <= LARGEST_CREEPAGE
        and abs(input_record.spin) <= LARGEST_SPIN
        and input_record.G > 0.0
        and 0.0 <= input_record.nu <= 0.5
    )
    return FINE if plausible else NOT_PLAUSIBLE


@compiled
def _fill_normal_contact(input_kind, input_record, output_record):
    """Fill semi-axes, approach and load by Hertz' theory. Returns whether rolling theories can handle this ellipse."""
    x, y, elastic = input_record.shape_x, input_record.shape_y, input_record.G / (1.0 - input_record.nu)
    small, large = min(x, y), max(x, y)
    if input_kind in (BY_LOAD, BY_APPROACH):
        if large > SLENDEREST**1.6 * small:  # beyond it a/b, about the power 2/3 of this, is so in any case
            return False
        ratio, cosine, sine = axis_ratio_and_integrals(small / large)
        integral_sum = cosine + sine
        if input_kind == BY_LOAD:
            load = input_record.pressing
            short = np.cbrt(1.5 * load * cosine / (math.pi * elastic * large) * ratio)
        else:
            short = np.sqrt(input_record.pressing * cosine / (large * integral_sum))
            load = 2.0 / 3.0 * math.pi * elastic * input_record.pressing * short / (ratio * integral_sum)
        long = short / ratio
        output_record.a, output_record.b = (long, short) if x <= y else (short, long)
    else:
        cosine, sine = elliptic_integrals(small / large) if small * SLENDEREST >= large else (1.0, 1.0)
        integral_sum, short, long = cosine + sine, small, large
        by_load = input_kind == AXES_BY_LOAD
        load = (
            input_record.pressing
            if by_load
            else 2.0 / 3.0 * math.pi * x * y * input_record.pressing * elastic / (small * integral_sum)
        )
        output_record.a, output_record.b = x, y
    output_record.load = load
    output_record.approach = 1.5 * load / (math.pi * short * long) * short * integral_sum / elastic
    rolls = short >= LEAST_AXIS and long <= SLENDEREST * short and short * long <= LARGEST_PATCH**2
    return rolls and load <= LARGEST_LOAD


@compiled
def _fill_linear_forces(input_record, output_record):
    """Fill the forces of the linear theory, in which nothing slips."""
    a, b, shear = output_record.a, output_record.b, input_record.G
    area, ratio, nu = a * b, a / b, input_record.nu
    c = array(doubles(4), (4,))
    for kind in range(4):  # a loop, as numba compiles one function for each number that is written out
        c[kind] = coefficient_at(kind, ratio, nu)
    output_record.fx = -shear * area * c[0] * input_record.xi_x
    output_record.fy = -shear * (area * c[1] * input_record.xi_y + area**1.5 * c[2] * input_record.spin)
    output_record.mz = shear * (area**1.5 * c[2] * input_record.xi_y - area**2 * c[3] * input_record.spin)
    output_record.stick = 1.0


@compiled
def _fill_fastsim_forces(input_record, table_pointer, output_record):
    """Fill the forces of FASTSIM on one ellipse, as by ``fastsim_many.forces``, with all arrays on the stack."""
    head = records_at_pointer(table_pointer, 1, GRID_HEAD)[0]
    n, first = int(head.cells), int(head.first)
    wide = n * min(max((0.5 / (output_record.a / output_record.b)) ** 0.6, 1.0), 1.0 * STRIPS_PER_CELL_LIMIT)
    m = 2 * math.ceil(wide / 2.0 - 1e-9)
    k = (m - first) // 2
    at = GRID_HEAD_SIZE + 5 * n + k * (1 + 4 * first) + 4 * k * (k - 1)
    strips = strips_in(array(beyond(table_pointer, at + 1), (4, m)))
    cells = cells_in(array(beyond(table_pointer, GRID_HEAD_SIZE), (5, n)), array(beyond(table_pointer, at), (1,))[0])
    contacts, answers = stack_records(1, CONTACT), stack_records(1, FORCES)
    contact, answer = contacts[0], answers[0]
    contact.a, contact.b, contact.load, contact.mu = (
        output_record.a,
        output_record.b,
        output_record.load,
        input_record.mu,
    )
    contact.xi_x, contact.xi_y, contact.spin = input_record.xi_x, input_record.xi_y, input_record.spin
    contact.l1, contact.l2, contact.l3 = flexibilities_at(
        output_record.a, output_record.b, input_record.G, input_record.nu
    )
    workspace = MarchWorkspace(stack_records(1, SLIP), stack_records(1, BLOCK))
    fill_contact_forces_in_place(contacts, strips, cells, BLENDED, SECOND_ORDER, workspace, answers)
    output_record.fx, output_record.fy, output_record.mz, output_record.stick = (
        answer.fx,
        answer.fy,
        answer.mz,
        answer.stick,
    )
