"""Compiled contact of a wheel and a rail of any cross-section: its contact patches, each with penetration, normal and
curvatures.

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
(``settle_depths``).

The place lies ahead of the axle or behind it under yaw, and the depth grows, as the outline has it. Left out: that
the axes of a patch turn about its normal under yaw, a conforming patch's curvature in its own plane, and that normal
force and curvature follow from different means, so that the work on the way to a place depends on the way by one or two
hundredth parts (``energy`` adds up what was done on the way).
"""

import math
from typing import NamedTuple

import numpy as np

from models.contact.hertz import axis_ratio_and_integrals
from models.contact.inputs import Array
from models.machine.compiled import lean, njit
from models.machine.records import record

PROFILE_COUNTS = record("zones", "nodes", "knots", "spacing", "arm", "level")
"""Head of a laid profile: counts of zones, of the wheel's nodes and of the rail's knots; spacing of the nodes along the
contour (m), distance of the taping line from the middle of the axle (m), height of the axle over the rail's top where
both wheels just touch in the middle of the track (m)."""
WHEEL_NODE_RECORD = record("y", "radius", "slope", "zone")
"""Node of the wheel's contour: position from the taping line (m), radius (m), slope and zone."""
RAIL_KNOT_RECORD = record("y", "c0", "c1", "c2", "c3")
"""Knot of the rail's contour: position from the middle of the track (m) and the coefficients of the cubic beyond it."""
TOUCH_RECORD = record("depth", "n_y", "n_z", "x", "y", "z", "along", "across")
"""Contact patch: penetration (m), normal into the rail, position from the wheelset's centre in the track's axes (m),
curvatures A and B of the undeformed distance along and across (1/m)."""
_SUMS = record("w2", "w3", "s1", "s2", "n_y", "n_z", "x", "y", "z", "radius")


class WheelPose(NamedTuple):
    """Position of a wheelset: its centre relative to the track's middle (m), roll and yaw (rad)."""

    y: float
    z: float
    roll: float
    yaw: float


class LaidProfile(NamedTuple):
    """Wheel and rail profile as records: PROFILE_COUNTS (1,), WHEEL_NODE (nodes,), RAIL_KNOT (knots,)."""

    head: Array
    nodes: Array
    knots: Array


COARSE_NODES = 5
"""Distance, in nodes, of the nodes that are always evaluated."""
SEARCH_MARGIN = 2e-5
"""Height (m) over the rail up to which the nodes between are evaluated as well: two radii of 13 mm rise by 5e-6."""
FAR_HEIGHT = 1e-3
"""Height (m) over the rail above which a node is out of contact whatever the slope of the rail is."""
SHARE_SWEEPS = 6
"""Count of iterations of the patches' loads; each makes the error some hundred times smaller."""
SHARPEST_CURVATURE = 500.0
"""Curvature (1/m) of a patch that contains a single node."""
_LEAST_DEPTH_SQUARE = 1e-40
"""Sum of squares of depths (m^2) below which there is no contact."""


@njit(cache=True, error_model="numpy")
def profile_on_rail(wheel_side, wheelset_pose, laid_profile, contact_modulus, zone_touches):
    """Fill the contact patches ``zone_touches``, TOUCH (zones,), of the right (side 1) or left (-1) wheel; a depth of 0
    or less is no contact.

    wheelset_pose : ``WheelPose``; laid_profile : ``LaidProfile``; contact_modulus : E* (Pa).
    """
    head = laid_profile.head[0]
    sums = np.zeros(int(head.zones), _SUMS)
    y, z, roll, yaw = wheelset_pose
    wheel_pose = _pose_of_wheel(
        wheel_side * y, z + head.level, wheel_side * roll, wheel_side * yaw
    )  # the left wheel is the right one in a mirror
    knot, previous_depth = 0, -1.0
    for j in range(0, int(head.nodes), COARSE_NODES):
        node = _node_contact(laid_profile.nodes[j], wheel_pose, head, laid_profile.knots, knot)
        knot = node[-1]
        if max(previous_depth, node[0]) > -SEARCH_MARGIN:
            for i in range(max(0, j - COARSE_NODES), j):
                fine = _node_contact(laid_profile.nodes[i], wheel_pose, head, laid_profile.knots, knot)
                if fine[0] > 0.0:
                    _add_node(laid_profile.nodes[i], fine, i * head.spacing, sums)
        previous_depth = node[0]
    together = 0
    for zone in range(len(sums)):
        _fill_touch(wheel_side, sums[zone], wheel_pose, zone_touches[zone])
        together += zone_touches[zone].depth > 0.0
    if together > 1:
        settle_depths(zone_touches, contact_modulus)


