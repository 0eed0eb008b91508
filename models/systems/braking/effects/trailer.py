"""A drawbar trailer of two axles behind the truck."""

from typing import Any

PLACE = "trailer"
EXCLUDES = ("suspension",)
WHY = "whose springs carry that vehicle, alone"
COST = "two coordinates and four wheels more"
COUNTS = {"all": {"coordinates": 2, "wheels": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.trailer is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The truck brakes alone."""
    del table["trailer"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """The chosen one, unladen."""
    from models.brake.trailer import CHOSEN

    table["trailer"] = CHOSEN.model_dump(exclude_unset=True)
