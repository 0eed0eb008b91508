"""Faults planted in the automatic choice of effects, and the checks that see them.

In the linear scene a change of the deviations is large enough to differ from its prediction, and more effects would be
left out without the tolerance.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from models.advice.choice.choose import EffectChooser
from models.advice.choice.screen import EffectScreen
from models.advice.ride_choice.choose import Chooser as LinearChooser
from models.advice.ride_choice.choose import RideChoice
from models.advice.ride_choice.screen import Screen as LinearScreen
from validation.choice.drawn_scenes import ChoiceQuestion
from validation.choice.drawn_scenes import draw_scene as drawn_run
from validation.choice.judged import (
    ChoiceCheckedByRuns,
    changes_by_frequency,
    choice_checked_by_runs,
    chooser_over_speeds,
    worst_nearby,
)
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import attribute_patch
from validation.ride.drawn_rides import LinearRide, random_linear_ride

SEED, HALF_CAR_SEED = 61, 4
"""Seeds of the random linear scene and of the random half car that is simulated."""
DRAWN_RIDES = 32
"""Number of random parameter sets at which the linear choice is checked."""

TOLERANCE = 1e-3
"""Tolerance of the half car's choice, which omitting its gyro or its pitch spring would exceed."""


@cache
def _linear_ride() -> LinearRide:
    return random_linear_ride(SEED)


@cache
def _half_car_question() -> ChoiceQuestion:
    run = drawn_run("pitch-plane", HALF_CAR_SEED)
    return replace(
        run, scene_table={**run.scene_table, "run": {**run.scene_table["run"], "duration": 0.5}}, tolerance=TOLERANCE
    )


def _linear_choice_and_changes() -> tuple[RideChoice, np.ndarray, float]:
    """Effects chosen for the linear scene by the present (perhaps faulty) functions; the changes (number of
    quantities,) by frequency responses; and the largest change at nearby speeds and parameters."""
    return _linear_choice_with_functions(
        LinearChooser.__init__, LinearChooser.confirmed_changes, LinearChooser.off, LinearScreen.predicted_variances
    )


def _choice_by_runs() -> ChoiceCheckedByRuns:
    """Effects chosen for the half car by simulation, checked by two further runs."""
    return _choice_with_functions(
        EffectChooser.__init__, EffectChooser.confirmed_changes, EffectScreen.relative_changes
    )


@cache
def _linear_choice_with_functions(*replaced_functions: Any) -> tuple[RideChoice, np.ndarray, float]:
    chooser = chooser_over_speeds(_linear_ride())
    choice = chooser.choose()
    nearby = worst_nearby(chooser, frozenset(choice.left_out), DRAWN_RIDES, DRAWN_RIDES) * chooser.tolerance
    return choice, changes_by_frequency(chooser, choice), nearby


@cache
def _choice_with_functions(*replaced_functions: Any) -> ChoiceCheckedByRuns:
    return choice_checked_by_runs(_half_car_question(), "pitch-plane", "reference")


def _reported_change_error() -> float:
    """Largest difference between the reported changes and the changes by frequency responses."""
    choice, by_frequency, _ = _linear_choice_and_changes()
    return float(np.abs(by_frequency - choice.confirmed_change).max())


def _reported_change() -> float:
    """Largest change by frequency responses divided by the tolerance; 0 if the choice is not reported as within the
    tolerance."""
    choice, by_frequency, _ = _linear_choice_and_changes()
    return choice.within_tolerance * float(np.abs(by_frequency).max()) / _linear_ride().tolerance


def _prediction_difference() -> float:
    """Largest difference (octaves) between predicted changes and changes by frequency responses; infinite if a sign is
    wrong."""
    choice, by_frequency, _ = _linear_choice_and_changes()
    with np.errstate(invalid="ignore", divide="ignore"):
        octaves = np.abs(np.log2(choice.predicted_change / by_frequency)).max()
    return float(np.nan_to_num(octaves, nan=np.inf))


def _unreported_change() -> float:
    """Largest change at random speeds and parameters divided by the largest reported change."""
    choice, _, nearby = _linear_choice_and_changes()
    return nearby / float(np.abs(choice.change_with_parameters_off).max())


def _reported_difference() -> float:
    """Largest difference between the reported changes of a half car and the changes by two further runs."""
    by_runs = _choice_by_runs()
    return float(np.abs(by_runs.repeated_changes - by_runs.choice.confirmed_change).max())


def _change_by_runs_ratio() -> float:
    """Largest change by two further runs divided by the tolerance; 0 if the choice is not reported as within the
    tolerance."""
    by_runs = _choice_by_runs()
    return by_runs.choice.within_tolerance * float(by_runs.repeated_changes.max()) / _half_car_question().tolerance


