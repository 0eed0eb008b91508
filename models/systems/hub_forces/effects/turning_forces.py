"""Forces that turn with the hub or the chassis."""

from typing import Any

PLACE = "forces.frame"
COST = "a rotation per hub and call"
COUNTS = {"all": {"turning hubs": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.forces.frame != "inertial")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Forces keep their directions in space."""
    table.setdefault("forces", {})["frame"] = "inertial"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """With what carries the wheel."""
    table.setdefault("forces", {})["frame"] = "hub"
