"""Forces that hold the design position against gravity: preloads of springs and bars, and static loads of tyres.

Each part bears what it would carry had the unloaded vehicle sunk under its weights: K s = w with the stiffness K of
all parts and tyres at rest, from the derivatives of their travels (the definition of
``spatial_linear.static_preloads``, by another way to the derivatives)."""

import numpy as np

from models.multibody.plain.joint_elements import joint_rows
from models.multibody.plain.motion import FIRST_DERIVATIVE, Bodies
from models.multibody.plain.parts import PlainParts
from models.vehicles.spatial import SpatialVehicle, SpringDamper


def preloads_at_rest(vehicle: SpatialVehicle, frame_body: str | None) -> tuple[np.ndarray, np.ndarray]:
    """Preloads (p,) of springs, then bars, then joint elements (N, N m; positive in compression), and static loads (w,)
    of tyres (N)."""
    bodies = Bodies(vehicle)
    still = np.zeros(bodies.size)
    motion, parts = bodies.move(still, still), PlainParts(bodies, vehicle, frame_body)
    risen = motion.at(bodies.points([(tyre.body, tyre.point) for tyre in vehicle.tyres]))[:, FIRST_DERIVATIVE:, 2]
    rows = np.vstack([parts.travels(motion, still, still).gradient, joint_rows(bodies, vehicle), risen])
    springs = [_stiffness_at_rest(spring) for spring in vehicle.springs]
    bars, joints = ([each.stiffness for each in kind] for kind in (vehicle.bars, vehicle.joint_elements))
    stiffness = np.array([*springs, *bars, *joints, *(tyre.stiffness for tyre in vehicle.tyres)])
    _, weights = bodies.inertia(motion, np.array([0.0, 0.0, -vehicle.gravity]))
    sunk = np.linalg.lstsq(rows.T @ (stiffness[:, None] * rows), weights, rcond=1e-12)[0]
    borne = stiffness * (rows @ sunk)
    count = len(rows) - len(vehicle.tyres)
    return borne[:count], -borne[count:]


def _stiffness_at_rest(spring: SpringDamper) -> float:
    return spring.stiffness + (spring.travel_force.slope_at_rest() if spring.travel_force else 0.0)
