"""State of a free vehicle at one instant, as its compiled forces read it: the yawing carrier frame, the tree of bodies,
and the arrays to which forces are added.

The carrier, the first three coordinates, has the frame in which the tree's vectors are given.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from models.machine.compiled import lean


class CarrierFrame(NamedTuple):
    """Motion of the carrier frame: cosine and sine of its heading, its position (m), the velocity of its origin along
    its own axes x and y (m/s), and its yaw rate (rad/s)."""

    cosine: float
    sine: float
    x: float
    y: float
    forward_speed: float
    lateral_speed: float
    yaw_rate: float


class BodyTree(NamedTuple):
    """Pointers to the rows of bodies (links) and of force points (spots), see ``models.multibody.tree``, and the forces
    (GROUND,) on the carrier."""

    links: Any
    spots: Any
    ground: np.ndarray


class MovingVehicle(NamedTuple):
    """State of a free vehicle, and the arrays to which its compiled forces are added.

    rates, forces (n,) : of the coordinates; ledger (LEDGER,) : see ``forces``; chassis (PER_LINK,) : its link.
    """

    rates: np.ndarray
    forces: np.ndarray
    ledger: np.ndarray
    frame: CarrierFrame
    tree: BodyTree
    chassis: np.ndarray


class WheelContact(NamedTuple):
    """Contact of a wheel with the road, columns as in ``forces`` and ``models.contact.fastsim_many``.

    patch (10,) : what the tyre's contact is, as creep forces read it; slip (4,) : velocities of slip along and across
    (m/s), turning (rad/s), speed of the tread (m/s); way (WAY,) : where it is and its axes; report (REPORTED,).
    """

    patch: np.ndarray
    slip: np.ndarray
    way: np.ndarray
    report: np.ndarray


@lean
def carrier_frame(q, v):
    """The ``CarrierFrame`` at the vehicle's coordinates and rates (n,)."""
    cosine, sine = math.cos(q[2]), math.sin(q[2])
    return CarrierFrame(cosine, sine, q[0], q[1], cosine * v[0] + sine * v[1], cosine * v[1] - sine * v[0], v[2])


@lean
def carried_velocity(moving_frame, position):
    """Velocity (m/s) that the carrier's motion gives to a point at a position (m), both in the carrier's axes."""
    return (
        moving_frame.forward_speed - moving_frame.yaw_rate * position[1],
        moving_frame.lateral_speed + moving_frame.yaw_rate * position[0],
        0.0,
    )


@lean
def ground_position(moving_frame, position):
    """Position x, y (m) on the ground of a point at a position (m) in the carrier's axes."""
    return (
        moving_frame.x + moving_frame.cosine * position[0] - moving_frame.sine * position[1],
        moving_frame.y + moving_frame.sine * position[0] + moving_frame.cosine * position[1],
    )
