"""Clocks of files that are shifted or too fast."""

from typing import Any

PLACE = "files.0.offset"
COST = "signals are moved to one clock by interpolation"
COUNTS = {"all": {"moved clocks": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any(own.offset or own.drift for own in scene.files)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """All files count the same time."""
    for own in table["files"]:
        own.pop("offset", None)
        own.pop("drift", None)
