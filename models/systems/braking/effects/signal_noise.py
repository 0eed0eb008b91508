"""White noise on the wheel speeds that the controller is given."""

from typing import Any

from models.systems.braking.effects import _of_conversion as sensors

PLACE = "port.signals.noise"
NEEDS = sensors.NEEDS
COST = "a random number per wheel and sample"
COUNTS = {"all": {"asked": 1, "noisy signals": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return sensors.has(scene, "signals", sensors.NOISE)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Speeds without noise."""
    sensors.drop(table, "signals", sensors.NOISE)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """0.05 m/s."""
    sensors.add(table, "signals", {"noise": 0.05})
