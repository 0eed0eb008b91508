"""Damping of the tyres: nothing but their springs is left."""

from dataclasses import replace

from models.ride.choice.held import Effect, Held

NAME = "tyre damping"


def found(held: Held) -> list[Effect]:
    """One effect, where any tyre is damped."""
    damped = any(tyre.damping for tyre in held.vehicle.tyres)
    return [Effect(NAME, _without, "tyres are springs without damping")] if damped else []


def _without(held: Held) -> Held:
    tyres = tuple(replace(tyre, damping=0.0) for tyre in held.vehicle.tyres)
    return replace(held, vehicle=replace(held.vehicle, tyres=tyres))
