"""Effects that can be left out of a ride scene, listed from its vehicle, its road and its tables [effects.NAME]."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from models.core.scene_effects import effect_of, effect_tables_of
from models.systems.ride.reduced_scene import OmissibleEffect, ReducedScene
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import Freedom, SpatialVehicle, SpringDamper
from models.vehicles.spatial_linear import slopes_at_rest

LIGHT_BODY_SHARE = 0.2
"""Largest mass of a light body other than a wheel, divided by the vehicle's mass; the mass of a light body can be left
out.
"""
SIMILAR_STIFFNESS_FACTOR = 2.0
"""Largest ratio of two stiffnesses in a group of bushings that are made rigid together, and ratio of a bushing's to the
softest stiffness between the same bodies that it must exceed.
"""
ALL_WHEELS_EFFECT = "mass of all wheels"
TYRE_DAMPING_EFFECT = "tyre damping"
"""Names of effects to which other effects refer."""
LAW_TEXTS = {"travel_force": "curves over travel", "rate_force": "curves over rate", "friction": "friction"}
"""Nonlinear laws of springs, and the name of the effect that replaces them in all springs: stops, curved dampers, dry
friction.
"""
reduced_further, on_road = ReducedScene.reduced_further, ReducedScene.on_road


def effects_of(reduced_scene: ReducedScene) -> tuple[OmissibleEffect, ...]:
    """Returns all effects of a scene that can be left out, from vehicle, road and tables [effects.NAME], sorted by the
    names of their kinds.
    """
    system = reduced_scene.ride_scene.system
    tables = {name: effect_of(system, name) for name in effect_tables_of(reduced_scene.ride_scene)}
    effects = {name: find(reduced_scene) for name, find in EFFECTS_BY_KIND.items()}
    effects |= {
        name: [
            OmissibleEffect(
                name, partial(_without_table, table_name=name), table.COST, is_singular=True, has_table=True
            )
        ]
        for name, table in tables.items()
    }
    return tuple(
        _with_dependents(effect, tuple(dependent for dependent, table in tables.items() if name in table.NEEDS))
        for name in sorted(effects)
        for effect in effects[name]
    )


def _without_table(reduced_scene: ReducedScene, table_name: str) -> ReducedScene:
    """Returns the scene without one of its tables [effects.NAME]."""
    return reduced_scene.without_tables(table_name)


def _with_dependents(effect: OmissibleEffect, dependent_tables: tuple[str, ...]) -> OmissibleEffect:
    """Returns the effect with the requirement that the tables [effects.NAME] in ``dependent_tables``, which need it,
    are left out as well.
    """
    return (
        replace(effect, needs=(*effect.needs, *dependent_tables), why=effect.why or "for it needs it")
        if dependent_tables
        else effect
    )


def has_omissions(scene: RideScene, effect_kind: str) -> bool:
    """Whether a scene's vehicle or road has effects of a kind (a key of EFFECTS_BY_KIND) that can be left out."""
    return bool(EFFECTS_BY_KIND[effect_kind](ReducedScene.complete(scene)))


