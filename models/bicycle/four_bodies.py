"""The bicycle's bodies in the common vehicle description, their coordinates, and the result of a run.

Axes of ISO 8855: x forward, y to the left, z up; lean to the right is positive, as a right-handed turn about x. The
design position has the steering axis upright, so that it lies along a joint's z: the pitch of the rear frame is -tilt
where the bicycle stands. Coordinates: x, y, yaw of the carrier, which is below the rear wheel's centre; height (less
the radius), lean, pitch of the frame; spin of the rear wheel; steer to the left; spin of the front wheel.
"""

import math
from dataclasses import dataclass

import numpy as np

from models.bicycle.whipple import Whipple
from models.vehicles.spatial import Body, SpatialVehicle

X, Y, YAW, HEIGHT, LEAN, PITCH, REAR, STEER, FRONT = range(COUNT := 9)
FALLEN_LEAN = 1.4
"""Lean angle (rad) at which a run ends, as the bicycle lies on the ground."""


@dataclass(frozen=True, eq=False)
class BicycleRide:
    """Result of a bicycle run: times (n,) in s, positions and rates (n, 9), energy (n,) and work (n,) of tyres and
    control since the start (J), and the number of steps; reports (n, 2, REPORTED) of the tyres, None for ideally
    rolling wheels.
    """

    times: np.ndarray
    positions: np.ndarray
    rates: np.ndarray
    energy: np.ndarray
    work: np.ndarray
    steps: int
    tyres: np.ndarray | None = None

    def unaccounted(self) -> float:
        """Largest energy change that neither tyres nor control explain, as a ratio to the energy at the start."""
        return float(np.abs(self.energy - self.work - self.energy[0]).max() / abs(self.energy[0]))


def bicycle_of_four_bodies(bicycle: Whipple) -> SpatialVehicle:
    """The bicycle's bodies in tree order, as a vehicle description in the design position with the steering axis
    upright.
    """
    sine, cosine = math.sin(bicycle.tilt), math.cos(bicycle.tilt)
    rotation = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    origin = np.array([0.0, 0.0, bicycle.rear_wheel.radius])

    def place(x: float, z: float) -> tuple[float, float, float]:
        x, y, z = (origin + rotation @ (np.array([x, 0.0, z]) - origin)).tolist()
        return x, y, z

    def tensor(inertia: np.ndarray) -> tuple[tuple[float, float, float], ...]:
        flip = np.diag([1.0, -1.0, -1.0])
        return tuple(map(tuple, (rotation @ flip @ inertia @ flip @ rotation.T).tolist()))

    R, B, H, F = bicycle.rear_wheel, bicycle.body, bicycle.front_frame, bicycle.front_wheel
    rear, front = (np.diag([wheel.Ixx, wheel.Iyy, wheel.Ixx]) for wheel in (R, F))
    hub, pivot = place(0.0, R.radius), place(bicycle.wheelbase + bicycle.trail, 0.0)
    bodies = (
        Body("carrier", 0.0, (0.0, 0.0, 0.0), ("x", "y", "rz")),
        Body("frame", 0.0, hub, ("z", "rx", "ry"), parent="carrier"),
        Body("body", B.mass, place(B.x, -B.z), (), tensor(B.inertia), "frame"),  # type: ignore[arg-type]
        Body("rear wheel", R.mass, hub, ("ry",), tensor(rear), "body"),  # type: ignore[arg-type]
        Body("steering", 0.0, pivot, ("rz",), parent="body"),
        Body("front frame", H.mass, place(H.x, -H.z), (), tensor(H.inertia), "steering"),  # type: ignore[arg-type]
        Body("front wheel", F.mass, place(bicycle.wheelbase, F.radius), ("ry",), tensor(front), "front frame"),  # type: ignore[arg-type]
    )
    return SpatialVehicle("bicycle", bodies, (), (), (), gravity=bicycle.gravity)


def straight_rolling(bicycle: Whipple, speed: float, lean_rate: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Positions and rates (9,) of straight upright rolling at a speed (m/s), with a lean rate (rad/s) about the line
    through both contact points.
    """
    q, v = np.zeros(COUNT), np.zeros(COUNT)
    q[PITCH] = -bicycle.tilt
    v[X], v[REAR], v[FRONT] = speed, speed / bicycle.rear_wheel.radius, speed / bicycle.front_wheel.radius
    v[LEAN], v[Y] = lean_rate, -lean_rate * bicycle.rear_wheel.radius
    return q, v
