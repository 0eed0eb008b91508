"""Roll and pitch held by a moment towards a Kalman filter's estimate."""

from typing import Any

PLACE = "stabilise.method"
EXCLUDES = ("prescribed_angles",)
WHY = "as one moment holds roll and pitch"
COST = "a filter over all samples before the run, and two springs and dampers in it"
COUNTS = {"all": {"pulled angles": 2}}
MODULES = ("models.systems.hub_forces.tilt_filter", "models.systems.hub_forces.tilt_march")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.stabilise.method == "kalman")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Nothing holds roll and pitch."""
    table["stabilise"]["method"] = "none"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """With the scene's bandwidth."""
    table.setdefault("stabilise", {})["method"] = "kalman"
