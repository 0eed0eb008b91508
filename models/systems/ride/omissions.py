"""Everything that may be left out of a ride scene, found in its vehicle, its road and its own tables, sort by sort."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from models.core.scene_effects import module_of, tables_of
from models.systems.ride.reduced_scene import Effect, ReducedScene
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import Freedom, SpatialVehicle, SpringDamper
from models.vehicles.spatial_linear import slopes_at_rest

LIGHT_BODY_SHARE = 0.2
"""A body that is not a wheel counts as light up to this share of the whole mass."""
SIMILAR_STIFFNESS_FACTOR = 2.0
"""Stiffnesses apart by no more than this factor are of one sort of bushing."""
ALL_WHEELS = "mass of all wheels"
TYRE_DAMPING = "tyre damping"
LAW_TEXTS = {"travel_force": "curves over travel", "rate_force": "curves over rate", "friction": "friction"}
"""Laws of springs, and what leaving out those of all springs is called: stops, bent dampers, dry friction."""
less, on_road = ReducedScene.reduced_further, ReducedScene.on_road


def effects_of(scene: ReducedScene) -> tuple[Effect, ...]:
    """Every effect of the scene's vehicle, road and own tables that can be left out, in the order of their sorts'
    names.
    """
    system = scene.ride.system
    tables = {name: module_of(system, name) for name in tables_of(scene.ride)}
    effects = {name: find(scene) for name, find in SORTS.items()}
    effects |= {
        name: [Effect(name, partial(_without_table, name=name), table.COST, is_singular=True, has_table=True)]
        for name, table in tables.items()
    }
    return tuple(
        _with_needy(effect, tuple(dependent for dependent, table in tables.items() if name in table.NEEDS))
        for name in sorted(effects)
        for effect in effects[name]
    )


def _without_table(scene: ReducedScene, name: str) -> ReducedScene:
    return scene.without_tables(name)


def _with_needy(effect: Effect, needy: tuple[str, ...]) -> Effect:
    """The effect, which now requires that the scene's own tables ``needy``, which need it, are left out as well."""
    return replace(effect, needs=(*effect.needs, *needy), why=effect.why or "for it needs it") if needy else effect


def has_omissions(scene: RideScene, sort: str) -> bool:
    """Whether a scene's vehicle and road have effects of this sort, which can be left out."""
    return bool(SORTS[sort](ReducedScene.complete(scene)))


def anti_roll_bars(scene: ReducedScene) -> list[Effect]:
    """Leaving out an anti-roll bar: one effect per bar."""
    return [
        Effect(f"bar {bar.name}", partial(_without_bar, bar=bar.name), f"no {bar.name}") for bar in scene.vehicle.bars
    ]


def _without_bar(scene: ReducedScene, bar: str) -> ReducedScene:
    bars = tuple(kept_bar for kept_bar in scene.vehicle.bars if kept_bar.name != bar)
    return replace(scene, vehicle=replace(scene.vehicle, bars=bars))


def wheels_of(vehicle: SpatialVehicle) -> set[str]:
    """Names of the bodies that carry tyres."""
    return {tyre.body for tyre in vehicle.tyres}


def body_mass(scene: ReducedScene) -> list[Effect]:
    """Leaving out masses: of the wheels of each axle, of all wheels together, then of light bodies one by one.

    White noise that comes through tyre damping would move a wheel without mass at an infinite rate.
    """
    vehicle, wheels = scene.vehicle, wheels_of(scene.vehicle)
    axles = [sorted({tyre.body for tyre in vehicle.tyres if tyre.axle == i}) for i in range(len(vehicle.axles))]
    groups = {f"mass of the wheels of axle {i + 1}": bodies for i, bodies in enumerate(axles)}

    def effect(name: str, bodies: list[str], excludes: tuple[str, ...]) -> Effect:
        white = scene.ride.road.cutoff is None and any(t.damping and t.body in bodies for t in vehicle.tyres)
        needs = (TYRE_DAMPING,) if white else ()
        why = "for the road's white noise would reach a body without mass" if white else "one names the other's bodies"
        says = f"{', '.join(bodies)} without mass"
        return Effect(name, partial(less, massless=bodies), says, needs, excludes, why, is_singular=True)

    effects = [effect(ALL_WHEELS, sorted(wheels), tuple(groups))]
    effects += [effect(name, bodies, (ALL_WHEELS,)) for name, bodies in groups.items() if len(axles) > 1]
    carriers = wheels | {body.parent for body in vehicle.bodies}
    largest_light_mass = LIGHT_BODY_SHARE * sum(body.mass for body in vehicle.bodies)
    light = [body.name for body in vehicle.bodies if body.name not in carriers and body.mass < largest_light_mass]
    return [*effects, *(effect(f"mass of {name}", [name], ()) for name in light)]


def rigid_bushing_effects(scene: ReducedScene) -> list[Effect]:
    """Making bushings at wheels rigid: one effect per group of similar stiffness, for springs that are stiffer than the
    softest one between the same two bodies.
    """
    wheels, pairs = wheels_of(scene.vehicle), defaultdict[tuple[str, str | None], list[SpringDamper]](list)
    for spring in scene.vehicle.springs:
        if {spring.first_body, spring.second_body} & wheels:
            pairs[spring.first_body, spring.second_body].append(spring)
    stiff = [
        spring
        for springs in pairs.values()
        for spring in springs
        if _stiffness(spring) > SIMILAR_STIFFNESS_FACTOR * min(map(_stiffness, springs))
    ]
    sorts: list[list[SpringDamper]] = []
    for spring in sorted(stiff, key=_stiffness):
        if sorts and _stiffness(spring) <= SIMILAR_STIFFNESS_FACTOR * _stiffness(sorts[-1][0]):
            sorts[-1].append(spring)
        else:
            sorts.append([spring])
    return [_rigid_bushings(springs) for springs in sorts]


