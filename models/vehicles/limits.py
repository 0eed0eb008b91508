"""What a reduced vehicle is the limit of: bodies without mass, rigid springs, locked freedoms; for small motion only.

Rigid springs and locked freedoms leave q = N r with fewer coordinates r. Bodies without mass leave a mass matrix that
may be singular (see ``models.ride.excited``): nothing is taken to a limit with large numbers.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import null_space

from models.core.errors import InputError
from models.vehicles.linear_vehicle import LinearVehicle

if TYPE_CHECKING:
    from models.vehicles.spatial import Freedom, SpatialVehicle

NOTHING = 1e-10
"""Share of the largest one below which a travel counts as none."""


@dataclass(frozen=True)
class Limits:
    """Names of ``massless`` bodies and ``rigid`` springs, and ``locked`` freedoms as (body, freedom)."""

    massless: frozenset[str] = frozenset()
    rigid: frozenset[str] = frozenset()
    locked: frozenset[tuple[str, "Freedom"]] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.massless or self.rigid or self.locked)


NONE = Limits()


def limited(linear: LinearVehicle, vehicle: "SpatialVehicle", limits: Limits) -> tuple[LinearVehicle, np.ndarray]:
    """M, D, K and outputs in what coordinates are left, and N (n, r) with q = N r; M may be singular.

    linear : the vehicle without limits. InputError where nothing is left that could move.
    """
    M, N = massless(linear.mass, vehicle, limits.massless), _free(vehicle, limits)
    if not N.size:
        raise InputError("", "effects", None, "nothing is left that could move")
    outputs = tuple(
        replace(o, acceleration=o.acceleration @ N, rate=o.rate @ N, displacement=o.displacement @ N)
        for o in linear.outputs
    )
    return replace(
        linear,
        mass=N.T @ M @ N,
        damping=N.T @ linear.damping @ N,
        stiffness=N.T @ linear.stiffness @ N,
        road_stiffness=N.T @ linear.road_stiffness,
        road_damping=N.T @ linear.road_damping,
        coordinates=tuple(("", str(i)) for i in range(N.shape[1])),
        outputs=outputs,
    ), N


def massless(mass: np.ndarray, vehicle: "SpatialVehicle", names: frozenset[str]) -> np.ndarray:
    """The mass matrix (n, n) less that of these bodies; rounding leaves no trace of them."""
    from models.vehicles.spatial_linear import mass as mass_of

    if not names:
        return mass
    light = tuple(
        replace(body, mass=0.0, inertia=((0.0,) * 3,) * 3) if body.name in names else body for body in vehicle.bodies
    )
    return mass_of(replace(vehicle, bodies=light))


def _free(vehicle: "SpatialVehicle", limits: Limits) -> np.ndarray:
    """N (n, r): single coordinates where nothing but locks holds them, else a basis of what the rigid springs leave."""
    from models.vehicles.kinematics import Kinematics

    coordinates, motion = vehicle.coordinates(), Kinematics(vehicle)
    kept = np.eye(len(coordinates))[:, [c not in limits.locked for c in coordinates]]
    rows = [
        np.array(s.axis) @ (motion.shift(s.two, s.point_two) - motion.shift(s.one, s.point_one)) @ kept
        for s in vehicle.springs
        if s.name in limits.rigid
    ]
    return kept @ null_space(np.array(rows), rcond=NOTHING) if rows else kept
