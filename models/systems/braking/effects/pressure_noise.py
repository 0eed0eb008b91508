"""White noise on the pressures that a controller asks for."""

from typing import Any

from models.systems.braking.effects import _of_conversion as sensors

PLACE = "port.pressures.noise"
NEEDS = sensors.NEEDS
COST = "a random number per brake and sample"
COUNTS = {"all": {"asked": 1, "noisy signals": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return sensors.has(scene, "pressures", sensors.NOISE)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Pressures without noise."""
    sensors.drop(table, "pressures", sensors.NOISE)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """0.02 bar."""
    sensors.add(table, "pressures", {"noise": 0.02})
