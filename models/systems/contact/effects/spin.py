"""Spin of the wheel about the contact's normal."""

from typing import Any

from models.core.errors import InputError

PLACE = "creepage.spin"
COST = "nothing: the third column of the same creepages"
COUNTS = {"all": {"motions with spin": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.creepage.spin or (scene.sweep is not None and scene.sweep.of == "spin"))


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Creepage along x and y alone; InputError where spin is what is swept."""
    if scene.sweep is not None and scene.sweep.of == "spin":
        raise InputError(
            scene.file, "sweep.of", "spin", "is what this scene asks for: sweep another creepage to leave it out"
        )
    table["creepage"].pop("spin")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """As of a wheel of usual conicity, 0.3 per metre."""
    table.setdefault("creepage", {})["spin"] = 0.3
