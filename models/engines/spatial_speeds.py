"""An engine's linear vehicle at any speed from three of its linearisations."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from models.core.errors import InputError
from models.engines.spatial_protocol import build
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle

SPEEDS = (5.0, 15.0, 45.0)
"""Speeds (m/s) that are linearised; any three would do."""


def at_speeds(engine: str, vehicle: SpatialVehicle) -> Callable[[float], LinearVehicle]:
    """The vehicle at a speed (m/s, above 0), as the engine linearises it; one or three linearisations in all.

    Side forces damp by 1 / v and drag by v, and nothing else depends on the speed: D = D0 + D1 / v + D2 v exactly.
    """
    if not vehicle.side_forces and not vehicle.drags:
        only = build(engine, vehicle).linearise()
        return lambda speed: only
    found = [build(engine, vehicle, speed=speed).linearise() for speed in SPEEDS]
    powers = np.array([[1.0, 1.0 / speed, speed] for speed in SPEEDS])
    parts = np.tensordot(np.linalg.inv(powers), np.array([linear.damping for linear in found]), 1)

    def at(speed: float) -> LinearVehicle:
        if not speed > 0:
            raise InputError(vehicle.name, "speed", speed, "side forces and drag need a speed above 0 m/s")
        return replace(found[0], damping=parts[0] + parts[1] / speed + parts[2] * speed)

    return at
