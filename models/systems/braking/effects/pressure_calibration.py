"""Pressures that come out too large or shifted."""

from typing import Any

from models.systems.braking.effects import _of_conversion as sensors

PLACE = "port.pressures.gain"
NEEDS = sensors.NEEDS
COST = "a product and a sum per brake and sample"
COUNTS = {"all": {"asked": 1, "wrong signals": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return sensors.has(scene, "pressures", sensors.SCALE)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Pressures as asked for."""
    sensors.drop(table, "pressures", sensors.SCALE)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """One per cent too large."""
    sensors.add(table, "pressures", {"gain": 1.01})
