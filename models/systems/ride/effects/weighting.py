"""Outputs weighted for people, by ISO 2631-1."""

from typing import Any

from models.systems.ride.of_scene import vehicle_of

PLACE = "weighting"
COST = "eight states per weighted output by Wk, six by Wd"
COUNTS = {"all": {"states": 8}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.weighting)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Outputs as they are."""
    del table["weighting"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """The first acceleration by Wk."""
    name = next(output.name for output in vehicle_of(scene).outputs if output.kind == "acceleration")
    table["weighting"] = {name: "Wk"}
