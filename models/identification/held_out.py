"""Identification on one stretch of a measurement, with cross-validation on its parts, and prediction of another
stretch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.identification.bands import ErrorBands, ErrorModel, error_bands, error_model
from models.identification.fit import ParameterFit, fit
from models.identification.of_scene import identification_problem_of
from models.identification.problem import IdentificationProblem
from models.identification.uncertainty import Uncertainty, uncertainty

Progress = Callable[[str, float], None]
"""Function that is called with a text and the completed share."""


@dataclass(frozen=True)
class ParameterSearch:
    """Settings of an identification. parameters : KEY or KEY=LOW:HIGH; channels : those compared; low_pass (Hz); blocks
    : number of parts of the first stretch for cross-validation."""

    parameters: Sequence[str]
    channels: Sequence[str]
    low_pass: float = 0.0
    blocks: int = 3


@dataclass(frozen=True, eq=False)
class IdentifiedVehicle:
    """Results for one vehicle: the fit with its uncertainty, the errors on parts of the data that were not used in the
    fit, and the prediction."""

    uncertainty: Uncertainty
    errors: list[ErrorModel]
    cross_validation_errors: np.ndarray
    bands: ErrorBands


def identified_vehicle(
    fitted_scene: Any,
    predicted_scene: Any,
    parameter_search: ParameterSearch,
    report_progress: Progress = lambda text, share: None,
) -> IdentifiedVehicle:
    """Parameters fitted to the first stretch of a measurement, cross-validation on its parts, and prediction of the
    second stretch with error bands."""
    problem = _fit_problem(fitted_scene, parameter_search)
    solved = fit(problem, report_stage=lambda text, share: report_progress(text, 0.4 * share))
    known = uncertainty(solved)
    crossed = cross_validation_errors_of(solved, parameter_search.blocks, report_progress)
    predicted = problem.predicted(solved.values)
    errors = [
        error_model(row[channel.is_used], model[channel.is_used])
        for row, model, channel in zip(crossed, predicted, problem.channels, strict=True)
    ]
    report_progress("the prediction", 0.9)
    return IdentifiedVehicle(
        known, errors, crossed, error_bands(_fit_problem(predicted_scene, parameter_search), known, errors)
    )


def _fit_problem(scene: Any, parameter_search: ParameterSearch) -> IdentificationProblem:
    """Identification problem of a scene with the searched parameters and the compared channels."""
    full_problem = identification_problem_of(
        scene, scene.path(scene.drive.file), parameter_search.parameters, low_pass_edge=parameter_search.low_pass
    )
    channels = {channel.name: channel for channel in full_problem.channels}
    missing = next((name for name in parameter_search.channels if name not in channels), None)
    if missing:
        raise InputError(scene.drive.file, missing, None, "this channel is compared: it must be in the file")
    return replace(full_problem, channels=[channels[name] for name in parameter_search.channels])


def cross_validation_errors_of(fitted: ParameterFit, part_count: int, report_progress: Progress) -> np.ndarray:
    """Prediction less measurement (channels, n); each part of the stretch is predicted by a fit to all other parts."""
    problem, times = fitted.problem, fitted.problem.clock.times
    target = np.array([channel.values for channel in problem.channels])
    answer = np.empty_like(target)
    part_of_sample = np.minimum((part_count * np.arange(len(times))) // len(times), part_count - 1)
    starts = [
        replace(parameter, start=float(v))
        for parameter, v in zip(problem.parameters, _estimates_inside_bounds(fitted), strict=True)
    ]
    for k in range(part_count):
        report_progress(f"part {k + 1} of {part_count}, predicted from the others", 0.4 + 0.5 * k / part_count)
        problem_without_part = IdentificationProblem(
            problem.model, starts, problem.channels, problem.clock, part_of_sample != k
        )
        fit_without_part = fit(problem_without_part)
        answer[:, part_of_sample == k] = (problem.predicted(fit_without_part.values) - target)[:, part_of_sample == k]
    return answer


def _estimates_inside_bounds(fitted: ParameterFit) -> np.ndarray:
    """Estimates (p,) of a fit, moved slightly inside their bounds."""
    low, high = fitted.problem.bounds
    margin = 1e-3 * fitted.problem.scales
    return np.clip(fitted.values, low + margin, high - margin)
