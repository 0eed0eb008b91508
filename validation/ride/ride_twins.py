"""Asymmetric twins of vehicles in space: every mass, spring, damper and tyre changed by its own share, reproducibly.

A symmetric vehicle hides a swap of left and right, and one with alike axles a swap of front and rear.
"""

from dataclasses import replace

import numpy as np

from models.vehicles.spatial import SpatialVehicle

SHARE = 0.2
"""Largest change of any value."""


def twin(vehicle: SpatialVehicle, seed: int) -> SpatialVehicle:
    """The vehicle with its masses, stiffnesses and dampings changed by up to SHARE each, named a twin."""
    rng = np.random.default_rng(seed)

    def changed(value: float) -> float:
        return value * (1 + SHARE * rng.uniform(-1, 1))

    bodies = []
    for body in vehicle.bodies:
        factor = changed(1.0)
        inertia = tuple(tuple(factor * entry for entry in row) for row in body.inertia)
        bodies.append(replace(body, mass=factor * body.mass, inertia=inertia))  # type: ignore[arg-type]
    return replace(
        vehicle,
        name=f"{vehicle.name}, asymmetric twin {seed}",
        bodies=tuple(bodies),
        springs=tuple(replace(s, stiffness=changed(s.stiffness), damping=changed(s.damping)) for s in vehicle.springs),
        bars=tuple(replace(bar, stiffness=changed(bar.stiffness)) for bar in vehicle.bars),
        tyres=tuple(replace(tyre, stiffness=changed(tyre.stiffness)) for tyre in vehicle.tyres),
    )
