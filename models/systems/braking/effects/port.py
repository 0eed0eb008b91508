"""A port between vehicle and controller, each exchange checked, behind which anything may stand."""

from typing import Any

PLACE = "port"
EXCLUDES = ("measured_pressures",)
WHY = "which leave nothing to ask"
COST = "one exchange per sample, and what stands behind it"
COUNTS = {"all": {"asked": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.port is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The scene's own controller is in the loop; with the port go its signals and faults."""
    del table["port"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """With the scene's own controller behind it."""
    table["port"] = {}
