"""Wheel speeds that are counted from the teeth of a wheel by a timer."""

from typing import Any

PLACE = "port.teeth"
NEEDS = ("port",)
COST = "the edges of every wheel within each sample"
COUNTS = {"all": {"asked": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.port is not None and scene.port.teeth is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Wheel speeds are known as they are."""
    del table["port"]["teeth"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """A hundred teeth and a tick of a microsecond."""
    table.setdefault("port", {})["teeth"] = {}
