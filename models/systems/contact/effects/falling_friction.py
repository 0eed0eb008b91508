"""Friction that falls with the speed of slip."""

from typing import Any

PLACE = "falling_friction"
NEEDS = ("saturation",)
COST = "an exponential per cell, and a march of its own"
COUNTS = {"all": {"laws of friction": 1}}
MODULES = ("models.contact.fastsim_falling",)


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.falling_friction is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Friction stays what it is without slip."""
    del table["falling_friction"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Values of the size of measured ones, at 20 m/s."""
    table["falling_friction"] = {"floor": 0.4, "decay": 0.6, "speed": 20.0}
