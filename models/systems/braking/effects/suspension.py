"""A vehicle from a file on its springs, whose body rolls and pitches as it brakes."""

from typing import Any

PLACE = "vehicle.file"
COST = "every freedom of its file, and a step of an engine around the compiled tyres"
MODULES = ("models.brake.sprung", "models.engines.braking_sprung")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.vehicle.file is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The same masses, axles and wheels in the plane."""
    from models.systems.braking.of_scene import vehicle_of

    table["vehicle"] = {"override": vehicle_of(scene).model_dump()}
