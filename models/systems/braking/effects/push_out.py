"""Pressure that the brakes need before any torque comes."""

from typing import Any

PLACE = "brakes.front.push_out"
COST = "nothing: the same law of torque by pressure"
COUNTS = {"all": {"push-outs": 4}}
AXLES = ("front", "rear", "trailer")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any(getattr(scene.brakes, axle).push_out > 0.0 for axle in AXLES)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Torque rises from no pressure on, and falls to none."""
    for axle in {*AXLES} & {*table["brakes"]}:
        for key in ("push_out", "release"):
            table["brakes"][axle].pop(key, None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Those of the paper's brakes, without their hysteresis."""
    for axle, pressure in (("front", 0.75), ("rear", 0.25)):
        brake_in(table, scene, axle)["push_out"] = pressure


def brake_in(table: dict[str, Any], scene: Any, axle: str) -> dict[str, Any]:
    """The table of an axle's brake, made from what holds without it where the scene has none."""
    usual = getattr(scene.brakes, axle).model_dump(exclude_none=True)
    found: dict[str, Any] = table.setdefault("brakes", {}).setdefault(axle, usual)
    return found
