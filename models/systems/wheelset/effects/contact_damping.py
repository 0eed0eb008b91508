"""Normal forces that grow with the speed of approach."""

from typing import Any

from models.systems.wheelset.of_scene import any_of, override, usual

PLACE = "wheelset.override.contact_damping"
COST = "one product per wheel and call"
COUNTS = {"all": {"contact damping": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any_of(scene, "contact_damping")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Contacts are springs alone."""
    override(table, {"contact_damping": 0.0})


def put_in(table: dict[str, Any], scene: Any) -> None:
    """That of the chosen wheelset."""
    override(table, usual("contact_damping"))
