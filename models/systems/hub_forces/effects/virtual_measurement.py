"""Forces and angles of a virtual measurement on two tracks of a random road."""

from typing import Any

from models.core.errors import InputError

PLACE = "road"
COST = "a run of the whole vehicle on its tyres before the others"
COUNTS = {"all": {"runs on tyres": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.road is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """InputError: files must take its place."""
    raise InputError(scene.file, "road", None, "can only give way to forces.file and angles.file: name them")
