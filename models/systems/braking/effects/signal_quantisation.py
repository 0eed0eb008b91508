"""Wheel speeds in the steps of a converter."""

from typing import Any

from models.systems.braking.effects import _of_conversion as sensors

PLACE = "port.signals.bits"
NEEDS = sensors.NEEDS
COST = "a rounding per wheel and sample"
COUNTS = {"all": {"asked": 1, "converted signals": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return sensors.has(scene, "signals", sensors.BITS)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Speeds of any value."""
    sensors.drop(table, "signals", sensors.BITS)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Twelve bits up to 40 m/s."""
    sensors.add(table, "signals", {"bits": 12, "range": 40.0})
