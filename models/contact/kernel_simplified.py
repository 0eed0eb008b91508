"""Kalker's theory of 1983 (``simplified_theory``) for compiled callers: one contact patch of any shape, at its
approach.

The undeformed distance and the way the theory is used are a table of doubles that ``table`` makes. The kernel finds
the depth that has the approach, marches, fits W_1 = W_2 and marches again, by the compiled parts of the package: its
numbers are those of ``press`` and ``roll``. Nothing is raised. The work arrays, some ten kilobytes, are taken from the
heap and given back within the call, which is a hundredth of its time; no lock, nothing kept, any number of threads.
"""

import math
from functools import cache

import numpy as np
from numba import cfunc, types

from models.contact.distance_kernels import valley_ends
from models.contact.inputs import Array, whole_number
from models.contact.kernel import FINE, INPUT, NOT_PLAUSIBLE, OUTPUT, OUTPUTS
from models.contact.patches import Patch, separate
from models.contact.simplified_kernels import (
    PARABOLIC,
    Surface,
    coarse_fit,
    coarse_net,
    coarse_tractions,
    march,
    mesh_of,
    strips,
    tangential,
    tangential_fit,
)
from models.contact.simplified_theory import DEPTH_BY_APPROACH, FITS, LEAST_CELLS, PLAIN, SHAPES, SimplifiedOptions
from models.contact.undeformed_distance import Distance
from models.core.errors import InputError
from models.machine.compiled import compiled
from models.machine.records import record, records_at_pointer, size_of
from models.machine.stack import DOUBLES, array, beyond

