"""Bushings of the wheels: the stiffer springs between wheels and what they carry, rigid along their direction."""

from collections import defaultdict
from dataclasses import replace
from functools import partial
from typing import Any

from models.systems.ride.reduced_scene import Effect, Held, holds, of_vehicle
from models.vehicles.spatial import SpringDamper
from models.vehicles.spatial_linear import slopes_at_rest

ALIKE = 2.0
"""Stiffnesses apart by no more than this factor are of one sort of bushing."""

PLACE = "vehicle.file"
COST = "a product per bushing, and the fastest modes of the vehicle"
leave_out = of_vehicle


def found(held: Held) -> list[Effect]:
    """One effect per sort, of springs that are stiffer than the softest between the same two bodies."""
    wheels = {tyre.body for tyre in held.vehicle.tyres}
    pairs = defaultdict[tuple[str, str | None], list[SpringDamper]](list)
    for spring in held.vehicle.springs:
        if {spring.one, spring.two} & wheels:
            pairs[spring.one, spring.two].append(spring)
    stiff = [
        spring
        for springs in pairs.values()
        for spring in springs
        if _stiffness(spring) > ALIKE * min(map(_stiffness, springs))
    ]
    sorts: list[list[SpringDamper]] = []
    for spring in sorted(stiff, key=_stiffness):
        if sorts and _stiffness(spring) <= ALIKE * _stiffness(sorts[-1][0]):
            sorts[-1].append(spring)
        else:
            sorts.append([spring])
    return [_of(springs) for springs in sorts]


def _stiffness(spring: SpringDamper) -> float:
    return slopes_at_rest(spring)[0]


def _of(springs: list[SpringDamper]) -> Effect:
    names = [spring.name for spring in springs]
    said = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    bodies = {body for spring in springs for body in (spring.one, spring.two)}
    excludes = tuple(f"{body} {freedom}" for body in bodies for freedom in ("x", "y"))
    return Effect(
        f"bushings: {said}",
        partial(_without, springs=names),
        f"rigid: {', '.join(names)}",
        (),
        excludes,
        "a rigid bushing and a freedom that is locked would hold the same motion twice",
    )


def _without(held: Held, springs: list[str]) -> Held:
    return replace(held, rigid=held.rigid | set(springs))


def named(scene: Any) -> bool:
    """Whether a scene's vehicle has it."""
    return holds(scene, found)
