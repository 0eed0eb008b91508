"""Curves and friction of springs and dampers, beyond their slopes at rest."""

from typing import Any

from models.ride.of_scene import vehicle_of

PLACE = "vehicle.small_motion"
COST = "runs in time by an engine in place of one covariance"
COUNTS = {"all": {"bent springs": 1}}
MODULES = ("models.ride.statistical_linearisation",)


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return not scene.vehicle.small_motion and any(
        spring.travel_force or spring.rate_force or spring.friction for spring in vehicle_of(scene).springs)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Their slopes at rest stand for them."""
    table["vehicle"]["small_motion"] = True
