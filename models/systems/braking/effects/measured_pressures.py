"""Pressures from a file in place of pedal and controller."""

from typing import Any

PLACE = "measured"
COST = "a row of a table per sample"
COUNTS = {"all": {"files": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.measured is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The pedal alone: all valves are open."""
    del table["measured"]
