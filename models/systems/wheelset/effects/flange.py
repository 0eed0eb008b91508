"""A flange that touches its rail beyond a clearance."""

from typing import Any

from models.systems.wheelset.of_scene import any_of, override, usual, wheelset_of

PLACE = "wheelset.override.flange_stiffness"
EXCLUDES = ("profiles",)
WHY = "which have flanges of their own"
COST = "one comparison per wheel and call"
COUNTS = {"all": {"flanges": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return wheelset_of(scene).profiles is None and any_of(scene, "flange_stiffness")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Wheels roll on cones however far they move."""
    override(table, {"flange_stiffness": 0.0})


def put_in(table: dict[str, Any], scene: Any) -> None:
    """That of the chosen wheelset."""
    override(table, usual("flange_stiffness"))
