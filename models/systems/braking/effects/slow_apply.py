"""Valves with a fourth state beside apply, hold and release: they apply slowly."""

from typing import Any

PLACE = "pressure.slow"
NEEDS = ("pressure_dynamics",)
COST = "one comparison per wheel and step"
COUNTS = {"all": {"slow fillings": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.pressure is not None and scene.pressure.slow is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Valves apply, hold and release; a controller of the scene that applies slowly goes back to its steps."""
    del table["pressure"]["slow"]
    table.get("controller", {}).get("parameters", {}).pop("slow", None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """A throttle that fills eight times as slowly."""
    fill = 0.15 if scene.pressure is None else scene.pressure.fill
    table.setdefault("pressure", {})["slow"] = 8.0 * fill
