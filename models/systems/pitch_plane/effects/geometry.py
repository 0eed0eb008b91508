"""Exact sine and cosine of the pitch; without it the equations are linear in the pitch."""

from typing import Any

PLACE = "vehicle.geometry"
COST = "a sine and a cosine per call; native items that turn, in place of equations of constant matrices, in Exudyn"
COUNTS = {"exudyn": {"native items": 10}}


def named(scene: Any) -> bool:
    """Whether a scene has exact geometry."""
    return bool(scene.vehicle.geometry == "exact")


def leave_out(scene_tables: dict[str, Any], scene: Any) -> None:
    """Edit a scene so that the equations are linear in the pitch."""
    scene_tables.setdefault("vehicle", {})["geometry"] = "linear"


def put_in(scene_tables: dict[str, Any], scene: Any) -> None:
    """Edit a scene so that its geometry is "exact"."""
    scene_tables.setdefault("vehicle", {})["geometry"] = "exact"
