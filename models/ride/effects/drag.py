"""Drag of the air, which loads the axles by the speed."""

from typing import Any

from models.ride.choice.held import of_vehicle
from models.ride.of_scene import vehicle_of

PLACE = "vehicle.file"
COST = "a linear vehicle of its own at every speed"
leave_out = of_vehicle


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(vehicle_of(scene).drags)
