"""The second track: left and right wheels of an axle meet the same height."""

from models.ride.choice.held import Effect, Held


def found(held: Held) -> list[Effect]:
    """One effect, where wheels stand beside the centre line of a road with two tracks as modelled."""
    wide = len({tyre.point[1] for tyre in held.vehicle.tyres}) > 1
    if not wide or held.scene.road.left_right != "modelled":
        return []
    return [Effect("second track", _without, "left and right meet the same", singular=True)]


def _without(held: Held) -> Held:
    return held.on_road(left_right="equal")