@lean
def _pose_of_wheel(y, z, roll, yaw):
    """Position (m), cosines and sines of roll and yaw, and factors for the point of a wheel circle nearest to the
    rail."""
    cr, sr, cy, sy = math.cos(roll), math.sin(roll), math.cos(yaw), math.sin(yaw)
    lead = sr * sy / cy
    level = 1.0 / math.sqrt(1.0 + lead * lead)
    return y, z, cr, sr, cy, sy, lead, level, cr * sy / cy * level


@lean
def _node_contact(wheel_node, wheel_pose, rail_head, rail_knots, knot_guess):
    """Contact of the wheel circle through a wheel_node: depth along the rail's normal (m), position x, y, z from the
    centre (m), slope of the rail, and the index of the knot.
    """
    y, z, cr, sr, cy, sy, lead, level, steer = wheel_pose
    sine = min(1.0, max(-1.0, -wheel_node.slope * steer))
    cosine = math.sqrt(1.0 - sine * sine)
    x_on_circle = wheel_node.radius * (sine - cosine * lead) * level
    z_on_circle = wheel_node.radius * (cosine + sine * lead) * level
    arm = rail_head.arm + wheel_node.y
    across = cr * arm - sr * z_on_circle
    place_x, place_y, place_z = (
        cy * x_on_circle - sy * across,
        sy * x_on_circle + cy * across,
        sr * arm + cr * z_on_circle,
    )
    y_on_rail, last_knot = y + place_y, int(rail_head.knots) - 1
    if not rail_knots[0].y <= y_on_rail < rail_knots[last_knot].y:
        return -1.0, place_x, place_y, place_z, 0.0, knot_guess
    while y_on_rail < rail_knots[knot_guess].y:
        knot_guess -= 1
    while y_on_rail >= rail_knots[knot_guess + 1].y:
        knot_guess += 1
    cubic = rail_knots[knot_guess]
    t = y_on_rail - cubic.y
    vertical_depth = z + place_z - (cubic.c0 + t * (cubic.c1 + t * (cubic.c2 + t * cubic.c3)))
    if vertical_depth < -FAR_HEIGHT:
        return -1.0, place_x, place_y, place_z, 0.0, knot_guess
    slope = cubic.c1 + t * (2.0 * cubic.c2 + 3.0 * t * cubic.c3)
    return vertical_depth / math.sqrt(1.0 + slope * slope), place_x, place_y, place_z, slope, knot_guess


@lean
def _add_node(wheel_node, node_contact, node_length, zone_sums):
    """Add a touching node, which represents a length (m) of the contour, to the sums of its zone, or of both zones in a
    transition."""
    depth, place_x, place_y, place_z, slope, _ = node_contact
    upright = 1.0 / math.sqrt(1.0 + slope * slope)
    zone = int(wheel_node.zone)
    share = wheel_node.zone - zone
    for zone_side in range(2):
        weight = (share if zone_side == 1 else 1.0 - share) * depth**2
        if weight > 0.0:
            to = zone_sums[zone + zone_side]
            to.w2 += weight
            to.w3 += weight * depth
            to.s1 += weight * node_length
            to.s2 += weight * node_length * node_length
            to.n_y -= weight * slope * upright
            to.n_z += weight * upright
            to.x += weight * place_x
            to.y += weight * place_y
            to.z += weight * place_z
            to.radius += weight * wheel_node.radius


