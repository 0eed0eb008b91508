"""The delay from front to rear: every axle meets at once what the first one meets."""

from models.ride.choice.held import Effect, Held


def found(held: Held) -> list[Effect]:
    """One effect, where axles follow one another."""
    follows = len(held.vehicle.axles) > 1 and held.scene.road.front_rear == "delayed"
    return [Effect("delay front to rear", _without, "all axles meet the same at once")] if follows else []


def _without(held: Held) -> Held:
    return held.on_road(front_rear="equal")