def _stiffness(spring: SpringDamper) -> float:
    return slopes_at_rest(spring)[0]


def _rigid_bushings(springs: list[SpringDamper]) -> Effect:
    names = [spring.name for spring in springs]
    names_text = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    bodies = {body for spring in springs for body in (spring.first_body, spring.second_body)}
    return Effect(
        f"bushings: {names_text}",
        partial(less, rigid=names),
        f"rigid: {', '.join(names)}",
        excludes=tuple(f"{body} {freedom}" for body in bodies for freedom in ("x", "y")),
        why="a rigid bushing and a freedom that is locked would hold the same motion twice",
    )


def linear_law_effects(scene: ReducedScene) -> list[Effect]:
    """Replacing nonlinear laws by gains: one effect per law that any spring has, unless small motion replaces the laws
    anyway.
    """
    return [
        Effect(name, partial(less, straight=[law]), f"{name}: the gains of statistical linearisation", is_singular=True)
        for law, name in LAW_TEXTS.items()
        if not scene.ride.vehicle.small_motion and any(getattr(spring, law) for spring in scene.vehicle.springs)
    ]


def delay_effects(scene: ReducedScene) -> list[Effect]:
    """Leaving out the delay from front to rear: one effect, where axles follow one another."""
    follows = len(scene.vehicle.axles) > 1 and scene.ride.road.front_rear == "delayed"
    equal = Effect("delay front to rear", partial(on_road, front_rear="equal"), "all axles meet the same at once")
    return [equal] if follows else []


def locked_freedom_effects(scene: ReducedScene) -> list[Effect]:
    """Locking degrees of freedom: one effect per freedom of a body without tyres, and one per sort of freedom of the
    bodies with tyres.
    """
    wheels, groups = wheels_of(scene.vehicle), defaultdict[str, list[tuple[str, Freedom]]](list)
    shared = defaultdict[str, list[tuple[str, Freedom]]](list)
    for body, freedom in scene.vehicle.coordinates():
        if body not in wheels:
            groups[f"{body} {freedom}"].append((body, freedom))
        elif freedom != "z":
            shared[f"wheels {freedom}"].append((body, freedom))
    return [
        Effect(name, partial(less, locked=group), f"locked: {', '.join(map(' '.join, group))}", is_singular=True)
        for name, group in (*groups.items(), *shared.items())
    ]


def rigid_mount_effects(scene: ReducedScene) -> list[Effect]:
    """Making mounts rigid: one effect per pair of bodies that springs connect, if neither carries a tyre."""
    wheels, pairs = wheels_of(scene.vehicle), defaultdict[tuple[str, str], list[str]](list)
    for spring in scene.vehicle.springs:
        if spring.second_body is not None and not {spring.first_body, spring.second_body} & wheels:
            pairs[spring.first_body, spring.second_body].append(spring.name)
    return [
        Effect(
            f"springs of {body} on {other_body}",
            partial(less, rigid=springs),
            f"{body} sits rigidly on {other_body}",
            excludes=(*(f"{body} {freedom}" for freedom in scene.vehicle.body(body).freedoms), f"mass of {body}"),
            why="a body that sits rigidly on another has no motion of its own left",
        )
        for (body, other_body), springs in pairs.items()
    ]


def second_corner(scene: ReducedScene) -> list[Effect]:
    """Leaving out the road's second corner: one effect, where it has one. A damped tyre would then meet white noise."""
    if scene.ride.road.cutoff is None:
        return []
    needs = (TYRE_DAMPING,) if any(tyre.damping for tyre in scene.vehicle.tyres) else ()
    says, why = "road filters of first order", "for it would pass white noise"
    return [Effect("second corner of the road", partial(on_road, cutoff=None), says, needs, why=why)]


def second_track(scene: ReducedScene) -> list[Effect]:
    """Leaving out the second track: one effect, where wheels are off the centre line of a road with two tracks as
    modelled.
    """
    wide = len({tyre.point[1] for tyre in scene.vehicle.tyres}) > 1
    if not wide or scene.ride.road.left_right != "modelled":
        return []
    says = "left and right meet the same"
    return [Effect("second track", partial(on_road, left_right="equal"), says, is_singular=True)]


def tyre_damping(scene: ReducedScene) -> list[Effect]:
    """Leaving out the damping of tyres: one effect, where any tyre is damped."""
    damped = any(tyre.damping for tyre in scene.vehicle.tyres)
    return [Effect(TYRE_DAMPING, _without_damping, "tyres are springs without damping")] if damped else []


def _without_damping(scene: ReducedScene) -> ReducedScene:
    tyres = tuple(replace(tyre, damping=0.0) for tyre in scene.vehicle.tyres)
    return replace(scene, vehicle=replace(scene.vehicle, tyres=tyres))


SORTS: dict[str, Callable[[ReducedScene], list[Effect]]] = {
    "anti_roll_bars": anti_roll_bars,
    "body_mass": body_mass,
    "bushings": rigid_bushing_effects,
    "curves": linear_law_effects,
    "delay": delay_effects,
    "freedoms": locked_freedom_effects,
    "mounts": rigid_mount_effects,
    "second_corner": second_corner,
    "second_track": second_track,
    "tyre_damping": tyre_damping,
}
"""Sorts of effects by the name of their line in the table of effects."""
