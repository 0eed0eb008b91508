"""Pressures that are read with gain, offset, noise and the steps of a converter."""

from typing import Any

PLACE = "port.pressures"
NEEDS = ("port",)
COST = "a few operations per pressure and sample"
COUNTS = {"all": {"asked": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.port is not None and bool(scene.port.pressures.model_fields_set)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Pressures are known as they are."""
    del table["port"]["pressures"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Twelve bits up to 16 bar."""
    table.setdefault("port", {})["pressures"] = {"bits": 12, "range": 16.0}
