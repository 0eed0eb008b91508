"""Contact of a conical wheel with a rail whose head is a circular cylinder along the track, in closed form.

All planes that touch a cone pass through its apex. A plane that touches the rail as well has a normal square to x,
which singles out one of them: the one whose distance from the cylinder's axis is the head's radius where wheel and rail
just touch. How much smaller the distance is, is the penetration. The generator of the cone in this plane crosses the
cylinder's axis, seen along the normal, at the place of contact, which is taken on the wheel's undeformed surface.
"""

import math
from typing import NamedTuple

from models.machine.compiled import inlined

RIGHT, LEFT = 1.0, -1.0


class ConicalWheel(NamedTuple):
    """Geometry of a conical wheel and its rail: radius of the wheel and half the distance of both contact points in the
    middle of the track (m), tangent of the cone's half angle, radius of the rail's head (m)."""

    radius: float
    half_gauge: float
    conicity: float
    head: float


@inlined
def cone_on_rail(wheel_side, wheelset_pose, cone):
    """Contact of one conical wheel with its rail: (penetration, rolling radius, n_y, n_z, x, y, z).

    wheel_side : RIGHT or LEFT; wheelset_pose : y, z of the wheelset's centre (m), roll, yaw (rad); cone :
    ``ConicalWheel``. The normal (0, n_y, n_z) points into the rail; the place is relative to the wheelset's centre, in
    the track's axes (m). Penetration is negative where there is a gap. Yaw and roll must be less than a right angle
    less the cone's.
    """
    (y, z, roll, yaw), (radius, half_gauge, conicity, head) = wheelset_pose, cone
    cosine = 1.0 / math.sqrt(1.0 + conicity * conicity)
    sine = conicity * cosine
    cr, sr, cy, sy = math.cos(roll), math.sin(roll), math.cos(yaw), math.sin(yaw)
    contact_angle = math.asin(wheel_side * conicity * sy * cr / math.hypot(cy, sy * sr)) - math.atan2(sy * sr, cy)
    ca, sa = math.cos(contact_angle), math.sin(contact_angle)
    n_y = sy * cosine * sa + cy * (wheel_side * sine * cr - cosine * ca * sr)
    n_z = wheel_side * sine * sr + cosine * ca * cr
    reach = half_gauge + radius / conicity  # from the wheelset's centre to the apex
    apex_x, apex_y, apex_z = -wheel_side * reach * sy * cr, wheel_side * reach * cy * cr, wheel_side * reach * sr
    axis_y = wheel_side * (half_gauge + head * sine) - y - apex_y  # the head's axis, seen from the apex
    axis_z = radius + head * cosine - z - apex_z
    penetration = head - (n_y * axis_y + n_z * axis_z)
    # The generator per unit of the cone's radius, from the apex inwards: (sin ahead, -side / conicity, cos ahead).
    inward = -wheel_side / conicity
    across_inward = inward * cr - ca * sr
    way_x, way_y, way_z = cy * sa - sy * across_inward, sy * sa + cy * across_inward, inward * sr + ca * cr
    rolling = (n_z * axis_y - n_y * axis_z) / (n_z * way_y - n_y * way_z)
    return (
        penetration,
        rolling,
        n_y,
        n_z,
        apex_x + rolling * way_x,
        apex_y + rolling * way_y,
        apex_z + rolling * way_z,
    )
