"""Sine and cosine of the pitch, where without it the vehicle turns by small angles."""

from typing import Any

PLACE = "vehicle.geometry"
COST = "a sine and a cosine per call; native items that turn, in place of equations of constant matrices, in Exudyn"
COUNTS = {"exudyn": {"native items": 10}}


def named(scene: Any) -> bool:
    """Whether a scene names the effect."""
    return bool(scene.vehicle.geometry == "exact")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Leave the effect out: the equations become linear in the pitch."""
    table.setdefault("vehicle", {})["geometry"] = "linear"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Write the default geometry, "exact", into the scene's table."""
    table.setdefault("vehicle", {})["geometry"] = "exact"
