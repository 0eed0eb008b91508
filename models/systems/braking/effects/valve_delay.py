"""Valves that answer a while after their command."""

from typing import Any

PLACE = "pressure.delay"
NEEDS = ("pressure_dynamics",)
COST = "commands that are kept for as many samples"
COUNTS = {"all": {"kept commands": 8}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.pressure is not None and scene.pressure.delay > 0.0


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Valves answer within the sample."""
    del table["pressure"]["delay"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Two samples of delay."""
    table.setdefault("pressure", {})["delay"] = 2.0 * scene.run.sample
