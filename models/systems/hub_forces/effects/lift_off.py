"""Tyres of the virtual measurement that only push, so that a wheel may leave the road without a force on its hub."""

from typing import Any

from models.core.strict import Strict
from models.vehicles.spatial import SpatialVehicle

NEEDS = ("virtual_measurement",)
WHY = "for no tyre is below measured forces"
COST = "two comparisons per tyre and call, and side forces that go with the load"
EXAMPLE: dict[str, float] = {}
COUNTS = {"all": {"tyres that lift": 4}}


class Parameters(Strict):
    """[effects.lift_off]: no settings."""


def extend(vehicle: SpatialVehicle, parameters: Any) -> SpatialVehicle:
    """Returns the vehicle with tyres that only push, by the law of ``models.systems.pitch_plane.effects.lift_off``."""
    return vehicle.with_tyres(pushes_only=True)
