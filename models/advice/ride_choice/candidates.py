"""Changes and costs of leaving out any set of effects of a linear ride scene: predicted, confirmed, and tested with
parameters off.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import wraps
from math import inf
from typing import Any, Self, TypeVar, cast

import numpy as np

from models.advice.ride_choice.march import Cost, March, cost, longest_step
from models.advice.ride_choice.neighbourhood import Neighbourhood
from models.advice.ride_choice.reduced import FullScene, Reduced, Vehicles, speed_if_needed
from models.advice.ride_choice.screen import Screen, exact_variances, variances_and_rounding, variances_from_modes
from models.core.errors import InputError
from models.core.runge_kutta import RK4_STAGES
from models.systems.ride.omissions import effects_of
from models.systems.ride.reduced_scene import OmissibleEffect, ReducedScene, reduced_without
from models.systems.ride.scene import RideScene

SCREENED_SPEEDS = 3
"""Number of speeds at which effects are screened, from the slowest to the fastest; the choice is confirmed at all
speeds.
"""
IDENTITY_ERROR = 1e-12
"""Largest relative error of the identity of covariance and adjoint that certifies a choice; a larger one is due to
rounding.
"""
VARIANCE_DIFFERENCE = 1e-9
"""Largest relative difference between a variance from eigenmodes and the one in extended precision."""

EffectSet = frozenset[OmissibleEffect]
Method = TypeVar("Method", bound=Callable[..., Any])


def cached_in_object(method: Method) -> Method:
    """Decorator of a method that stores its results in the object, by the arguments of the call."""

    @wraps(method)
    def answer(candidates: "Candidates", *arguments: Any) -> Any:
        key = method.__name__, *arguments
        if key not in candidates.cached_results:
            candidates.cached_results[key] = method(candidates, *arguments)
        return candidates.cached_results[key]

    return cast(Method, answer)


class Candidates:
    """Effects of a ride scene that may be left out, judged at its speeds (m/s) for quantities (names of outputs, also
    weighted ones).
    """

    def __init__(
        self, scene: ReducedScene, speeds: Sequence[float] | np.ndarray, quantities: Sequence[str], tolerance: float
    ) -> None:
        self.scene, self.tolerance, self.effects = scene, tolerance, effects_of(scene)
        self.cached_results: dict[tuple[Any, ...], Any] = {}
        self.vehicles, self.solved_equations = Vehicles(scene.vehicle, float(speeds[0])), 0
        self.full_scenes = [FullScene(scene, float(speed), self.vehicles) for speed in speeds]
        names = self.full_scenes[0].full.system.names
        self.quantities, self.rows = tuple(quantities), [names.index(name) for name in quantities]
        speed_count = min(SCREENED_SPEEDS, len(speeds))
        self.screened_scenes = [
            self.full_scenes[i] for i in np.linspace(0, len(speeds) - 1, speed_count).round().astype(int)
        ]
        self._suspects, self.full = list(self.screened_scenes), list[np.ndarray]()
        for full_scene in self.full_scenes:
            variances, silent = variances_and_rounding(full_scene.full, self.rows)
            self.full.append(variances)
            for name, variance, smallest_variance in zip(quantities, variances, silent, strict=True):
                if not smallest_variance < variance < inf:
                    allowed = "has no finite standard deviation above zero in this scene, so nothing to hold it to"
                    raise InputError("", f"quantities.{name}", None, allowed)
        Screen(self.full_scenes[0].full, self.rows)  # refuses a vehicle that cannot be screened
        plain = [self._row_and_weighting(name) for name in quantities]
        self.neighbourhood = Neighbourhood(scene, np.asarray(speeds, float), plain, self.vehicles)

    @classmethod
    def from_scene(cls, ride_scene: RideScene) -> Self:
        """The candidates of a ride scene, for its speeds, quantities and tolerance."""
        assert ride_scene.speeds is not None and ride_scene.tolerance is not None
        return cls(
            ReducedScene.complete(ride_scene), ride_scene.speeds.all(), ride_scene.quantities, ride_scene.tolerance
        )

    def _row_and_weighting(self, quantity_name: str) -> tuple[int, str]:
        """For a quantity, the row of the vehicle's output and the name of its weighting filter, "" if it has none."""
        weighted = {
            f"{name} {weighting_name}": (name, weighting_name)
            for name, weighting_name in self.scene.ride_scene.weighting.items()
        }
        name, weighting_name = weighted.get(quantity_name, (quantity_name, ""))
        return [output.name for output in self.scene.vehicle.outputs].index(name), weighting_name

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of eigenvalue problems, one for each vehicle that was built, and of Lyapunov equations that were
        solved.
        """
        return {
            "eigenvalue problems": len(self.vehicles) + self.neighbourhood.perturbed_vehicle_count,
            "Lyapunov equations": self.solved_equations,
        }

    @cached_in_object
    def reduced_scene_without(self, omitted_effects: EffectSet) -> ReducedScene:
        """The ride scene without these effects."""
        return reduced_without(self.scene, sorted(omitted_effects, key=lambda effect: effect.name))

    @cached_in_object
    def system(self, full_scene: FullScene, omitted_effects: EffectSet) -> Reduced | None:
        """The linear system of the scene without these effects at a speed; None where no meaningful system remains."""
        try:
            return full_scene.reduced(self.reduced_scene_without(omitted_effects))
        except InputError:
            return None

    def screen(self, full_scene: FullScene, omitted_effects: EffectSet) -> Screen | None:
        """Covariance and adjoints of the scene without its singular effects among these; None where they cannot be
        computed.
        """
        base = frozenset(effect for effect in omitted_effects if effect.is_singular)
        needs = {name for effect in base for name in effect.needs}
        return self._screen(full_scene, base | {effect for effect in omitted_effects if effect.name in needs})

    @cached_in_object
    def _screen(self, full_scene: FullScene, omitted_effects: EffectSet) -> Screen | None:
        reduced = self.system(full_scene, omitted_effects)
        self.solved_equations += 1 + len(self.rows)
        try:
            return None if reduced is None else Screen(reduced, self.rows)
        except InputError:
            return None

    @cached_in_object
    def predicted_changes(self, omitted_effects: EffectSet) -> np.ndarray:
        """Predicted relative changes (quantities,) of standard deviations, each the largest over the screened speeds;
        inf where no system remains.
        """
        return largest_changes(
            np.array([self._predicted_at(full_scene, omitted_effects) for full_scene in self.screened_scenes])
        )

    @cached_in_object
    def _predicted_at(self, full_scene: FullScene, omitted_effects: EffectSet) -> np.ndarray:
        return self._changes_at_speed(full_scene, omitted_effects, self._predicted_variances)

    def share(self, omitted_effects: EffectSet) -> float:
        """Ratio of the largest predicted change to the tolerance. It is inf once any speed exceeds the tolerance; the
        speed that did so last is tried first.
        """
        worst = 0.0
        for i, full_scene in enumerate(self._suspects):
            share = float(abs(self._predicted_at(full_scene, omitted_effects)).max()) / self.tolerance
            if not share <= 1.0:
                self._suspects.insert(0, self._suspects.pop(i))  # what breaks it here is likely to break the next one
                return inf
            worst = max(worst, share)
        return worst

    @cached_in_object
    def confirmed_changes(self, omitted_effects: EffectSet) -> np.ndarray:
        """Relative changes (quantities,) of standard deviations by the exact solution, each the largest over all listed
        speeds.
        """
        return largest_changes(
            np.array(
                [
                    self._changes_at_speed(full_scene, omitted_effects, self._exact_variances)
                    for full_scene in self.full_scenes
                ]
            )
        )

    @cached_in_object
    def changes_by_modes(self, omitted_effects: EffectSet) -> np.ndarray:
        """Relative changes (quantities,) of standard deviations, each the largest over all listed speeds, from
        eigenmodes of the reduced system wherever these are reliable.
        """
        return largest_changes(
            np.array(
                [
                    self._changes_at_speed(full_scene, omitted_effects, self._variances_by_modes)
                    for full_scene in self.full_scenes
                ]
            )
        )

    def certified(self, omitted_effects: EffectSet) -> bool:
        """Whether at the screened speeds the identity of covariance and adjoint holds in extended precision, and agrees
        with the variances from eigenmodes.
        """
        return all(self._is_certified_at(full_scene, omitted_effects) for full_scene in self.screened_scenes)

    def _is_certified_at(self, full_scene: FullScene, omitted_effects: EffectSet) -> bool:
        screen, reduced = self.screen(full_scene, frozenset()), self.system(full_scene, omitted_effects)
        if screen is None or reduced is None:
            return False
        self.solved_equations += 1 + len(self.rows)
        certificate_variances, variance = screen.certificate_sides(reduced)
        by_motions = variances_from_modes(reduced, self.rows)
        agrees_with_motions = by_motions is None or bool(
            (abs(by_motions / variance - 1.0) <= VARIANCE_DIFFERENCE).all()
        )
        return agrees_with_motions and bool((abs(certificate_variances / variance - 1.0) <= IDENTITY_ERROR).all())

    def _predicted_variances(
        self, full_scene: FullScene, omitted_effects: EffectSet, reduced_system: Reduced
    ) -> np.ndarray:
        screen = self.screen(full_scene, omitted_effects)
        return np.full(len(self.rows), inf) if screen is None else screen.predicted_variances(reduced_system)

    def _exact_variances(
        self, full_scene: FullScene, omitted_effects: EffectSet, reduced_system: Reduced
    ) -> np.ndarray:
        self.solved_equations += 1
        return exact_variances(reduced_system, self.rows)

    def _variances_by_modes(
        self, full_scene: FullScene, omitted_effects: EffectSet, reduced_system: Reduced
    ) -> np.ndarray:
        self.solved_equations += 1
        variances = variances_from_modes(reduced_system, self.rows)
        return exact_variances(reduced_system, self.rows) if variances is None else variances

    def _changes_at_speed(
        self,
        full_scene: FullScene,
        omitted_effects: EffectSet,
        variance_function: Callable[[FullScene, EffectSet, Reduced], np.ndarray],
    ) -> np.ndarray:
        """Relative changes (quantities,) of standard deviations at a speed, with the variances of the reduced system by
        the function ``variance_function``; inf where no system remains, or an unstable one.
        """
        reduced, full = self.system(full_scene, omitted_effects), self.full[self.full_scenes.index(full_scene)]
        left = np.full(len(full), inf)
        with suppress(InputError):  # unstable
            left = left if reduced is None else variance_function(full_scene, omitted_effects, reduced)
        return np.asarray(np.sqrt(left / full) - 1.0)

    @cached_in_object
    def changes_between_speeds(self, omitted_effects: EffectSet) -> np.ndarray:
        """Relative changes (quantities,) of standard deviations, each the largest over all speeds of the range; inf
        where no system remains.
        """
        reduced = self.system(self.full_scenes[0], omitted_effects)
        if reduced is None or not all((d[self.rows] == 0).all() for d in reduced.system.D):
            return np.full(len(self.rows), inf)
        return largest_changes(self.neighbourhood.changes(self.reduced_scene_without(omitted_effects)))

    @cached_in_object
    def off(self, omitted_effects: EffectSet) -> np.ndarray:
        """Relative changes (quantities,) of standard deviations over all speeds of the range with parameters off, in
        the combination that is worst for each quantity.
        """
        reduced_scene = self.reduced_scene_without(omitted_effects)
        return largest_changes(
            np.concatenate(
                [
                    self.neighbourhood.changes(reduced_scene, corner)
                    for corner in self.neighbourhood.corners(reduced_scene)
                ]
            )
        )

    def holds(self, changes: np.ndarray) -> bool:
        """Whether all relative changes (quantities,) are within the tolerance."""
        return bool((abs(changes) <= self.tolerance).all())

    def largest_change_text(self, changes: np.ndarray) -> str:
        """Text on the largest of the relative changes (quantities,), with the quantity's name."""
        worst = int(abs(changes).argmax())
        return f"{self.quantities[worst]} by {100 * changes[worst]:+.3g} %"

    @cached_in_object
    def cost(self, omitted_effects: EffectSet) -> Cost:
        """Cost of a run without these effects with the largest stable step, at the screened speed where it is highest;
        infinite where no meaningful system remains.
        """
        reduced_scene = self.reduced_scene_without(omitted_effects)
        independent_of_speed = speed_if_needed(reduced_scene.vehicle, 0.0) is None
        costs = [
            self._cost(full_scene, reduced_scene)
            for full_scene in (self.screened_scenes[:1] if independent_of_speed else self.screened_scenes)
        ]
        return max(costs, key=lambda c: c.calls)

    def _cost(self, full_scene: FullScene, reduced_scene: ReducedScene) -> Cost:
        try:
            return cost(
                full_scene.vehicles.reduced_vehicle_of(reduced_scene, full_scene.speed), full_scene.road(reduced_scene)
            )
        except InputError:
            return Cost(0, 0.0, inf)

    @cached_in_object
    def cost_at_equal_accuracy(self, omitted_effects: EffectSet) -> Cost:
        """Cost of a run without these effects with the longest step with which reduction and time steps together keep
        the tolerance at all screened speeds.
        """
        return self.cost_at_step(
            omitted_effects, longest_step(self.marches(omitted_effects), self.exact_deviations(), self.tolerance)
        )

    def exact_deviations(self) -> list[np.ndarray]:
        """Standard deviations (quantities,) of the full scene, one array for each of the screened speeds."""
        return [np.sqrt(self.full[self.full_scenes.index(full_scene)]) for full_scene in self.screened_scenes]

    def marches(self, omitted_effects: EffectSet) -> list[March]:
        """Time integrations of the scene without these effects, one for each of the screened speeds."""
        weightings = tuple(
            (row, weighting_name)
            for row, (_, weighting_name) in zip(self.rows, self.neighbourhood.quantities, strict=True)
            if weighting_name
        )
        reduced_scene = self.reduced_scene_without(omitted_effects)
        return [
            March(full_scene.reduced(reduced_scene), full_scene.speed, tuple(self.rows), weightings)
            for full_scene in self.screened_scenes
        ]

    def cost_at_step(self, omitted_effects: EffectSet, step: float) -> Cost:
        """Cost of a run without these effects with steps of ``step`` (s)."""
        return Cost(self.cost(omitted_effects).states, step, RK4_STAGES / step if step else inf)


def largest_changes(changes: np.ndarray) -> np.ndarray:
    """The largest change (quantities,) of each quantity, with its sign, among changes (n, quantities)."""
    return changes[abs(changes).argmax(axis=0), np.arange(changes.shape[1])]
