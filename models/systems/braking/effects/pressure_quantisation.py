"""Pressures that a controller asks for, in the steps of a converter."""

from typing import Any

from models.systems.braking.effects import _of_conversion as sensors

PLACE = "port.pressures.bits"
NEEDS = sensors.NEEDS
COST = "a rounding per brake and sample"
COUNTS = {"all": {"asked": 1, "converted signals": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return sensors.has(scene, "pressures", sensors.BITS)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Pressures of any value."""
    sensors.drop(table, "pressures", sensors.BITS)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Twelve bits up to 16 bar."""
    sensors.add(table, "pressures", {"bits": 12, "range": 16.0})
