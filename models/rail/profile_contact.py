"""Compiled contact of a wheel and a rail of any cross-section: its patches, each with depth, normal and curvatures.

The wheel is a body of revolution. Of each of its circles one point is nearest to a straight rail, with roll and yaw in
it (the outline of ``models.contact.wheel_on_rail``); how deep it lies in the rail along the rail's normal is its depth
w. The contour is divided into zones, once and for all, at the places that first contact jumps across; shares of
neighbouring zones add up to one. In every zone moments over the contour describe one patch:

    place, normal, radius   means, weighted by w^2
    penetration             (7/6) int w^3 / int w^2
    semi-width of overlap   the root of 7 times the variance of the place

Where the depth is a parabola these are its depth and its width to the last digit, hence Hertz' contact. Elsewhere they
are means, over a length between that of the overlap and that of Hertz' pressure: of the whole powers it is the one
with which S1002 on UIC 60 bears where the exact contact does. All of them move smoothly with the wheelset, and a load
goes over from one zone to the next without a jump. Patches of one wheel press the surface down under each other
(``settled``).

The place lies ahead of the axle or behind it under yaw, and the depth grows, as the outline has it. Left out: that
the axes of a patch turn about its normal under yaw, a conforming patch's curvature in its own plane, and that normal
force and curvature follow from different means, so that the work on the way to a place depends on the way by one or two
hundredth parts (``energy`` adds up what was done on the way).
"""

import math

import numpy as np

from models.contact.hertz import aspect
from models.machine.compiled import lean, njit

ZONES, NODES, KNOTS, SPACING, ARM, LEVEL, HEADER = range(7)
"""Head of a profile's numbers: counts of zones, of the wheel's nodes and of the rail's knots; distance of the nodes
along the contour (m), distance of the taping line from the middle of the axle, height of the axle over the rail's top
where both wheels just touch in the middle of the track. Then, by node, place from the taping line, radius, slope and
zone; then, by knot, place from the middle of the track and the four coefficients of the cubic beyond it."""
OF_NODE, OF_KNOT = 4, 5
DEPTH, N_Y, N_Z, X_, Y_, Z_, ALONG, ACROSS, TOUCH = range(9)
"""Columns of a touch: penetration (m), normal into the rail, place from the wheelset's centre in the track's axes (m),
curvatures A and B of the undeformed distance along and across (1/m)."""
COARSE = 5
"""Nodes from one to the next that is always looked at."""
MARGIN = 2e-5
"""Depth (m) below the rail up to which the nodes between are looked at as well: two radii of 13 mm rise by 5e-6."""
FAR = 1e-3
"""Height (m) over the rail at which no slope of a rail leaves less than the margin."""
SWEEPS = 6
"""Times that the patches' shares are found anew; each makes the error of the last some hundred times less."""
SHARPEST = 500.0
"""Curvature (1/m) of a patch that only one node lies in."""
W2, W3, S1, S2, NY, NZ, RX, RY, RZ, RADIUS, SUMS = range(11)
_LEAST = 1e-40
"""m^2: sums of squares of depths far below an atom's are none."""


@njit(cache=True, error_model="numpy")
def profile_on_rail(side, y, z, roll, yaw, p, modulus, touches):
    """Fill ``touches`` (zones, TOUCH) of the right (side 1) or left (-1) wheel; a depth of 0 or less is no contact.

    y, z : of the wheelset's centre (m), roll, yaw : rad, as in ``models.rail``; p : numbers of the profiles;
    modulus : E* (Pa).
    """
    sums = np.zeros((int(p[ZONES]), SUMS))
    pose = _pose(side * y, z + p[LEVEL], side * roll, side * yaw)  # the left wheel is the right one in a mirror
    knot, before = 0, -1.0
    for j in range(0, int(p[NODES]), COARSE):
        node = _node(j, pose, p, knot)
        knot = node[-1]
        if max(before, node[0]) > -MARGIN:
            for i in range(max(0, j - COARSE), j):
                fine = _node(i, pose, p, knot)
                if fine[0] > 0.0:
                    _add(i, fine, p, sums)
        before = node[0]
    together = 0
    for zone in range(len(sums)):
        _patch(side, sums[zone], pose, touches[zone])
        together += touches[zone, DEPTH] > 0.0
    if together > 1:
        settled(touches, modulus)


@lean
def _pose(y, z, roll, yaw):
    """Place, cosines and sines of roll and yaw, and what the nearest point of a circle needs."""
    cr, sr, cy, sy = math.cos(roll), math.sin(roll), math.cos(yaw), math.sin(yaw)
    lead = sr * sy / cy
    level = 1.0 / math.sqrt(1.0 + lead * lead)
    return y, z, cr, sr, cy, sy, lead, level, cr * sy / cy * level


