"""Wheels that lean, left and right ones mirrored."""

from typing import Any

PLACE = "tyres.inclination"
COST = "nothing: the same forces at an angle, with spin"
COUNTS = {"all": {"leaning wheels": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.tyres.inclination)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Wheels are upright."""
    del table["tyres"]["inclination"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """By 0.02 rad."""
    table.setdefault("tyres", {})["inclination"] = 0.02
