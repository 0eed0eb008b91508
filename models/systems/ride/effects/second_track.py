"""The second track: left and right wheels of an axle meet the same height."""

from typing import Any

from models.systems.ride.reduced_scene import Effect, Held, holds

PLACE = "road.left_right"
COST = "a second filter of the road per axle"
COUNTS = {"all": {"heights": 2}}


def found(held: Held) -> list[Effect]:
    """One effect, where wheels stand beside the centre line of a road with two tracks as modelled."""
    wide = len({tyre.point[1] for tyre in held.vehicle.tyres}) > 1
    if not wide or held.scene.road.left_right != "modelled":
        return []
    return [Effect("second track", _without, "left and right meet the same", singular=True)]


def _without(held: Held) -> Held:
    return held.on_road(left_right="equal")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return holds(scene, found)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Left and right wheels meet the same height."""
    table.setdefault("road", {})["left_right"] = "equal"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """The mean and the roll process."""
    table.setdefault("road", {})["left_right"] = "modelled"
