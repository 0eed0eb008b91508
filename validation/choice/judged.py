"""Checks of chosen effects by independent computations.

Choices for linear rides are checked at nearby speeds and parameters by exact variances, by sums over frequencies, and
by the covariance of sampled runs at equal accuracy. Choices for time simulation are checked by two further runs.
"""

from dataclasses import dataclass, replace

import numpy as np

from models.advice.choice.choose import EffectChoice as ChoiceByRuns
from models.advice.choice.choose import EffectChooser as ChooserByRuns
from models.advice.ride_choice.candidates import EffectSet, largest_changes
from models.advice.ride_choice.choose import Chooser, RideChoice
from models.advice.ride_choice.march import longest_step
from models.advice.ride_choice.parameters import PARAMETER_ERROR, scaled_vehicle, uncertain_parameters
from models.advice.ride_choice.reduced import FullScene
from models.advice.ride_choice.screen import exact_variances
from models.ride.frequency import spectral_densities
from models.systems.ride.reduced_scene import ReducedScene, reduced_without
from validation.choice.drawn_scenes import ChoiceQuestion
from validation.choice.sampled import SampledStatistics
from validation.ride.drawn_rides import LinearRide, NonlinearRide

SPEED_SHARES = (0.7, 1.0, 1.3)
"""Speeds of a scene divided by its random speed."""
ANGULAR_FREQUENCIES = np.geomspace(1e-2, 3e5, 3000)
"""Angular frequencies (rad/s) of the sums over frequencies. Changes are accurate to 1e-3, as both scenes use the same
grid."""


def chooser_over_speeds(linear_ride: LinearRide) -> Chooser:
    """Chooser of effects for a range of speeds about the scene's speed."""
    return Chooser(
        linear_ride.scene,
        [share * linear_ride.speed for share in SPEED_SHARES],
        linear_ride.quantities,
        linear_ride.tolerance,
    )


def changes_by_frequency(chooser: Chooser, ride_choice: RideChoice) -> np.ndarray:
    """Relative changes (number of quantities,) that a choice of effects causes, by frequency responses, at the speed at
    which they are largest."""
    left = reduced_without(chooser.scene, ride_choice.left_out)
    ratios = [
        _variances_by_frequency(full_scene, left, chooser.rows)
        / _variances_by_frequency(full_scene, chooser.scene, chooser.rows)
        for full_scene in chooser.full_scenes
    ]
    return largest_changes(np.sqrt(ratios) - 1)


def _variances_by_frequency(full_scene: FullScene, reduced_scene: ReducedScene, quantity_rows: list[int]) -> np.ndarray:
    """Variances (number of quantities,) of a scene from sums over frequencies with the mass, damping and stiffness
    matrices. No state space is built, so that the mass matrix may be singular."""
    reduced = full_scene.reduced(reduced_scene)
    densities = spectral_densities(reduced.vehicle, reduced.excitation, full_scene.speed, ANGULAR_FREQUENCIES)[
        :, quantity_rows
    ]
    return 2 * np.trapezoid(densities, ANGULAR_FREQUENCIES, axis=0)


def worst_nearby(chooser: Chooser, omitted_effects: EffectSet, draw_count: int, seed: int) -> float:
    """Largest relative change without the omitted effects divided by the tolerance, over random speeds in the chooser's
    range and random errors of all parameters."""
    random, reduced_scene, worst = np.random.default_rng(seed), chooser.reduced_scene_without(omitted_effects), 0.0
    low, high = chooser.full_scenes[0].speed, chooser.full_scenes[-1].speed
    names = uncertain_parameters(chooser.scene.vehicle)
    for _ in range(draw_count):
        factors = dict(zip(names, 1.0 + PARAMETER_ERROR * random.uniform(-1.0, 1.0, len(names)), strict=True))
        full, left = (
            replace(scene, vehicle=scaled_vehicle(scene.vehicle, factors)) for scene in (chooser.scene, reduced_scene)
        )
        full_scene = FullScene(full, float(random.uniform(low, high)))
        ratio = exact_variances(full_scene.reduced(left), chooser.rows) / exact_variances(full_scene.full, chooser.rows)
        worst = max(worst, float(abs(np.sqrt(ratio) - 1.0).max()))
    return worst / chooser.tolerance


def measured_step(chooser: Chooser, omitted_effects: EffectSet) -> float:
    """Longest time step (s) with which runs without the omitted effects keep the tolerance, by the covariance of their
    sampled states; for quantities without weighting."""
    return longest_step(
        [SampledStatistics(march) for march in chooser.marches(omitted_effects)],
        chooser.exact_deviations(),
        chooser.tolerance,
    )


@dataclass(frozen=True)
class ChoiceCheckedByRuns:
    """A scene, its choice of effects, and the relative changes (number of quantities,) that two further runs show. For
    rides the runs use new roads, and the changes are the smallest that are significant."""

    system: str
    engine: str
    question: ChoiceQuestion | NonlinearRide
    choice: ChoiceByRuns
    repeated_changes: np.ndarray

    @property
    def is_honest(self) -> bool:
        """False if the choice claims to keep the tolerance and the further runs exceed it."""
        return not self.choice.within_tolerance or bool(
            (self.repeated_changes <= self.question.tolerance * (1 + 1e-9)).all()
        )


def choice_checked_by_runs(question: ChoiceQuestion, system_name: str, engine: str) -> ChoiceCheckedByRuns:
    """Choose effects for a scene in an engine, then run the full and the reduced scene once more to check the
    choice."""
    chooser = ChooserByRuns(question.scene(), engine, list(question.quantities), question.tolerance)
    choice, runs = chooser.choose(), chooser.whole.variants
    full_run = runs.system.computed_quantities(question.scene(), engine)
    reduced_run = runs.system.computed_quantities(
        runs.changed_scene(frozenset(choice.left_out), choice.step_factor), engine
    )
    confirmed_changes = [
        largest_change(full_run.quantity(name).case_values, reduced_run.quantity(name).case_values)
        for name in question.quantities
    ]
    return ChoiceCheckedByRuns(system_name, engine, question, choice, np.array(confirmed_changes))


def largest_change(full_cases: tuple[np.ndarray, ...], reduced_cases: tuple[np.ndarray, ...]) -> float:
    """Largest relative change between the full and the reduced scene over all cases: rms difference at common rows
    divided by the standard deviation of the full path, or by the magnitude of a single number."""
    worst = 0.0
    for full, left in zip(full_cases, reduced_cases, strict=True):
        rows = np.linspace(0, len(full) - 1, len(left)).round().astype(int)
        size = full.std() if len(full) > 1 else abs(full[0])
        largest = max(case.std() if len(case) > 1 else abs(case[0]) for case in full_cases)
        worst = max(worst, float(np.sqrt(np.mean((left - full[rows]) ** 2)) / max(size, 1e-3 * largest)))
    return worst
