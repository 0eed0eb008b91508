"""Mass of the wheels, of one axle or of all, and of every other light body: what moves then follows its springs."""

from dataclasses import replace
from functools import partial
from typing import Any

from models.systems.ride.effects import tyre_damping
from models.systems.ride.reduced_scene import Effect, Held, holds, of_vehicle

LIGHT = 0.2
"""A body that is not a wheel counts as light up to this share of the whole mass."""
ALL = "mass of all wheels"

PLACE = "vehicle.file"
COST = "two states per freedom of a light body"
leave_out = of_vehicle


def found(held: Held) -> list[Effect]:
    """Wheels of each axle and all together, then light bodies one by one."""
    vehicle = held.vehicle
    axles = [sorted({tyre.body for tyre in vehicle.tyres if tyre.axle == i}) for i in range(len(vehicle.axles))]
    groups = {f"mass of the wheels of axle {i + 1}": bodies for i, bodies in enumerate(axles)}
    names = {name for bodies in axles for name in bodies}
    whole = sum(body.mass for body in vehicle.bodies)
    out = [_of(held, ALL, sorted(names), tuple(groups))]
    out += [_of(held, name, bodies, (ALL,)) for name, bodies in groups.items() if len(axles) > 1]
    carriers = {body.parent for body in vehicle.bodies}
    light = [b.name for b in vehicle.bodies if b.name not in names | carriers and b.mass < LIGHT * whole]
    return [*out, *(_of(held, f"mass of {name}", [name], ()) for name in light)]


def _of(held: Held, name: str, bodies: list[str], excludes: tuple[str, ...]) -> Effect:
    """White noise that comes through tyre damping would move a wheel without mass at an infinite rate."""
    white = held.scene.road.cutoff is None and any(t.damping and t.body in bodies for t in held.vehicle.tyres)
    needs = (tyre_damping.NAME,) if white else ()
    why = "for the road's white noise would reach a body without mass" if white else "one names the other's bodies"
    return Effect(
        name, partial(_without, bodies=bodies), f"{', '.join(bodies)} without mass", needs, excludes, why, singular=True
    )


def _without(held: Held, bodies: list[str]) -> Held:
    return replace(held, massless=held.massless | set(bodies))


def named(scene: Any) -> bool:
    """Whether a scene's vehicle has it."""
    return holds(scene, found)