@lean
def _fill_touch(wheel_side, zone_sums, wheel_pose, zone_touch):
    """Fill a contact patch from the sums of its zone."""
    zone_touch.depth = zone_touch.n_y = zone_touch.n_z = zone_touch.x = zone_touch.y = zone_touch.z = (
        zone_touch.along
    ) = zone_touch.across = 0.0
    weight_sum = zone_sums.w2
    if weight_sum <= _LEAST_DEPTH_SQUARE:
        return
    middle, size = zone_sums.s1 / weight_sum, math.hypot(zone_sums.n_y, zone_sums.n_z)
    depth, n_y, n_z = 3.5 / 3.0 * zone_sums.w3 / weight_sum, zone_sums.n_y / size, zone_sums.n_z / size
    spread = max(0.0, 7.0 * (zone_sums.s2 / weight_sum - middle * middle))
    zone_touch.depth, zone_touch.n_y, zone_touch.n_z = depth, wheel_side * n_y, n_z
    zone_touch.x, zone_touch.y, zone_touch.z = (
        zone_sums.x / weight_sum,
        wheel_side * zone_sums.y / weight_sum,
        zone_sums.z / weight_sum,
    )
    _, _, cr, sr, cy = wheel_pose[:5]
    zone_touch.along = 0.5 * (n_z * cr - n_y * cy * sr) * weight_sum / zone_sums.radius
    zone_touch.across = depth / (spread + depth / SHARPEST_CURVATURE)


@njit(cache=True, error_model="numpy")
def settle_depths(zone_touches, contact_modulus):
    """Reduce the depths of one wheel's touches, TOUCH (zones,), by the elastic displacement that each touch's load
    causes at the others.

    contact_modulus : E* (Pa). A load N displaces the surface of a half-space by N / (pi E* r) at a distance r. To r^2,
    the mean square lengths of both patches are added.
    """
    n = len(zone_touches)
    unloaded_depths, load, axis = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        touch = zone_touches[i]
        unloaded_depths[i] = touch.depth
        load[i], axis[i] = normal_force_and_axes(touch.depth, touch.along, touch.across, contact_modulus)[:2]
    stiff = load.copy()
    for _ in range(SHARE_SWEEPS):
        for i in range(n):
            displacement = 0.0
            for j in range(n):
                if j != i and load[j] > 0.0:
                    displacement += load[j] * _cosine_of_normals(
                        zone_touches[i], zone_touches[j], axis[i] ** 2 + axis[j] ** 2
                    )
            depth = unloaded_depths[i] - displacement / (math.pi * contact_modulus)
            zone_touches[i].depth = depth
            load[i] = stiff[i] * (max(0.0, depth) / unloaded_depths[i]) ** 1.5 if stiff[i] > 0.0 else 0.0


@lean
def _cosine_of_normals(first_touch, second_touch, squared_lengths):
    """Ratio (1/m) of the cosine between the normals of two patches to their distance; ``squared_lengths`` (m^2) are
    added to the squared distance.
    """
    squared_distance = (
        (first_touch.x - second_touch.x) ** 2
        + (first_touch.y - second_touch.y) ** 2
        + (first_touch.z - second_touch.z) ** 2
    )
    return (first_touch.n_y * second_touch.n_y + first_touch.n_z * second_touch.n_z) / math.sqrt(
        squared_distance + squared_lengths / 5.0
    )


@lean
def normal_force_and_axes(penetration, curvature_along, curvature_across, contact_modulus):
    """Elastic normal force (N) and semi-axes (m) from a penetration (m), curvatures along and across (1/m) and E* (Pa);
    zeros where there is a gap."""
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    g, cosine, sine = axis_ratio_and_integrals(
        min(curvature_along, curvature_across) / max(curvature_along, curvature_across)
    )
    short = math.sqrt(penetration * cosine / (max(curvature_along, curvature_across) * (cosine + sine)))
    load = 2.0 / 3.0 * math.pi * contact_modulus * penetration * short / (g * (cosine + sine))
    if curvature_along <= curvature_across:
        return load, short / g, short
    return load, short, short / g
