"""Tyres that only push, so that a wheel may leave the road. Such a vehicle has no covariance and is run in time."""

from dataclasses import replace
from typing import Any

from models.core.strict import Strict
from models.systems.ride.of_scene import Built

NEEDS = ("gravity_and_preload",)
WHY = "for without gravity a tyre bears no load that it could lose"
COST = "runs in time in place of one covariance; in Exudyn a law per tyre in Python"
EXAMPLE: dict[str, float] = {}
COUNTS = {"all": {"tyres that lift": 4}}
MODULES = ("models.ride.nonlinear_copies",)


class Parameters(Strict):
    """[effects.lift_off]: no settings."""


def extend(vehicle_and_road: Built, parameters: Any) -> Built:
    """Returns vehicle and road with tyres that only push, by the law of
    ``models.systems.pitch_plane.effects.lift_off``.
    """
    return replace(vehicle_and_road, vehicle=vehicle_and_road.vehicle.with_tyres(pushes_only=True))
