"""Kalker's theory of 1983 (``simplified_theory``) for compiled callers: one contact patch of any shape, at its
approach.

The undeformed distance and the way the theory is used are a table of doubles that ``distance_table`` makes. The kernel
finds the depth that has the approach, marches, fits W_1 = W_2 and marches again, by the compiled parts of the package:
its numbers are those of ``solve_normal_contact`` and ``solve_rolling_contact``. Nothing is raised. The work arrays,
some ten kilobytes, are taken from the heap and given back within the call, which is a hundredth of its time; no lock,
nothing kept, any number of threads.
"""

import math
from functools import cache

import numpy as np
from numba import cfunc, types

from models.contact.distance_kernels import valley_ends
from models.contact.inputs import Array, checked_whole_number
from models.contact.kernel import FINE, INPUT_RECORD, NOT_PLAUSIBLE, OUTPUT_COUNT, OUTPUT_RECORD
from models.contact.patches import Patch, separate_patches
from models.contact.simplified_kernels import (
    PARABOLIC,
    PatchSurface,
    cell_sizes,
    coarse_cells,
    coarse_fit,
    coarse_tractions,
    fine_strips,
    march_strips,
    tangential_displacement,
    tangential_fit,
)
from models.contact.simplified_theory import (
    DEFAULT_OPTIONS,
    DEPTH_BY_APPROACH,
    FIT_KINDS,
    LEAST_CELLS,
    PRESSURE_SHAPES,
    SimplifiedOptions,
)
from models.contact.undeformed_distance import UndeformedDistance
from models.core.errors import InputError
from models.machine.compiled import compiled
from models.machine.records import record, records_at_pointer, size_of
from models.machine.stack import DOUBLES, array, beyond

TABLE_HEAD = record(
    "cells",
    "law",
    "net",
    "shape",
    "fit",
    "low",
    "edge",
    "x",
    "y",
    "dx",
    "dy",
    "bottom_x",
    "bottom_y",
    "lines_x",
    "lines_y",
    "rows",
    "columns",
)
"""Record at the head of the table: minus the cells; address of the callback; net, shape and fit; least distance and
depth at which a side is reached (m); first node, spacing and bottom along x and y (m); lengths. Then lines and roots
along x and y, and padded heights.
"""
TABLE_HEAD_SIZE = size_of(TABLE_HEAD)
MOST_CELLS = 200
DEPTH_TOLERANCE = 1e-12
"""Ratio of the error of the approach to the approach beyond first touch at which the search of the depth ends."""
ITERATION_LIMIT = 100


def distance_table(
    undeformed_distance: UndeformedDistance,
    cell_count: int = 21,
    simplified_options: SimplifiedOptions = DEFAULT_OPTIONS,
) -> Array:
    """Table for an undeformed distance with a single valley, for compiled callers; its first number is below zero. Must
    not be modified.

    cell_count : strips of the fine net, and cells in each, 3 to 200. Raises InputError, also for several valleys.
    """
    cell_count = checked_whole_number("cells", cell_count, LEAST_CELLS, MOST_CELLS)
    patches = separate_patches(undeformed_distance) if simplified_options.separate else [Patch(undeformed_distance)]
    if len(patches) > 1:
        raise InputError("", "distance", None, f"has {len(patches)} valleys: the compiled theory takes one patch")
    (patch,) = patches
    (x, root_x), (y, root_y) = patch.lines
    head = [
        -cell_count,
        _simplified_callback().address,
        simplified_options.net,
        PRESSURE_SHAPES[simplified_options.shape],
        FIT_KINDS[simplified_options.fit],
        patch.low,
        patch.edge,
        undeformed_distance.x[0],
        undeformed_distance.y[0],
        undeformed_distance.dx,
        undeformed_distance.dy,
        *patch.bottom[:2],
        x.size,
        y.size,
        *undeformed_distance.padded.shape,
    ]
    made = np.concatenate((head, x, root_x, y, root_y, undeformed_distance.padded.ravel()), dtype=float)
    made.setflags(write=False)
    return made


@compiled
def surface_at(table_pointer, depth):
    """``PatchSurface`` of the patch at a depth (m), as ``Patch.surface`` gives it, from its table."""
    head = records_at_pointer(table_pointer, 1, TABLE_HEAD)[0]
    m, n = int(head.lines_x), int(head.lines_y)
    x, y = (
        array(beyond(table_pointer, TABLE_HEAD_SIZE), (2, m)),
        array(beyond(table_pointer, TABLE_HEAD_SIZE + 2 * m), (2, n)),
    )
    shape = int(head.rows), int(head.columns)
    padded = array(beyond(table_pointer, TABLE_HEAD_SIZE + 2 * (m + n)), shape)
    root = math.sqrt(max(depth - head.low, 0.0))
    x0, x1 = valley_ends(x[0], x[1], head.bottom_x, root)
    y0, y1 = valley_ends(y[0], y[1], head.bottom_y, root)
    return PatchSurface(padded, (head.x, head.y), (head.dx, head.dy), (x0, x1, y0, y1), depth, head.low)


@compiled
def fit_at_depth(table_pointer, depth, contact_modulus):
    """Stiffness 1/W (Pa/m), approach (m) and sum of W p dA of the patch at a depth (m)."""
    head = records_at_pointer(table_pointer, 1, TABLE_HEAD)[0]
    return coarse_fit(surface_at(table_pointer, depth), int(head.net), int(head.shape), int(head.fit), contact_modulus)


