"""Slip angles that lag behind the motion by a relaxation length."""

from typing import Any

PLACE = "relaxation"
EXCLUDES = ("suspension",)
WHY = "whose tyres answer at once"
COST = "a state per wheel, exact within a step"
COUNTS = {"all": {"lags": 4}}
MODULES = ("models.brake.relaxation",)


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.relaxation is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Tyres answer at once."""
    del table["relaxation"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """With lengths of the usual size, chosen."""
    table["relaxation"] = {"front": 0.3, "rear": 0.3}