def anti_roll_bar_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effects that leave out an anti-roll bar each."""
    return [
        OmissibleEffect(f"bar {bar.name}", partial(_without_bar, bar_name=bar.name), f"no {bar.name}")
        for bar in reduced_scene.vehicle.bars
    ]


def _without_bar(reduced_scene: ReducedScene, bar_name: str) -> ReducedScene:
    """Returns the scene without an anti-roll bar."""
    bars = tuple(kept_bar for kept_bar in reduced_scene.vehicle.bars if kept_bar.name != bar_name)
    return replace(reduced_scene, vehicle=replace(reduced_scene.vehicle, bars=bars))


def wheels_of(vehicle: SpatialVehicle) -> set[str]:
    """Names of the bodies that carry tyres."""
    return {tyre.body for tyre in vehicle.tyres}


def body_mass_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effects that leave out mass: of all wheels, of the wheels of each axle, of each light body.

    White noise that comes through tyre damping would move a wheel without mass at an infinite rate.
    """
    vehicle, wheels = reduced_scene.vehicle, wheels_of(reduced_scene.vehicle)
    axles = [sorted({tyre.body for tyre in vehicle.tyres if tyre.axle == i}) for i in range(len(vehicle.axles))]
    groups = {f"mass of the wheels of axle {i + 1}": bodies for i, bodies in enumerate(axles)}

    def effect(effect_name: str, massless_bodies: list[str], excluded_effects: tuple[str, ...]) -> OmissibleEffect:
        white = reduced_scene.ride_scene.road.cutoff is None and any(
            t.damping and t.body in massless_bodies for t in vehicle.tyres
        )
        needs = (TYRE_DAMPING_EFFECT,) if white else ()
        why = "for the road's white noise would reach a body without mass" if white else "one names the other's bodies"
        says = f"{', '.join(massless_bodies)} without mass"
        return OmissibleEffect(
            effect_name,
            partial(reduced_further, massless=massless_bodies),
            says,
            needs,
            excluded_effects,
            why,
            is_singular=True,
        )

    effects = [effect(ALL_WHEELS_EFFECT, sorted(wheels), tuple(groups))]
    effects += [effect(name, bodies, (ALL_WHEELS_EFFECT,)) for name, bodies in groups.items() if len(axles) > 1]
    carriers = wheels | {body.parent for body in vehicle.bodies}
    largest_light_mass = LIGHT_BODY_SHARE * sum(body.mass for body in vehicle.bodies)
    light = [body.name for body in vehicle.bodies if body.name not in carriers and body.mass < largest_light_mass]
    return [*effects, *(effect(f"mass of {name}", [name], ()) for name in light)]


def rigid_bushing_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effects that make bushings at wheels rigid, one per group of similar stiffness. Bushings are springs
    more than SIMILAR_STIFFNESS_FACTOR times as stiff as the softest spring between the same two bodies.
    """
    wheels, pairs = wheels_of(reduced_scene.vehicle), defaultdict[tuple[str, str | None], list[SpringDamper]](list)
    for spring in reduced_scene.vehicle.springs:
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
    """Stiffness (N/m) of a spring at rest."""
    return slopes_at_rest(spring)[0]


def _rigid_bushings(springs: list[SpringDamper]) -> OmissibleEffect:
    """Returns the effect that makes some bushings rigid."""
    names = [spring.name for spring in springs]
    names_text = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    bodies = {body for spring in springs for body in (spring.first_body, spring.second_body)}
    return OmissibleEffect(
        f"bushings: {names_text}",
        partial(reduced_further, rigid=names),
        f"rigid: {', '.join(names)}",
        excludes=tuple(f"{body} {freedom}" for body in bodies for freedom in ("x", "y")),
        why="a rigid bushing and a freedom that is locked would hold the same motion twice",
    )


def linear_law_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effects that replace nonlinear spring laws by gains, one per law that any spring has; none where
    small motion replaces the laws anyway.
    """
    return [
        OmissibleEffect(
            name,
            partial(reduced_further, linearised_laws=[law]),
            f"{name}: the gains of statistical linearisation",
            is_singular=True,
        )
        for law, name in LAW_TEXTS.items()
        if not reduced_scene.ride_scene.vehicle.small_motion
        and any(getattr(spring, law) for spring in reduced_scene.vehicle.springs)
    ]