@compiled
def depth_at_approach(table_pointer, approach, contact_modulus):
    """Depth (m) at which the approach (m) is reached, with its stiffness (Pa/m) and sum of W p dA; NaN if the contact
    would pass the table's edge.

    False position by Illinois' rule: the approach grows with the depth, for one valley in proportion.
    """
    head = records_at_pointer(table_pointer, 1, TABLE_HEAD)[0]
    low, most = head.low, head.edge - head.low
    over = approach - low
    left, off_left, right, off_right = 0.0, -over, 0.0, -over
    depth = min(DEPTH_BY_APPROACH * over, most)
    last_side = 0
    for _ in range(ITERATION_LIMIT):
        stiffness, reached, volume = fit_at_depth(table_pointer, low + depth, contact_modulus)
        off = reached - approach
        if abs(off) <= DEPTH_TOLERANCE * over:
            return low + depth, stiffness, volume
        if not math.isfinite(off) or (off < 0.0 and depth >= most):
            break
        if off < 0.0:
            left, off_left = depth, off
            off_right *= 0.5 if last_side < 0 else 1.0
            last_side = -1
        else:
            right, off_right = depth, off
            off_left *= 0.5 if last_side > 0 else 1.0
            last_side = 1
        if right <= 0.0:  # not yet enclosed
            depth, last_side = min(1.5 * depth, most), 0
            continue
        depth = (left * off_right - right * off_left) / (off_right - off_left)
        if not left < depth < right:
            return low + depth, stiffness, volume  # rounding leaves nothing between
    return math.nan, math.nan, math.nan


@compiled
def solve_simplified(input_pointer, table_pointer, output_pointer):
    """Solve the patch by the simplified theory and fill ``output_pointer``; returns its status, FINE or NOT_PLAUSIBLE.
    The caller, ``kernel``, must have checked ``input_pointer``.

    All pointers to doubles. Zeros where the bodies do not touch; no answer where the contact reaches the edge of the
    distance.
    """
    values, out, head = (
        records_at_pointer(input_pointer, 1, INPUT_RECORD)[0],
        records_at_pointer(output_pointer, 1, OUTPUT_RECORD)[0],
        records_at_pointer(table_pointer, 1, TABLE_HEAD)[0],
    )
    answers = array(output_pointer, (OUTPUT_COUNT,))
    answers[:] = 0.0
    if values.pressing <= head.low:
        return FINE
    depth, stiffness, volume = depth_at_approach(table_pointer, values.pressing, values.G / (1.0 - values.nu))
    if stiffness * volume > 0.0:
        out.load = stiffness * volume
        _fill_rolling_forces(values, table_pointer, depth, stiffness, out)
    if math.isfinite(stiffness * volume + out.fx + out.fy + out.mz):
        return FINE
    answers[:] = math.nan
    return NOT_PLAUSIBLE


@compiled
def _fill_rolling_forces(input_record, table_pointer, depth, stiffness, output_record):
    """Fill the rolling forces of the patch at a depth (m) in ``output_record``, whose load is known, as
    ``simplified_theory.roll`` does.
    """
    surface, head = surface_at(table_pointer, depth), records_at_pointer(table_pointer, 1, TABLE_HEAD)[0]
    box, cells, meshes = surface.box, -int(head.cells), int(head.net)
    net = fine_strips(surface, cells, cells, int(head.shape))
    scale_pressure_to_load(net, output_record.load)
    motion = input_record.xi_x, input_record.xi_y, input_record.spin
    traction, flexibility = np.empty((net.y.size, cells, 2)), 1.0 / stiffness
    fx = fy = mz = stuck = area = 0.0
    for again in (False, True):
        if again:
            crude, (dx, dy) = coarse_tractions(net, traction, box, meshes), cell_sizes(box, meshes)
            cover = coarse_cells(surface, meshes, PARABOLIC)[2]
            u = tangential_displacement(crude, dx, dy, input_record.nu) / (math.pi * input_record.G)
            fitted = tangential_fit(u, crude, cover, dx, dy, int(head.fit))
            flexibility = fitted if fitted > 0.0 else flexibility
        fx, fy, mz, stuck, area = march_strips(net, input_record.mu, flexibility, motion, traction)
    output_record.fx, output_record.fy, output_record.mz, output_record.stick = fx, fy, mz, stuck / area
    output_record.a, output_record.b = 0.5 * (box[1] - box[0]), 0.5 * (box[3] - box[2])
    output_record.approach = input_record.pressing


@compiled
def scale_pressure_to_load(fine_net, load):
    """Scale the pressure of a ``FineGrid`` to carry the load (N), so that full sliding gives mu N exactly."""
    carried, (strips_, cells) = 0.0, fine_net.pressure.shape
    for s in range(strips_):
        for i in range(cells):
            carried += fine_net.pressure[s, i] * (fine_net.high_x[s] - fine_net.low_x[s]) * fine_net.width / cells
    for s in range(strips_):
        for i in range(cells):
            fine_net.pressure[s, i] *= load / carried


@cache
def _simplified_callback():
    """Callback with C calling convention around ``solve_simplified``; tables store its address."""

    @cfunc(types.int32(DOUBLES, DOUBLES, DOUBLES), error_model="numpy")
    def law(input_pointer, table_pointer, output_pointer):
        return solve_simplified(input_pointer, table_pointer, output_pointer)

    return law
