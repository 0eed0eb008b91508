"""Ride scenes from which some effects are left out, and the effects that can be left out."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from models.core.scene_effects import scene_without as without_own
from models.road.excitation import RoadExcitation
from models.systems.ride.of_scene import excitation_of, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import Freedom, ReductionLimits, SpatialVehicle
from models.vehicles.spatial_linear import wheels


@dataclass(frozen=True)
class ReducedScene:
    """A ride scene and its vehicle with some effects left out: ``massless`` bodies, ``rigid`` springs, ``locked``
    degrees of freedom, and nonlinear spring laws that are replaced by gains (``linearised_laws``).
    """

    ride_scene: RideScene
    vehicle: SpatialVehicle
    massless: frozenset[str] = frozenset()
    rigid: frozenset[str] = frozenset()
    locked: frozenset[tuple[str, Freedom]] = frozenset()
    linearised_laws: frozenset[str] = frozenset()

    @classmethod
    def complete(cls, ride_scene: RideScene) -> "ReducedScene":
        """Returns a ride scene with its complete vehicle, from which nothing is left out."""
        return cls(ride_scene, vehicle_of(ride_scene))

    @property
    def limits(self) -> ReductionLimits:
        """Massless bodies, rigid springs and locked degrees of freedom by which the vehicle is reduced."""
        return ReductionLimits(self.massless, self.rigid, self.locked)

    def reduced_further(self, **names_by_set: Iterable[object]) -> "ReducedScene":
        """Returns the scene with names added to its sets of left-out effects, for example massless = ["wheel"]."""
        return replace(
            self, **{key: getattr(self, key) | set(added_names) for key, added_names in names_by_set.items()}
        )

    def on_road(self, **road_changes: object) -> "ReducedScene":
        """Returns the reduced scene with other values of keys of [road]."""
        road = self.ride_scene.road.model_copy(update=road_changes)
        return replace(self, ride_scene=self.ride_scene.model_copy(update={"road": road}))

    def without_tables(self, *table_names: str) -> "ReducedScene":
        """Returns the reduced scene without some of its tables [effects.NAME]."""
        ride = without_own(self.ride_scene, *table_names)
        return replace(self, ride_scene=ride, vehicle=vehicle_of(ride))

    def excitation(self) -> RoadExcitation:
        """Returns the road's excitation of the wheels; axles that meet the same heights at the same time share one
        filter.
        """
        road = excitation_of(self.ride_scene, wheels(self.vehicle))
        if road.independent or any(road.lengths):
            return road
        return replace(road, heights=(sum(road.heights),), lengths=(0.0,))  # type: ignore[arg-type]


@dataclass(frozen=True)
class OmissibleEffect:
    """An effect of a ride scene that can be left out. without : function that leaves it out; says : text on what
    leaving it out means.

    needs : effects that must be left out as well; excludes : effects that may not be left out together with this one;
    ``why`` : the reason for both. is_singular : leaving it out is no small perturbation, so that the reduced scene is
    solved and not estimated. has_table : it is a table [effects.NAME], which is removed before all other effects, since
    it changes the vehicle.
    """

    name: str
    without: Callable[[ReducedScene], ReducedScene] = field(compare=False)
    says: str
    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    why: str = ""
    is_singular: bool = False
    has_table: bool = False


def refusal_reason(omitted_effects: Iterable[OmissibleEffect]) -> str:
    """Returns the reason why some effects may not be left out together, with the remedy; empty where they may."""
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


def reduced_without(reduced_scene: ReducedScene, omitted_effects: Iterable[OmissibleEffect]) -> ReducedScene:
    """Returns the scene without some effects. Effects that are tables [effects.NAME] are removed first, all at once."""
    omitted_effects = tuple(omitted_effects)
    if tables := [effect.name for effect in omitted_effects if effect.has_table]:
        reduced_scene = reduced_scene.without_tables(*tables)
    for effect in omitted_effects:
        reduced_scene = reduced_scene if effect.has_table else effect.without(reduced_scene)
    return reduced_scene
