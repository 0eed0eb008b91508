"""Damping of the tyres: nothing but their springs is left."""

from dataclasses import replace
from typing import Any

from models.systems.ride.reduced_scene import Effect, Held, holds, of_vehicle

NAME = "tyre damping"

PLACE = "vehicle.file"
COST = "a product per tyre; without a second corner white noise at the outputs"
leave_out = of_vehicle


def found(held: Held) -> list[Effect]:
    """One effect, where any tyre is damped."""
    damped = any(tyre.damping for tyre in held.vehicle.tyres)
    return [Effect(NAME, _without, "tyres are springs without damping")] if damped else []


def _without(held: Held) -> Held:
    tyres = tuple(replace(tyre, damping=0.0) for tyre in held.vehicle.tyres)
    return replace(held, vehicle=replace(held.vehicle, tyres=tyres))


def named(scene: Any) -> bool:
    """Whether a scene's vehicle has it."""
    return holds(scene, found)
