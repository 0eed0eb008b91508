"""The delay from front to rear: every axle meets at once what the first one meets."""

from typing import Any

from models.systems.ride.reduced_scene import Effect, Held, holds

PLACE = "road.front_rear"
COST = "a filter of the road per axle"
COUNTS = {"all": {"delays": 1}}


def found(held: Held) -> list[Effect]:
    """One effect, where axles follow one another."""
    follows = len(held.vehicle.axles) > 1 and held.scene.road.front_rear == "delayed"
    return [Effect("delay front to rear", _without, "all axles meet the same at once")] if follows else []


def _without(held: Held) -> Held:
    return held.on_road(front_rear="equal")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return holds(scene, found)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """All axles meet the same at once."""
    table.setdefault("road", {})["front_rear"] = "equal"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Every axle meets what the first one met, its distance later."""
    table.setdefault("road", {})["front_rear"] = "delayed"
