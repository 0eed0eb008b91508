"""Rear tyres with figures of their own."""

from typing import Any

PLACE = "tyres.own_rear"
COST = "a second table of friction per surface"
COUNTS = {"all": {"tables": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.tyres.own_rear)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """All tyres are those of the front axle."""
    del table["tyres"]["own_rear"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """By the figures of each surface."""
    table.setdefault("tyres", {})["own_rear"] = True
