"""Normal forces that grow with the speed of approach."""

from typing import Any

PLACE = "wheelset.override.contact_damping"
NEEDS: tuple[str, ...] = ()
EXCLUDES: tuple[str, ...] = ()
COST = "one product per wheel and call"
COUNTS = {"all": {"contact damping": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    from models.rail.of_scene import wheelset_of

    return bool(wheelset_of(scene).contact_damping > 0.0)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Contacts are springs alone."""
    table.setdefault("wheelset", {}).setdefault("override", {})["contact_damping"] = 0.0


def put_in(table: dict[str, Any], scene: Any) -> None:
    """That of the chosen wheelset."""
    from models.rail.wheelset import CHOSEN

    table.setdefault("wheelset", {}).setdefault("override", {})["contact_damping"] = CHOSEN.contact_damping
