"""Chambers that fill and empty with time constants behind their valves."""

from typing import Any

PLACE = "pressure"
EXCLUDES = ("measured_pressures",)
WHY = "which are the chambers'"
COST = "two exponentials per wheel and sample"
COUNTS = {"all": {"time constants": 8}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.pressure is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Chambers follow their valves at once; so there is neither delay nor reservoir."""
    del table["pressure"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """With the time constants of compressed air."""
    table["pressure"] = {}
