"""Drag of the air, which loads the axles by the speed."""

from typing import Any

from models.systems.ride.of_scene import vehicle_of
from models.systems.ride.reduced_scene import of_vehicle

PLACE = "vehicle.file"
COST = "a linear vehicle of its own at every speed"
leave_out = of_vehicle


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(vehicle_of(scene).drags)
