"""A linear stationary scene without some of its effects, and the effects that may be left out."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from models.core.scene_effects import scene_without as without_own
from models.road.excitation import Excitation
from models.systems.ride.of_scene import excitation_of, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import Freedom, Limits, SpatialVehicle
from models.vehicles.spatial_linear import wheels


@dataclass(frozen=True)
class ReducedScene:
    """A ride and its vehicle without what is left out: ``massless`` bodies, ``rigid`` springs, ``locked`` freedoms, and
    ``straight`` laws of nonlinear springs, which gains replace.
    """

    ride: RideScene
    vehicle: SpatialVehicle
    massless: frozenset[str] = frozenset()
    rigid: frozenset[str] = frozenset()
    locked: frozenset[tuple[str, Freedom]] = frozenset()
    straight: frozenset[str] = frozenset()

    @classmethod
    def complete(cls, ride: RideScene) -> "ReducedScene":
        """The ride with its complete vehicle, nothing left out."""
        return cls(ride, vehicle_of(ride))

    @property
    def limits(self) -> Limits:
        """Limits by which the vehicle is reduced: massless, rigid and locked parts."""
        return Limits(self.massless, self.rigid, self.locked)

    def reduced_further(self, **names: Iterable[object]) -> "ReducedScene":
        """The scene reduced further: names are added to its sets, for example massless = ["wheel"]."""
        return replace(self, **{key: getattr(self, key) | set(added_names) for key, added_names in names.items()})

    def on_road(self, **changes: object) -> "ReducedScene":
        """The reduced scene with other values in [road]."""
        road = self.ride.road.model_copy(update=changes)
        return replace(self, ride=self.ride.model_copy(update={"road": road}))

    def without_tables(self, *names: str) -> "ReducedScene":
        """The reduced scene without some of its tables [effects.NAME]."""
        ride = without_own(self.ride, *names)
        return replace(self, ride=ride, vehicle=vehicle_of(ride))

    def excitation(self) -> Excitation:
        """The road under the wheels; axles that meet the same heights at the same time share one filter."""
        road = excitation_of(self.ride, wheels(self.vehicle))
        if road.independent or any(road.lengths):
            return road
        return replace(road, heights=(sum(road.heights),), lengths=(0.0,))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Effect:
    """Something that may be left out: its name, what leaving it out means, and its relation to other effects.

    needs : effects that must be left out as well; excludes : effects that may not be left out together with this one;
    ``why`` : the reason for both. is_singular : leaving it out is no small change in any respect, so that it is solved
    and not screened. has_table : it is a table [effects.NAME], which is removed before all other effects, since it
    changes the vehicle.
    """

    name: str
    without: Callable[[ReducedScene], ReducedScene] = field(compare=False)
    says: str
    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    why: str = ""
    is_singular: bool = False
    has_table: bool = False


def refusal_reason(omitted_effects: Iterable[Effect]) -> str:
    """Reason why these effects may not be left out together, with the remedy; empty where they may."""
    omitted_effects = tuple(omitted_effects)
    names = {effect.name for effect in omitted_effects}
    for effect in omitted_effects:
        missing = [name for name in effect.needs if name not in names]
        if missing:
            return f"{effect.name} cannot be left out alone: leave out {' and '.join(missing)}, too, {effect.why}"
        clashing = [name for name in effect.excludes if name in names]
        if clashing:
            return f"{effect.name} cannot be left out beside {clashing[0]}: {effect.why}"
    return ""


def reduced_without(scene: ReducedScene, omitted_effects: Iterable[Effect]) -> ReducedScene:
    """The scene without these effects; effects that are tables [effects.NAME] are removed first, all at once."""
    omitted_effects = tuple(omitted_effects)
    if tables := [effect.name for effect in omitted_effects if effect.has_table]:
        scene = scene.without_tables(*tables)
    for effect in omitted_effects:
        scene = scene if effect.has_table else effect.without(scene)
    return scene
