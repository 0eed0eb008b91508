"""The road's second corner: its filters of second order become those of first order."""

from models.ride.choice.held import Effect, Held
from models.ride.effects import tyre_damping


def found(held: Held) -> list[Effect]:
    """One effect, where the road has a second corner; a tyre that is damped would then meet white noise."""
    if held.scene.road.cutoff is None:
        return []
    damped = any(tyre.damping for tyre in held.vehicle.tyres)
    return [Effect("second corner of the road", _without, "road filters of first order",
                   (tyre_damping.NAME,) if damped else (), (), "for it would pass white noise")]  # fmt: skip


def _without(held: Held) -> Held:
    return held.on_road(cutoff=None)
