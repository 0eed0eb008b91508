"""What a linear stationary scene holds, and effects that may be left out of it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from models.core.errors import InputError
from models.core.scene_effects import module_of, names_of, tables_of
from models.core.scene_effects import without as without_own
from models.road.excitation import Excitation
from models.systems.ride.of_scene import excitation_of, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.limits import Limits
from models.vehicles.spatial import Freedom, SpatialVehicle
from models.vehicles.spatial_linear import wheels


@dataclass(frozen=True)
class Held:
    """Scene and vehicle, less what is left out: ``massless`` bodies, ``rigid`` springs, ``locked`` freedoms, and the
    laws of bent springs that are ``straight``: gains stand for them."""

    scene: RideScene
    vehicle: SpatialVehicle
    massless: frozenset[str] = frozenset()
    rigid: frozenset[str] = frozenset()
    locked: frozenset[tuple[str, Freedom]] = frozenset()
    straight: frozenset[str] = frozenset()

    @property
    def limits(self) -> Limits:
        """What the vehicle has not any more."""
        return Limits(self.massless, self.rigid, self.locked)

    def on_road(self, **changes: object) -> "Held":
        """With other values in [road]."""
        road = self.scene.road.model_copy(update=changes)
        return replace(self, scene=self.scene.model_copy(update={"road": road}))

    def excitation(self) -> Excitation:
        """The road under the wheels; axles that meet the same at once share one filter."""
        found = excitation_of(self.scene, wheels(self.vehicle))
        if found.independent or any(found.lengths):
            return found
        return replace(found, heights=(sum(found.heights),), lengths=(0.0,))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Effect:
    """One thing that may be left out: its name, what leaving it out means, and with what it goes.

    needs : effects that must be left out, too, and go with it; excludes : effects that may not be left out beside it;
    ``why``, a phrase for both. singular : no small change in any respect, so that it is solved and not screened.
    own : a table [effects.NAME], which goes before all others, for without it the vehicle is another one.
    """

    name: str
    without: Callable[[Held], Held] = field(compare=False)
    says: str
    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    why: str = ""
    singular: bool = False
    own: bool = False


def effects_of(held: Held) -> tuple[Effect, ...]:
    """Every effect that the scene's vehicle, road and own tables hold, file by file."""
    modules = {name: module_of(held.scene.system, name) for name in names_of(held.scene.system)}
    own = tuple(tables_of(held.scene))
    found = {name: module.found(held) for name, module in modules.items() if hasattr(module, "found")}
    found |= {
        name: [Effect(name, partial(_without, names=(name,)), modules[name].COST, singular=True, own=True)]
        for name in own
    }
    return tuple(
        _with_needy(effect, tuple(other for other in own if name in modules[other].NEEDS))
        for name in sorted(found)
        for effect in found[name]
    )


def _without(held: Held, names: tuple[str, ...]) -> Held:
    """Less some of the scene's own tables."""
    scene = without_own(held.scene, *names)
    return replace(held, scene=scene, vehicle=vehicle_of(scene))


def _with_needy(effect: Effect, needy: tuple[str, ...]) -> Effect:
    """Goes with those of the scene's own tables that need it."""
    return replace(effect, needs=(*effect.needs, *needy), why=effect.why or "for it needs it") if needy else effect


def holds(scene: RideScene, found: Callable[[Held], list[Effect]]) -> bool:
    """Whether a scene's vehicle and road hold any of the effects that a file finds."""
    return bool(found(Held(scene, vehicle_of(scene))))


def of_vehicle(table: dict[str, Any], scene: RideScene) -> None:
    """The ``leave_out`` of what a vehicle has: InputError, for it stands in no table of the scene."""
    raise InputError(
        scene.file,
        "vehicle.file",
        scene.vehicle.file,
        'has it: name a file without it, or let effects = "auto" leave it out',
    )


def illegal(chosen: Iterable[Effect]) -> str:
    """Why these may not be left out together, with the remedy; empty where they may."""
    chosen = tuple(chosen)
    names = {effect.name for effect in chosen}
    for effect in chosen:
        missing = [name for name in effect.needs if name not in names]
        if missing:
            return f"{effect.name} cannot be left out alone: leave out {' and '.join(missing)}, too, {effect.why}"
        clashing = [name for name in effect.excludes if name in names]
        if clashing:
            return f"{effect.name} cannot be left out beside {clashing[0]}: {effect.why}"
    return ""


def without(held: Held, chosen: Iterable[Effect]) -> Held:
    """The scene less these effects; its own tables go first and together."""
    chosen = tuple(chosen)
    own = tuple(effect.name for effect in chosen if effect.own)
    held = _without(held, own) if own else held
    for effect in chosen:
        held = held if effect.own else effect.without(held)
    return held
