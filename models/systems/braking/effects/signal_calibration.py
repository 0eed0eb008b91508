"""Wheel speeds that are read too large or shifted."""

from typing import Any

from models.systems.braking.effects import _of_conversion as sensors

PLACE = "port.signals.gain"
NEEDS = sensors.NEEDS
COST = "a product and a sum per wheel and sample"
COUNTS = {"all": {"asked": 1, "wrong signals": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return sensors.has(scene, "signals", sensors.SCALE)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Speeds as they are."""
    sensors.drop(table, "signals", sensors.SCALE)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """One per cent too large."""
    sensors.add(table, "signals", {"gain": 1.01})
