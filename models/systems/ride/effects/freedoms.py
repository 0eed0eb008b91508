"""Single freedoms of bodies: locked. Wheels keep their up and down; their other freedoms are locked together."""

from collections import defaultdict
from dataclasses import replace
from functools import partial
from typing import Any

from models.systems.ride.reduced_scene import Effect, Held, holds, of_vehicle
from models.vehicles.spatial import Freedom

PLACE = "vehicle.file"
COST = "two states per freedom"
leave_out = of_vehicle


def found(held: Held) -> list[Effect]:
    """One effect per freedom of a body without a tyre, one per sort of freedom of those with one."""
    wheels = {tyre.body for tyre in held.vehicle.tyres}
    shared = defaultdict[Freedom, list[str]](list)
    out = []
    for body, freedom in held.vehicle.coordinates():
        if body not in wheels:
            out.append(_of(f"{body} {freedom}", [(body, freedom)]))
        elif freedom != "z":
            shared[freedom].append(body)
    return out + [_of(f"wheels {freedom}", [(body, freedom) for body in own]) for freedom, own in shared.items()]


def _of(name: str, freedoms: list[tuple[str, Freedom]]) -> Effect:
    said = ", ".join(f"{body} {freedom}" for body, freedom in freedoms)
    return Effect(name, partial(_without, freedoms=freedoms), f"locked: {said}", singular=True)


def _without(held: Held, freedoms: list[tuple[str, Freedom]]) -> Held:
    return replace(held, locked=held.locked | set(freedoms))


def named(scene: Any) -> bool:
    """Whether a scene's vehicle has it."""
    return holds(scene, found)
