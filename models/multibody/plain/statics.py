"""Forces that hold the design position against gravity: preloads of springs and bars, and static loads of tyres.

Each part bears what it would carry had the unloaded vehicle sunk under its weights: K s = w with the stiffness K of
all parts and tyres at rest, from the derivatives of their travels (the definition of ``spatial_linear.preloads``, by
another way to the derivatives).
"""

import numpy as np

from models.multibody.plain.motion import FIRST, Bodies
from models.multibody.plain.parts import Parts
from models.vehicles.spatial import SpatialVehicle, SpringDamper


def held_at_rest(vehicle: SpatialVehicle, frame: str | None) -> tuple[np.ndarray, np.ndarray]:
    """Preloads (p,) of springs, then bars (N, N m; positive in compression), and loads (w,) of tyres (N)."""
    bodies = Bodies(vehicle)
    still = np.zeros(bodies.size)
    motion, parts = bodies.move(still, still), Parts(bodies, vehicle, frame)
    risen = motion.at(bodies.points([(tyre.body, tyre.point) for tyre in vehicle.tyres]))[:, FIRST:, 2]
    rows = np.vstack([parts.travels(motion, still, still).gradient, risen])
    springs = [_stiffness_at_rest(spring) for spring in vehicle.springs]
    stiffness = np.array([*springs, *(bar.stiffness for bar in vehicle.bars), *(t.stiffness for t in vehicle.tyres)])
    _, weights = bodies.inertia(motion, np.array([0.0, 0.0, -vehicle.gravity]))
    sunk = np.linalg.lstsq(rows.T @ (stiffness[:, None] * rows), weights, rcond=1e-12)[0]
    borne = stiffness * (rows @ sunk)
    return borne[: len(parts.names)], -borne[len(parts.names) :]


def _stiffness_at_rest(spring: SpringDamper) -> float:
    return spring.stiffness + (spring.travel_force.slope_at_rest() if spring.travel_force else 0.0)
