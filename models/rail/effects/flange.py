"""A flange that touches its rail beyond a clearance."""

from typing import Any

PLACE = "wheelset.override.flange_stiffness"
NEEDS: tuple[str, ...] = ()
EXCLUDES = ("profiles",)
WHY = "which have flanges of their own"
COST = "one comparison per wheel and call"
COUNTS = {"all": {"flanges": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    from models.rail.of_scene import wheelset_of

    return bool(scene.profiles is None and wheelset_of(scene).flange_stiffness > 0.0)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Wheels roll on cones however far they move."""
    table.setdefault("wheelset", {}).setdefault("override", {})["flange_stiffness"] = 0.0


def put_in(table: dict[str, Any], scene: Any) -> None:
    """That of the chosen wheelset."""
    from models.rail.wheelset import CHOSEN

    table.setdefault("wheelset", {}).setdefault("override", {})["flange_stiffness"] = CHOSEN.flange_stiffness
