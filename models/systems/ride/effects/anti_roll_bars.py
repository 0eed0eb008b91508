"""Anti-roll bars, one by one."""

from dataclasses import replace
from functools import partial
from typing import Any

from models.systems.ride.reduced_scene import Effect, Held, holds, of_vehicle

PLACE = "vehicle.file"
COST = "a product per bar"
leave_out = of_vehicle


def found(held: Held) -> list[Effect]:
    """One effect per bar."""
    return [Effect(f"bar {bar.name}", partial(_without, bar=bar.name), f"no {bar.name}") for bar in held.vehicle.bars]


def _without(held: Held, bar: str) -> Held:
    bars = tuple(own for own in held.vehicle.bars if own.name != bar)
    return replace(held, vehicle=replace(held.vehicle, bars=bars))


def named(scene: Any) -> bool:
    """Whether a scene's vehicle has it."""
    return holds(scene, found)