HEAD = record(
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
HEADER = size_of(HEAD)
MOST_CELLS = 200
DEPTH_TOLERANCE = 1e-12
"""Ratio of the error of the approach to the approach beyond first touch at which the search of the depth ends."""
MOST_ITERATIONS = 100


def table(distance: Distance, cells: int = 21, options: SimplifiedOptions = PLAIN) -> Array:
    """Table for an undeformed distance with a single valley, for compiled callers; its first number is below zero. Must
    not be modified.

    cells : strips of the fine net, and cells in each, 3 to 200. Raises InputError, also for several valleys.
    """
    cells = whole_number("cells", cells, LEAST_CELLS, MOST_CELLS)
    patches = separate(distance) if options.separate else [Patch(distance)]
    if len(patches) > 1:
        raise InputError("", "distance", None, f"has {len(patches)} valleys: the compiled theory takes one patch")
    (patch,) = patches
    (x, root_x), (y, root_y) = patch.lines
    head = [
        -cells,
        _callback().address,
        options.net,
        SHAPES[options.shape],
        FITS[options.fit],
        patch.low,
        patch.edge,
        distance.x[0],
        distance.y[0],
        distance.dx,
        distance.dy,
        *patch.bottom[:2],
        x.size,
        y.size,
        *distance.padded.shape,
    ]
    made = np.concatenate((head, x, root_x, y, root_y, distance.padded.ravel()), dtype=float)
    made.setflags(write=False)
    return made


@compiled
def surface_at(numbers, depth):
    """``Surface`` of the patch at a depth (m), as ``Patch.surface`` gives it, from its table."""
    head = records_at_pointer(numbers, 1, HEAD)[0]
    m, n = int(head.lines_x), int(head.lines_y)
    x, y = array(beyond(numbers, HEADER), (2, m)), array(beyond(numbers, HEADER + 2 * m), (2, n))
    shape = int(head.rows), int(head.columns)
    padded = array(beyond(numbers, HEADER + 2 * (m + n)), shape)
    root = math.sqrt(max(depth - head.low, 0.0))
    x0, x1 = valley_ends(x[0], x[1], head.bottom_x, root)
    y0, y1 = valley_ends(y[0], y[1], head.bottom_y, root)
    return Surface(padded, (head.x, head.y), (head.dx, head.dy), (x0, x1, y0, y1), depth, head.low)


@compiled
def fit_at_depth(numbers, depth, modulus):
    """Stiffness 1/W (Pa/m), approach (m) and sum of W p dA of the patch at a depth (m)."""
    head = records_at_pointer(numbers, 1, HEAD)[0]
    return coarse_fit(surface_at(numbers, depth), int(head.net), int(head.shape), int(head.fit), modulus)


@compiled
def depth_at_approach(numbers, approach, modulus):
    """Depth (m) at which the approach (m) is reached, with its stiffness (Pa/m) and sum of W p dA; NaN if the contact
    would pass the table's edge.

    False position by Illinois' rule: the approach grows with the depth, for one valley in proportion.
    """
    head = records_at_pointer(numbers, 1, HEAD)[0]
    low, most = head.low, head.edge - head.low
    over = approach - low
    left, off_left, right, off_right = 0.0, -over, 0.0, -over
    depth = min(DEPTH_BY_APPROACH * over, most)
    last_side = 0
    for _ in range(MOST_ITERATIONS):
        stiffness, reached, volume = fit_at_depth(numbers, low + depth, modulus)
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
def simplified(inputs, numbers, outputs):
    """Solve the patch by the simplified theory and fill ``outputs``; returns its status, FINE or NOT_PLAUSIBLE. The
    caller, ``kernel``, must have checked ``inputs``.

    All pointers to doubles. Zeros where the bodies do not touch; no answer where the contact reaches the edge of the
    distance.
    """
    values, out, head = (
        records_at_pointer(inputs, 1, INPUT)[0],
        records_at_pointer(outputs, 1, OUTPUT)[0],
        records_at_pointer(numbers, 1, HEAD)[0],
    )
    answers = array(outputs, (OUTPUTS,))
    answers[:] = 0.0
    if values.pressing <= head.low:
        return FINE
    depth, stiffness, volume = depth_at_approach(numbers, values.pressing, values.G / (1.0 - values.nu))
    if stiffness * volume > 0.0:
        out.load = stiffness * volume
        _roll(values, numbers, depth, stiffness, out)
    if math.isfinite(stiffness * volume + out.fx + out.fy + out.mz):
        return FINE
    answers[:] = math.nan
    return NOT_PLAUSIBLE


@compiled
def _roll(values, numbers, depth, stiffness, out):
    """Fill the rolling forces of the patch at a depth (m) in ``out``, whose load is known, as
    ``simplified_theory.roll`` does.
    """
    surface, head = surface_at(numbers, depth), records_at_pointer(numbers, 1, HEAD)[0]
    box, cells, meshes = surface.box, -int(head.cells), int(head.net)
    net = strips(surface, cells, cells, int(head.shape))
    normalise(net, out.load)
    motion = values.xi_x, values.xi_y, values.spin
    traction, flexibility = np.empty((net.y.size, cells, 2)), 1.0 / stiffness
    fx = fy = mz = stuck = area = 0.0
    for again in (False, True):
        if again:
            crude, (dx, dy) = coarse_tractions(net, traction, box, meshes), mesh_of(box, meshes)
            cover = coarse_net(surface, meshes, PARABOLIC)[2]
            u = tangential(crude, dx, dy, values.nu) / (math.pi * values.G)
            fitted = tangential_fit(u, crude, cover, dx, dy, int(head.fit))
            flexibility = fitted if fitted > 0.0 else flexibility
        fx, fy, mz, stuck, area = march(net, values.mu, flexibility, motion, traction)
    out.fx, out.fy, out.mz, out.stick = fx, fy, mz, stuck / area
    out.a, out.b = 0.5 * (box[1] - box[0]), 0.5 * (box[3] - box[2])
    out.approach = values.pressing


@compiled
def normalise(net, load):
    """Scale the pressure of a ``FineNet`` to carry the load (N), so that full sliding gives mu N exactly."""
    carried, (strips_, cells) = 0.0, net.pressure.shape
    for s in range(strips_):
        for i in range(cells):
            carried += net.pressure[s, i] * (net.high_x[s] - net.low_x[s]) * net.width / cells
    for s in range(strips_):
        for i in range(cells):
            net.pressure[s, i] *= load / carried


@cache
def _callback():
    """Callback with C calling convention around ``simplified``; tables store its address."""

    @cfunc(types.int32(DOUBLES, DOUBLES, DOUBLES), error_model="numpy")
    def law(inputs, numbers, outputs):
        return simplified(inputs, numbers, outputs)

    return law
