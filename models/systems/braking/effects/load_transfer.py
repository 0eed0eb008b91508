"""Loads that move between the wheels with the accelerations of the body, semi-static."""

from typing import Any

PLACE = "load_transfer"
EXCLUDES = ("suspension",)
WHY = "whose springs carry the loads"
COST = "two products per wheel and step"
COUNTS = {"all": {"moving loads": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.load_transfer is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Loads stay as they are at rest."""
    del table["load_transfer"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """With the share of the front axle that is usual."""
    table["load_transfer"] = {}