def delay_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effect that leaves out the delay from front to rear axle; none where no axle follows another."""
    follows = len(reduced_scene.vehicle.axles) > 1 and reduced_scene.ride_scene.road.front_rear == "delayed"
    equal = OmissibleEffect(
        "delay front to rear", partial(on_road, front_rear="equal"), "all axles meet the same at once"
    )
    return [equal] if follows else []


def locked_freedom_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effects that lock degrees of freedom: one per freedom of a body without tyres, and one per direction
    for the freedoms of all wheels, except vertical.
    """
    wheels, groups = wheels_of(reduced_scene.vehicle), defaultdict[str, list[tuple[str, Freedom]]](list)
    shared = defaultdict[str, list[tuple[str, Freedom]]](list)
    for body, freedom in reduced_scene.vehicle.coordinates():
        if body not in wheels:
            groups[f"{body} {freedom}"].append((body, freedom))
        elif freedom != "z":
            shared[f"wheels {freedom}"].append((body, freedom))
    return [
        OmissibleEffect(
            name, partial(reduced_further, locked=group), f"locked: {', '.join(map(' '.join, group))}", is_singular=True
        )
        for name, group in (*groups.items(), *shared.items())
    ]


def rigid_mount_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effects that make mounts rigid, one per pair of bodies that springs connect, if neither carries a
    tyre.
    """
    wheels, pairs = wheels_of(reduced_scene.vehicle), defaultdict[tuple[str, str], list[str]](list)
    for spring in reduced_scene.vehicle.springs:
        if spring.second_body is not None and not {spring.first_body, spring.second_body} & wheels:
            pairs[spring.first_body, spring.second_body].append(spring.name)
    return [
        OmissibleEffect(
            f"springs of {body} on {other_body}",
            partial(reduced_further, rigid=springs),
            f"{body} sits rigidly on {other_body}",
            excludes=(
                *(f"{body} {freedom}" for freedom in reduced_scene.vehicle.body(body).freedoms),
                f"mass of {body}",
            ),
            why="a body that sits rigidly on another has no motion of its own left",
        )
        for (body, other_body), springs in pairs.items()
    ]


def second_corner_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effect that leaves out the road spectrum's second corner; none where it has none. White noise would
    then reach damped tyres, so that tyre damping must be left out, too.
    """
    if reduced_scene.ride_scene.road.cutoff is None:
        return []
    needs = (TYRE_DAMPING_EFFECT,) if any(tyre.damping for tyre in reduced_scene.vehicle.tyres) else ()
    says, why = "road filters of first order", "for it would pass white noise"
    return [OmissibleEffect("second corner of the road", partial(on_road, cutoff=None), says, needs, why=why)]


def second_track_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effect that leaves out the second track of the road; none where all wheels are in one line or the
    tracks are not correlated as modelled.
    """
    wide = len({tyre.point[1] for tyre in reduced_scene.vehicle.tyres}) > 1
    if not wide or reduced_scene.ride_scene.road.left_right != "modelled":
        return []
    says = "left and right meet the same"
    return [OmissibleEffect("second track", partial(on_road, left_right="equal"), says, is_singular=True)]


def tyre_damping_effects(reduced_scene: ReducedScene) -> list[OmissibleEffect]:
    """Returns the effect that leaves out the damping of tyres; none where no tyre is damped."""
    damped = any(tyre.damping for tyre in reduced_scene.vehicle.tyres)
    return (
        [OmissibleEffect(TYRE_DAMPING_EFFECT, _without_damping, "tyres are springs without damping")] if damped else []
    )


def _without_damping(reduced_scene: ReducedScene) -> ReducedScene:
    tyres = tuple(replace(tyre, damping=0.0) for tyre in reduced_scene.vehicle.tyres)
    return replace(reduced_scene, vehicle=replace(reduced_scene.vehicle, tyres=tyres))


EFFECTS_BY_KIND: dict[str, Callable[[ReducedScene], list[OmissibleEffect]]] = {
    "anti_roll_bars": anti_roll_bar_effects,
    "body_mass": body_mass_effects,
    "bushings": rigid_bushing_effects,
    "curves": linear_law_effects,
    "delay": delay_effects,
    "freedoms": locked_freedom_effects,
    "mounts": rigid_mount_effects,
    "second_corner": second_corner_effects,
    "second_track": second_track_effects,
    "tyre_damping": tyre_damping_effects,
}
"""Functions that list the effects of each kind, by the kind's name in the table of effects."""
