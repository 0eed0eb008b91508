"""Kalker's theory of 1983 (``simplified_theory``) for compiled callers: one patch of any shape, at its approach.

The undeformed distance and the way the theory is used are a table of doubles that ``table`` makes. The kernel finds
the depth that has the approach, marches, fits W_1 = W_2 and marches again, by the compiled parts of the package: its
numbers are those of ``press`` and ``roll``. Nothing is raised. The work arrays, some ten kilobytes, are taken from the
heap and given back within the call, which is a hundredth of its time; no lock, nothing kept, any number of threads.
"""

import math
from functools import cache

import numpy as np
from numba import carray, cfunc, types

from models.contact.distance_kernels import sides
from models.contact.inputs import Array, whole_number
from models.contact.kernel import (
    APPROACH,
    AXIS_A,
    AXIS_B,
    CREEP_X,
    CREEP_Y,
    FINE,
    FRICTION,
    FX,
    FY,
    INPUTS,
    MODULUS,
    MZ,
    NORMAL,
    NOT_PLAUSIBLE,
    OUTPUTS,
    POISSON,
    PRESSING,
    STICK,
    TURNING,
)
from models.contact.patches import Patch, separate
from models.contact.simplified_kernels import (
    PARABOLIC,
    crude_fit,
    crude_net,
    gather,
    march,
    strips,
    tangential,
    tangential_fit,
)
from models.contact.simplified_theory import ABOUT, FITS, LEAST_CELLS, PLAIN, SHAPES, Options
from models.contact.undeformed_distance import Distance
from models.core.errors import InputError
from models.machine.compiled import compiled
from models.machine.stack import DOUBLES, beyond

_CELLS, _LAW, _NET, _SHAPE, _FIT, _LOW, _EDGE, _X, _Y, _DX, _DY, _BOTTOM_X, _BOTTOM_Y = range(13)
_LINES_X, _LINES_Y, _ROWS, _COLUMNS, _HEAD = range(13, 18)
"""Places in the table: minus the cells; address of the law; net, shape and fit; least distance and depth at which a
side is reached (m); first node, spacing and bottom along x and y (m); lengths. Then lines and roots along x and y, and
padded heights."""
MOST_CELLS = 200
SETTLED = 1e-12
"""Share of the approach, from first touch on, to which the depth settles."""
TRIES = 100


