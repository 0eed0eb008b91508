"""Curves and friction of springs and dampers, beyond their slopes at rest."""

from dataclasses import replace
from functools import partial
from typing import Any

from models.systems.ride.of_scene import vehicle_of
from models.systems.ride.reduced_scene import Effect, Held

PLACE = "vehicle.small_motion"
COST = "runs in time by an engine in place of one covariance"
COUNTS = {"all": {"bent springs": 1}}
MODULES = ("models.ride.statistical_linearisation",)
LAWS = {"travel_force": "curves over travel", "rate_force": "curves over rate", "friction": "friction"}
"""Laws of springs, and what leaving out those of all springs is called: stops, bent dampers, dry friction."""


def found(held: Held) -> list[Effect]:
    """One effect per law that any spring has, where laws are not taken by their slopes anyway."""
    if held.scene.vehicle.small_motion:
        return []
    return [
        Effect(name, partial(_without, law=law), f"{name}: the gains of statistical linearisation", singular=True)
        for law, name in LAWS.items()
        if any(getattr(spring, law) for spring in held.vehicle.springs)
    ]


def _without(held: Held, law: str) -> Held:
    return replace(held, straight=held.straight | {law})


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return not scene.vehicle.small_motion and any(
        spring.travel_force or spring.rate_force or spring.friction for spring in vehicle_of(scene).springs
    )


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Their slopes at rest stand for them."""
    table["vehicle"]["small_motion"] = True