CHECKS = {
    "frequencies": Check(
        "quarter car: confirmed changes, spectra summed", "of a deviation", 1e-6, _reported_change_error
    ),
    "tolerance": Check("quarter car: its change by the tolerance asked for", "times", 1.01, _reported_change),
    "predictions": Check("quarter car: predictions by the changes", "octaves", 1.0, _prediction_difference),
    "nearby": Check("quarter car: its change nearby by the largest one reported", "times", 1.01, _unreported_change),
    "two runs": Check("half car: confirmed changes, run once more", "of a deviation", 1e-9, _reported_difference),
    "tolerance of runs": Check("half car: its change by the tolerance asked for", "times", 1.0, _change_by_runs_ratio),
}


def _opposite_prediction(original_function: Any) -> Any:
    def predicted(linear_screen: LinearScreen, reduced_scene: Any) -> np.ndarray:
        C = linear_screen.base.system.C[linear_screen.rows]
        full = np.einsum("ki,ij,kj->k", C, linear_screen.P, C)
        return np.maximum(2 * full - original_function(linear_screen, reduced_scene), 0.0)

    return predicted


def _tolerance_ignored(original_function: Any) -> Any:
    def init(
        chooser: Any,
        first_argument: Any,
        second_argument: Any,
        quantities: Any,
        tolerance: float,
        *further_arguments: Any,
    ) -> None:
        original_function(chooser, first_argument, second_argument, quantities, 0.9, *further_arguments)

    return init


def _unconfirmed_report(
    predict_changes: Callable[[EffectChooser, frozenset[str], int], np.ndarray],
) -> Callable[[Any], Any]:
    """Fault: predicted changes are reported as confirmed without a run."""

    def confirmed_changes(chooser: EffectChooser, omitted_effects: frozenset[str]) -> np.ndarray:
        step_factor = chooser.longest_step_factor(omitted_effects)
        shares = predict_changes(chooser, omitted_effects, step_factor)
        chooser._confirmed[omitted_effects] = step_factor, shares, np.zeros_like(shares)
        return shares

    return lambda real: confirmed_changes


LINEAR_MODULES, RUN_MODULES = "models.advice.ride_choice", "models.advice.choice"
FAULTS = (
    CampaignFault(
        "sign of the predicted change",
        "screen of linear scenes",
        attribute_patch(f"{LINEAR_MODULES}.screen:Screen.predicted_variances", _opposite_prediction),
    ),
    CampaignFault(
        "predictions reported as confirmed",
        "choice of linear scenes",
        attribute_patch(
            f"{LINEAR_MODULES}.choose:Chooser.confirmed_changes",
            lambda real: lambda chooser, chosen: chooser.predicted_changes(chosen),
        ),
    ),
    CampaignFault(
        "confirmed against itself",
        "choice of linear scenes",
        attribute_patch(
            f"{LINEAR_MODULES}.choose:Chooser.confirmed_changes",
            lambda real: lambda chooser, chosen: 0.0 * chooser.full[0],
        ),
    ),
    CampaignFault(
        "tolerance ignored",
        "choice of linear scenes",
        attribute_patch(f"{LINEAR_MODULES}.choose:Chooser.__init__", _tolerance_ignored),
    ),
    CampaignFault(
        "parameters that are off taken as they stand",
        "choice of linear scenes",
        attribute_patch(
            f"{LINEAR_MODULES}.choose:Chooser.off",
            lambda real: lambda chooser, chosen: chooser.changes_between_speeds(chosen),
        ),
    ),
    CampaignFault(
        "predictions reported as confirmed",
        "choice by runs",
        attribute_patch(
            f"{RUN_MODULES}.choose:EffectChooser.confirmed_changes",
            _unconfirmed_report(lambda chooser, chosen, times: chooser.change_with_longer_steps(chosen, times)),
        ),
    ),
    CampaignFault(
        "confirmed against itself",
        "choice by runs",
        attribute_patch(
            f"{RUN_MODULES}.choose:EffectChooser.confirmed_changes",
            _unconfirmed_report(lambda chooser, *_: np.zeros(len(chooser.whole.quantities))),
        ),
    ),
    CampaignFault(
        "tolerance ignored",
        "choice by runs",
        attribute_patch(f"{RUN_MODULES}.choose:EffectChooser.__init__", _tolerance_ignored),
    ),
    CampaignFault(
        "the least change of all quantities taken for each",
        "screen by runs",
        attribute_patch(
            f"{RUN_MODULES}.screen:EffectScreen.relative_changes",
            lambda real: lambda screen, change: np.full(len(screen.quantities), real(screen, change).min()),
        ),
    ),
)


CAMPAIGN = Campaign("planted.choice", "the choice of effects", "effects", CHECKS, FAULTS)
