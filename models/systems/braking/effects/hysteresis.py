"""Brakes whose torque falls along another line than it rises."""

from typing import Any

from models.systems.braking.effects.push_out import AXLES, brake_in

PLACE = "brakes.front.release"
COST = "nothing: the same law of torque by pressure, its two lines apart"
COUNTS = {"all": {"loops": 4}}
KEYS = ("release", "falling")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any(getattr(getattr(scene.brakes, axle), key) is not None for axle in AXLES for key in KEYS)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Torque falls as it rises."""
    for axle in {*AXLES} & {*table["brakes"]}:
        for key in KEYS:
            table["brakes"][axle].pop(key, None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Torque falls by a tenth steeper than it rises, chosen."""
    for axle in ("front", "rear"):
        brake = brake_in(table, scene, axle)
        brake["falling"] = 1.1 * brake["gradient"]
