"""A road of more than one surface, along it or across."""

from typing import Any

PLACE = "road.stretches"
COST = "the surface under each wheel is looked up at every step"
COUNTS = {"all": {"surfaces": 1, "tables": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any(
        len({s.left for s in scene.road.stretches} | {own.right or s.right or s.left for s in scene.road.stretches}) > 1
        for own in scene.procedures.values()
    )


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Everywhere the surface that is left of the line at the start."""
    first = scene.road.stretches[0].left
    table["road"] = {"stretches": [{"left": first}]}
    for own in table["procedures"].values():
        if "right" in own:
            own["right"] = first


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Dry road after 10 m, or ice after a dry one."""
    stretches = table.setdefault("road", {}).setdefault("stretches", [{"left": "ice"}])
    last = scene.road.stretches[-1]
    stretches.append({"x": last.x + 10.0, "left": "ice" if last.left == "dry" else "dry"})
