"""Wheel speeds with gain, offset, noise and the steps of a converter."""

from typing import Any

PLACE = "port.signals"
NEEDS = ("port",)
COST = "a few operations per signal and sample"
COUNTS = {"all": {"asked": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.port is not None and bool(scene.port.signals.model_fields_set)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Wheel speeds are known as they are."""
    del table["port"]["signals"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Twelve bits up to 40 m/s."""
    table.setdefault("port", {})["signals"] = {"bits": 12, "range": 40.0}