def table(distance: Distance, cells: int = 21, options: Options = PLAIN) -> Array:
    """Table for an undeformed distance of one valley; its first number is below zero. Not to be changed.

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
        _law().address,
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
    """What compiled functions read of the patch at a depth (m), as ``Patch.surface`` has it."""
    head = carray(numbers, (_HEAD,))
    m, n = int(head[_LINES_X]), int(head[_LINES_Y])
    x, y = carray(beyond(numbers, _HEAD), (2, m)), carray(beyond(numbers, _HEAD + 2 * m), (2, n))
    shape = int(head[_ROWS]), int(head[_COLUMNS])
    padded = carray(beyond(numbers, _HEAD + 2 * (m + n)), shape)
    root = math.sqrt(max(depth - head[_LOW], 0.0))
    x0, x1 = sides(x[0], x[1], head[_BOTTOM_X], root)
    y0, y1 = sides(y[0], y[1], head[_BOTTOM_Y], root)
    return padded, (head[_X], head[_Y]), (head[_DX], head[_DY]), (x0, x1, y0, y1), depth, head[_LOW]


@compiled
def fit_at(numbers, depth, modulus):
    """Stiffness 1/W (Pa/m), approach (m) and sum of W p dA at a depth (m)."""
    head = carray(numbers, (_HEAD,))
    return crude_fit(*surface_at(numbers, depth), int(head[_NET]), int(head[_SHAPE]), int(head[_FIT]), modulus)


@compiled
def settle(numbers, approach, modulus):
    """Depth (m), stiffness and sum of W p dA that belong to an approach (m); not a number beyond the table's edge.

    False position by Illinois' rule: the approach grows with the depth, for one valley in proportion.
    """
    head = carray(numbers, (_HEAD,))
    low, most = head[_LOW], head[_EDGE] - head[_LOW]
    over = approach - low
    left, off_left, right, off_right = 0.0, -over, 0.0, -over
    depth = min(ABOUT * over, most)
    kept = 0
    for _ in range(TRIES):
        stiffness, reached, volume = fit_at(numbers, low + depth, modulus)
        off = reached - approach
        if abs(off) <= SETTLED * over:
            return low + depth, stiffness, volume
        if not math.isfinite(off) or (off < 0.0 and depth >= most):
            break
        if off < 0.0:
            left, off_left = depth, off
            off_right *= 0.5 if kept < 0 else 1.0
            kept = -1
        else:
            right, off_right = depth, off
            off_left *= 0.5 if kept > 0 else 1.0
            kept = 1
        if right <= 0.0:  # not yet enclosed
            depth, kept = min(1.5 * depth, most), 0
            continue
        depth = (left * off_right - right * off_left) / (off_right - off_left)
        if not left < depth < right:
            return low + depth, stiffness, volume  # rounding leaves nothing between
    return math.nan, math.nan, math.nan


@compiled
def simplified(inputs, numbers, outputs):
    """Status of the patch, FINE or NOT_PLAUSIBLE; fills ``outputs``, of ``inputs`` that ``kernel`` has found fine.

    All pointers to doubles. Zeros where the bodies do not touch; no answer where the contact reaches the edge of the
    distance.
    """
    values, out, head = carray(inputs, (INPUTS,)), carray(outputs, (OUTPUTS,)), carray(numbers, (_HEAD,))
    out[:] = 0.0
    if values[PRESSING] <= head[_LOW]:
        return FINE
    depth, stiffness, volume = settle(numbers, values[PRESSING], values[MODULUS] / (1.0 - values[POISSON]))
    if stiffness * volume > 0.0:
        _roll(values, numbers, head, depth, stiffness, stiffness * volume, out)
    if math.isfinite(stiffness * volume + out[FX] + out[FY] + out[MZ]):
        return FINE
    out[:] = math.nan
    return NOT_PLAUSIBLE


@compiled
def _roll(values, numbers, head, depth, stiffness, load, out):
    """Fill ``out`` of the patch at a depth: as ``simplified_theory.roll``."""
    surface = surface_at(numbers, depth)
    box, cells, net, shear = surface[3], -int(head[_CELLS]), int(head[_NET]), values[MODULUS]
    y, low_x, high_x, pressure = strips(*surface, cells, cells, int(head[_SHAPE]))
    width = (box[3] - box[2]) / cells
    normalise(pressure, low_x, high_x, width, load)
    traction, flexibility = np.empty((y.size, cells, 2)), 1.0 / stiffness
    fx = fy = mz = stuck = area = 0.0
    for again in (False, True):
        if again:
            crude = gather(y, low_x, high_x, width, traction, box, net)
            dx, dy = (box[1] - box[0]) / net, (box[3] - box[2]) / net
            cover = crude_net(*surface, net, PARABOLIC)[2]
            u = tangential(crude, dx, dy, values[POISSON]) / (math.pi * shear)
            fitted = tangential_fit(u, crude, cover, dx, dy, int(head[_FIT]))
            flexibility = fitted if fitted > 0.0 else flexibility
        motion = values[CREEP_X], values[CREEP_Y], values[TURNING]
        fx, fy, mz, stuck, area = march(
            y, low_x, high_x, width, pressure, values[FRICTION], flexibility, *motion, traction
        )
    out[FX], out[FY], out[MZ], out[STICK] = fx, fy, mz, stuck / area
    out[AXIS_A], out[AXIS_B] = 0.5 * (box[1] - box[0]), 0.5 * (box[3] - box[2])
    out[NORMAL], out[APPROACH] = load, values[PRESSING]


@compiled
def normalise(pressure, low_x, high_x, width, load):
    """Scale the pressure of strips (s, n) to carry the load (N), so that full sliding gives mu N exactly."""
    carried = 0.0
    strips_, cells = pressure.shape
    for s in range(strips_):
        for i in range(cells):
            carried += pressure[s, i] * (high_x[s] - low_x[s]) * width / cells
    for s in range(strips_):
        for i in range(cells):
            pressure[s, i] *= load / carried


@cache
def _law():
    """A shell about ``simplified``, whose address the tables hold."""

    @cfunc(types.int32(DOUBLES, DOUBLES, DOUBLES), error_model="numpy")
    def law(inputs, numbers, outputs):
        return simplified(inputs, numbers, outputs)

    return law