@lean
def _node(j, pose, p, knot):
    """Depth of a node's circle along the rail's normal (m), place x, y, z from the centre, slope of the rail, knot."""
    y, z, cr, sr, cy, sy, lead, level, steer = pose
    at, rail = HEADER + OF_NODE * j, HEADER + OF_NODE * int(p[NODES])
    sine = min(1.0, max(-1.0, -p[at + 2] * steer))
    cosine = math.sqrt(1.0 - sine * sine)
    ahead = p[at + 1] * (sine - cosine * lead) * level
    down = p[at + 1] * (cosine + sine * lead) * level
    own = p[ARM] + p[at]
    across = cr * own - sr * down
    place_x, place_y, place_z = cy * ahead - sy * across, sy * ahead + cy * across, sr * own + cr * down
    here, last = y + place_y, int(p[KNOTS]) - 1
    if not p[rail] <= here < p[rail + OF_KNOT * last]:
        return -1.0, place_x, place_y, place_z, 0.0, knot
    while here < p[rail + OF_KNOT * knot]:
        knot -= 1
    while here >= p[rail + OF_KNOT * (knot + 1)]:
        knot += 1
    k = rail + OF_KNOT * knot
    t = here - p[k]
    over = z + place_z - (p[k + 1] + t * (p[k + 2] + t * (p[k + 3] + t * p[k + 4])))
    if over < -FAR:
        return -1.0, place_x, place_y, place_z, 0.0, knot
    slope = p[k + 2] + t * (2.0 * p[k + 3] + 3.0 * t * p[k + 4])
    return over / math.sqrt(1.0 + slope * slope), place_x, place_y, place_z, slope, knot


@lean
def _add(j, node, p, sums):
    """Add a node in contact to the sums of its zone, or of the two that pass into each other there."""
    depth, place_x, place_y, place_z, slope, _ = node
    at, length, upright = HEADER + OF_NODE * j, j * p[SPACING], 1.0 / math.sqrt(1.0 + slope * slope)
    zone = int(p[at + 3])
    share = p[at + 3] - zone
    for part in range(2):
        weight = (share if part == 1 else 1.0 - share) * depth**2
        if weight > 0.0:
            to = sums[zone + part]
            to[W2] += weight
            to[W3] += weight * depth
            to[S1] += weight * length
            to[S2] += weight * length * length
            to[NY] -= weight * slope * upright
            to[NZ] += weight * upright
            to[RX] += weight * place_x
            to[RY] += weight * place_y
            to[RZ] += weight * place_z
            to[RADIUS] += weight * p[at + 1]


@lean
def _patch(side, sums, pose, touch):
    """One touch from its zone's sums."""
    touch[:] = 0.0
    whole = sums[W2]
    if whole <= _LEAST:
        return
    middle, size = sums[S1] / whole, math.hypot(sums[NY], sums[NZ])
    depth, n_y, n_z = 3.5 / 3.0 * sums[W3] / whole, sums[NY] / size, sums[NZ] / size
    spread = max(0.0, 7.0 * (sums[S2] / whole - middle * middle))
    touch[DEPTH], touch[N_Y], touch[N_Z] = depth, side * n_y, n_z
    touch[X_], touch[Y_], touch[Z_] = sums[RX] / whole, side * sums[RY] / whole, sums[RZ] / whole
    _, _, cr, sr, cy = pose[:5]
    touch[ALONG] = 0.5 * (n_z * cr - n_y * cy * sr) * whole / sums[RADIUS]
    touch[ACROSS] = depth / (spread + depth / SHARPEST)


@njit(cache=True, error_model="numpy")
def settled(touches, modulus):
    """Reduce the depths of one wheel's touches (zones, TOUCH) by what each presses down under the others.

    modulus : E* (Pa). A load N presses a half-space down by N / (pi E* r) at a distance r, to which the mean square
    lengths of both patches are added.
    """
    n = len(touches)
    own, load, axis = touches[:, DEPTH].copy(), np.zeros(n), np.empty(n)
    for i in range(n):
        load[i], axis[i] = pressed(own[i], touches[i, ALONG], touches[i, ACROSS], modulus)[:2]
    stiff = load.copy()
    for _ in range(SWEEPS):
        for i in range(n):
            down = 0.0
            for j in range(n):
                if j != i and load[j] > 0.0:
                    down += load[j] * _alike(touches[i], touches[j], axis[i] ** 2 + axis[j] ** 2)
            touches[i, DEPTH] = own[i] - down / (math.pi * modulus)
            load[i] = stiff[i] * (max(0.0, touches[i, DEPTH]) / own[i]) ** 1.5 if stiff[i] > 0.0 else 0.0


@lean
def _alike(one, other, squares):
    """Cosine between the normals of two touches by their distance (1/m)."""
    apart = (one[X_] - other[X_]) ** 2 + (one[Y_] - other[Y_]) ** 2 + (one[Z_] - other[Z_]) ** 2
    return (one[N_Y] * other[N_Y] + one[N_Z] * other[N_Z]) / math.sqrt(apart + squares / 5.0)


@lean
def pressed(penetration, along, across, modulus):
    """Elastic normal force (N) and semi-axes (m) at a penetration (m), curvatures 1/m, E* (Pa); zeros for a gap."""
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    g, cosine, sine = aspect(min(along, across) / max(along, across))
    short = math.sqrt(penetration * cosine / (max(along, across) * (cosine + sine)))
    load = 2.0 / 3.0 * math.pi * modulus * penetration * short / (g * (cosine + sine))
    if along <= across:
        return load, short / g, short
    return load, short, short / g
