"""Gravity, and the preload of the springs that carry the bodies."""

from typing import Any

PLACE = "vehicle.operating_point"
COST = "a stiffness per preloaded spring"
COUNTS = {"all": {"preloads": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.vehicle.operating_point == "loaded")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The vehicle moves about its design position without loads."""
    table["vehicle"].pop("operating_point")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """At rest under its weight."""
    table["vehicle"]["operating_point"] = "loaded"
