"""Forces with continuous rates between the samples."""

from typing import Any

PLACE = "forces.interpolation"
COST = "cubic pieces in place of straight ones"
COUNTS = {"all": {"curves between samples": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.forces.interpolation == "smooth")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Straight lines from sample to sample."""
    del table["forces"]["interpolation"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Cubic pieces."""
    table.setdefault("forces", {})["interpolation"] = "smooth"
