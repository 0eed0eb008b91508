"""Roll and pitch enforced as measured, smoothed."""

from typing import Any

PLACE = "stabilise.method"
EXCLUDES = ("kalman_filter",)
WHY = "as one moment holds roll and pitch"
COST = "derivatives of the smoothed angles before the run, and in every call a mass matrix solved for two moments"
COUNTS = {"all": {"enforced angles": 2}}
MODULES = ("models.systems.hub_forces.enforced",)


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.stabilise.method == "prescribed")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Nothing holds roll and pitch."""
    table["stabilise"]["method"] = "none"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Smoothed as the scene says."""
    table.setdefault("stabilise", {})["method"] = "prescribed"
