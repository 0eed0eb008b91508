"""A controller that opens and closes the valves of every wheel."""

from typing import Any

PLACE = "controller"
EXCLUDES = ("measured_pressures",)
WHY = "which leave nothing to a controller"
COST = "one answer of the controller per sample"
COUNTS = {"all": {"controllers": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.controller.kind != "none"


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """All valves stay open."""
    del table["controller"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """The paper's."""
    table["controller"] = {"kind": "slip_bang_bang"}
