"""A measured bicycle: weave eigenvalues from recordings, those of the unfitted model, and a choice of suspected
parameters that explains the differences.

``python -m studies.bicycle_measured FOLDER`` reads windows.csv and the recordings of a folder (see
``models.bicycle.weave``), chooses among the suspects on all speeds, or on those of ``--choose``, and predicts the rest;
without it each speed is predicted by a choice on all others, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from models.bicycle.suspects import (
    SUSPECTED_PARAMETERS,
    UNIT_OF_SUSPECT,
    averaged_weave,
    forecast_deviations,
    predicted_weave,
    ranked_suspects,
)
from models.bicycle.weave import WeaveObservation, read_observations
from models.bicycle.whipple import SteeringControl, Whipple, load_bicycle
from models.core.errors import InputError
from models.identification.subsets import SubsetChoice

EXPERIMENT_FEEDBACK = SteeringControl(gain=2.0, until=6.5)
"""Steer feedback of the experimenters during the recorded runs."""


@dataclass(frozen=True, eq=False)
class BicycleObservations:
    """Measured weave at all speeds, the chosen suspected parameters, and predicted weave by speed. A prediction is a
    mean (2,) and its differences from the measurement in standard deviations (2,). It is made for each speed that was
    not used in the choice; if all were used, each speed is predicted by a choice on all others."""

    observations: list[WeaveObservation]
    parameter_choice: SubsetChoice
    predictions: dict[float, tuple[np.ndarray, np.ndarray]]


def observed_and_predicted(
    data_folder: str | Path,
    chosen_speeds: Sequence[float] = (),
    bicycle: Whipple | None = None,
    base_control: SteeringControl = EXPERIMENT_FEEDBACK,
) -> BicycleObservations:
    """Choose suspected parameters from the measurements at the speeds ``chosen_speeds`` (m/s, all by default), and
    predict weave at the other speeds; raises InputError."""
    all_observations, bicycle = read_observations(data_folder), bicycle or load_bicycle("steer_by_wire")
    speeds = [observation.speed for observation in all_observations]
    for speed in chosen_speeds:
        if speed not in speeds:
            raise InputError(data_folder, "speeds", speed, f"no windows at this speed; there are {speeds} m/s")
    choice = ranked_suspects(
        bicycle, base_control, [o for o in all_observations if not chosen_speeds or o.speed in chosen_speeds]
    )
    predictions = {}
    for observation in all_observations:
        if chosen_speeds and observation.speed not in chosen_speeds:
            choice_without_it = choice
        elif chosen_speeds or len(all_observations) < 4:
            continue
        else:
            choice_without_it = ranked_suspects(
                bicycle, base_control, [o for o in all_observations if o is not observation]
            )
        mean, _ = averaged_weave(bicycle, base_control, choice_without_it, observation)
        predictions[observation.speed] = (
            mean,
            forecast_deviations(bicycle, base_control, choice_without_it, observation),
        )
    return BicycleObservations(all_observations, choice, predictions)


def observation_lines(
    bicycle_observations: BicycleObservations, bicycle: Whipple, base_control: SteeringControl = EXPERIMENT_FEEDBACK
) -> list[str]:
    """Lines for the screen on the measured and predicted weave, and on the chosen suspected parameters."""
    lines = ["speed    windows  damping [1/s]             nothing fitted    frequency [rad/s]         nothing fitted"]
    for observation in bicycle_observations.observations:
        mean, deviation, model = (
            observation.mean,
            observation.deviation,
            predicted_weave(bicycle, base_control, observation),
        )
        cells = [
            f"{sign * mean[i]:6.2f} +- {deviation[i]:4.2f}{sign * model[i]:17.2f} ({model[i] / mean[i] - 1.0:+5.0%})"
            for i, sign in ((0, -1.0), (1, 1.0))
        ]
        lines.append(f"{observation.speed:4.2f} m/s {len(observation.weave):5d}   {'    '.join(cells)}")
    choice, best = bicycle_observations.parameter_choice, bicycle_observations.parameter_choice.best_subset
    lines += ["", f"best of {len(choice.subset_fits)} subsets (inflation of chi^2: {choice.variance_inflation:.2f}):"]
    errors = np.sqrt(choice.variance_inflation * np.diag(best.covariance))
    for name, value, error in zip(best.names, best.values, errors, strict=True):
        lines.append(f"  {name:<14}{value:8.3f} +- {error:.3f} {UNIT_OF_SUSPECT.get(name, '')}")
    lines += ["", "suspect        weight of all subsets with it    F and p of leaving it out of the fullest"]
    for name in SUSPECTED_PARAMETERS:
        calls = (
            f"{choice.removal_tests[name][0]:8.1f}, p = {choice.removal_tests[name][1]:.2g}"
            if name in choice.removal_tests
            else ""
        )
        why = "no measured number depends on it" if name in choice.undetermined_parameters else calls
        lines.append(f"  {name:<14}{choice.importance(name):8.3f}{'':20}{why}")
    for name, (ratio, chance) in choice.removal_tests.items():
        if name not in SUSPECTED_PARAMETERS:
            lines.append(f"  {name:<42}{ratio:8.1f}, p = {chance:.2g}")
    for first_name, second_name, correlation in choice.hard_to_tell_apart():
        lines.append(
            f"  {first_name} and {second_name} are hard to tell apart: their estimates correlate by {correlation:+.3f}"
        )
    lines += ["", "predicted without their own speed, in standard deviations:"]
    for speed, (mean, gap) in bicycle_observations.predictions.items():
        verdict = "within 2" if np.abs(gap).max() <= 2.0 else "NOT within 2"
        lines.append(
            f"  {speed:4.2f} m/s  damping {-mean[0]:.2f} 1/s ({gap[0]:+.2f}), frequency {mean[1]:.2f} rad/s "
            f"({gap[1]:+.2f}): {verdict}"
        )
    return lines


def main(
    folder: Annotated[Path, typer.Argument(help="folder with windows.csv and recordings")],
    choose: Annotated[list[float] | None, typer.Option(help="speeds (m/s) on which suspects are chosen")] = None,
    bicycle: Annotated[str, typer.Option(help="parameter set, or a TOML file")] = "steer_by_wire",
) -> None:
    """Measure weave in recordings, and choose among the suspects."""
    try:
        whipple = load_bicycle(bicycle, scene_path="--bicycle", key_path="")
        print("\n".join(observation_lines(observed_and_predicted(folder, choose or (), whipple), whipple)))
    except InputError as error:
        raise SystemExit(f"twinrig: {error}") from None


if __name__ == "__main__":
    typer.run(main)
