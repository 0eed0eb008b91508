"""A reservoir whose pressure falls as chambers fill from it."""

from typing import Any

PLACE = "pressure.reservoir"
NEEDS = ("pressure_dynamics",)
COST = "a sum over the chambers per sample"
COUNTS = {"all": {"volumes": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.pressure is not None and scene.pressure.reservoir is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The supply's pressure stays."""
    for key in ("reservoir", "volume"):
        table["pressure"].pop(key, None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """A truck's, of 40 l."""
    table.setdefault("pressure", {})["reservoir"] = 40.0
