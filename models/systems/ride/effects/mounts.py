"""Mounts and seats: a body that carries no tyre sits rigidly on the one that its springs join it to."""

from collections import defaultdict
from dataclasses import replace
from functools import partial
from typing import Any

from models.systems.ride.reduced_scene import Effect, Held, holds, of_vehicle

PLACE = "vehicle.file"
COST = "a product per mount, and the freedoms of what it carries"
leave_out = of_vehicle


def found(held: Held) -> list[Effect]:
    """One effect per pair of bodies that springs join and of which none carries a tyre."""
    wheels = {tyre.body for tyre in held.vehicle.tyres}
    pairs = defaultdict[tuple[str, str], list[str]](list)
    for spring in held.vehicle.springs:
        if spring.two is not None and not {spring.one, spring.two} & wheels:
            pairs[spring.one, spring.two].append(spring.name)
    return [_of(held, pair, springs) for pair, springs in pairs.items()]


def _of(held: Held, pair: tuple[str, str], springs: list[str]) -> Effect:
    excludes = tuple(
        f"{body.name} {freedom}" for body in held.vehicle.bodies if body.name == pair[0] for freedom in body.freedoms
    )
    return Effect(
        f"springs of {pair[0]} on {pair[1]}",
        partial(_without, springs=springs),
        f"{pair[0]} sits rigidly on {pair[1]}",
        (),
        (*excludes, f"mass of {pair[0]}"),
        "a body that sits rigidly on another has no motion of its own left",
    )


def _without(held: Held, springs: list[str]) -> Held:
    return replace(held, rigid=held.rigid | set(springs))


def named(scene: Any) -> bool:
    """Whether a scene's vehicle has it."""
    return holds(scene, found)
