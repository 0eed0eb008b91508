"""``twinrig identify``: estimates of a scene's keys from a measurement, with standard errors and their determinacy."""

import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.whole_files import write_whole
from models.ensemble.runner import values_in_order
from models.ensemble.store import BlockStore, named_files
from models.ensemble.workers import Crew, folders_for_workers
from models.identification.fit import ParameterFit, fit
from models.identification.of_scene import identification_problem_of
from models.identification.problem import IdentificationProblem
from models.identification.uncertainty import LikelihoodProfile, Uncertainty, likelihood_profile, uncertainty
from models.measured.time_shift import ChannelPair, time_shift

STAGES_FOLDER = "stages"
"""Name of the folder of finished stages, from which ``--resume`` continues."""
LEAST_NAMED_COMPONENT = 0.3
"""Least component of a unit vector of a parameter combination for which the parameter is named."""
SHIFT_IMPROVEMENT = 2.0
"""Factor by which a time shift must reduce the difference of run and measurement for it to be reported."""
ReportProgress = Callable[[str, float], None]


def identify(
    scene: Any,
    measurement_path: str | Path,
    scene_keys: Sequence[str],
    *,
    engine: str = "",
    low_pass: float = 0.0,
    stages_folder: Path | None = None,
    report_progress: ReportProgress = lambda text, share: None,
) -> Uncertainty:
    """Estimates of a scene's keys from a measurement, with their uncertainty; the run must have channels over time.

    scene : as ``load_scene`` gives it; measurement_path : its channels have the names of the run's; scene_keys : KEY or
    KEY=LOW:HIGH; engine : "" for the usual one; low_pass : Hz, on both, 0 for none; stages_folder : keeps finished
    stages. The scene's crew computes the columns of Jacobians. Raises InputError and RunFailed.
    """
    problem = identification_problem_of(scene, measurement_path, scene_keys, engine, low_pass)
    with Crew.of(scene, default_workers=1).at_work(1 + len(problem.parameters), *folders_for_workers(scene)) as pool:
        if stages_folder is None:
            return uncertainty(fit(problem, None, report_progress, executor=pool), pool)
        store = BlockStore(stages_folder / STAGES_FOLDER)
        with store.reserved_folder(_facts_of_stages(scene, measurement_path, problem, engine, low_pass)):
            return uncertainty(fit(problem, store, report_progress, executor=pool), pool)


def likelihood_profiles_of(
    scene: Any,
    uncertainty: Uncertainty,
    with_all_profiles: bool = False,
    report_progress: ReportProgress = lambda text, share: None,
) -> Iterator[LikelihoodProfile]:
    """Yield the likelihood profiles of all parameters, or only of those that the data do not determine; the scene's
    workers compute them."""
    wanted = [
        k
        for k in range(len(uncertainty.fit.problem.parameters))
        if with_all_profiles or not uncertainty.is_determined[k]
    ]
    with Crew.of(scene, default_workers=1).at_work(len(wanted), *folders_for_workers(scene)) as pool:
        for completed, (k, drawn_profile) in enumerate(
            values_in_order(partial(likelihood_profile, uncertainty), iter(wanted), pool), start=1
        ):
            report_progress(
                f"profile of {uncertainty.fit.problem.parameters[k].name}", 0.9 + 0.1 * completed / len(wanted)
            )
            yield drawn_profile


def _facts_of_stages(
    scene: Any, measurement_path: str | Path, fit_problem: IdentificationProblem, engine: str, low_pass_frequency: float
) -> dict[str, Any]:
    """Inputs on which the saved stages of an identification depend; if one of them changes, the stages are computed
    anew."""
    table = scene.table()
    return {
        "scene": table,
        "files": named_files([table, str(measurement_path)], Path(scene.folder)),
        "measurement": str(measurement_path),
        "parameters": [
            [parameter.name, parameter.start, parameter.lower_bound, parameter.upper_bound]
            for parameter in fit_problem.parameters
        ],
        "engine": engine,
        "low pass": low_pass_frequency,
    }


def report(
    scene: Any,
    measurement_path: Path,
    scene_keys: Sequence[str],
    output_folder: Path,
    report_progress: ReportProgress,
    with_all_profiles: bool,
    **identify_options: Any,
) -> dict[str, Any]:
    """Identify parameters; saves ``identify.json`` and ``identify.png``, and returns the summary. with_all_profiles :
    likelihood profiles of all parameters, not only of undetermined ones."""
    known = identify(
        scene,
        measurement_path,
        scene_keys,
        stages_folder=output_folder,
        report_progress=report_progress,
        **identify_options,
    )
    drawn = list(likelihood_profiles_of(scene, known, with_all_profiles, report_progress))
    answer = identification_as_dict(known, drawn)
    write_whole(output_folder / "identify.json", json.dumps(answer, indent=1) + "\n")
    draw_fit(known, f"{measurement_path.name} by {scene.title}", output_folder / "identify.png")
    return {
        "scene": f"{scene.title}, identified from {measurement_path}",
        "folder": str(output_folder),
        "failed": {},
        "identified": answer,
        "table": identification_lines(known, drawn),
        "results": {},
    }


def identification_as_dict(uncertainty: Uncertainty, profiles: Sequence[LikelihoodProfile] = ()) -> dict[str, Any]:
    """Estimates, uncertainty and likelihood profiles as plain values for JSON; None for a missing standard error."""
    solved, names = uncertainty.fit, [parameter.name for parameter in uncertainty.fit.problem.parameters]
    return {
        "estimates": {
            name: {
                "value": float(value),
                "standard error": _finite_number(error),
                "determined": bool(sure),
                "at a bound": bool(is_at_bound),
            }
            for name, value, error, sure, is_at_bound in zip(
                names, solved.values, uncertainty.deviations, uncertainty.is_determined, solved.is_at_bound, strict=True
            )
        },
        "correlation": {"of": names, "rows": estimate_correlation(uncertainty).tolist()},
        "combinations": [
            {"standard error": error, "direction": dict(zip(names, vector.tolist(), strict=True))}
            for error, vector in uncertainty.combinations()
        ],
        "condition": _finite_number(uncertainty.condition),
        "residuals stay alike for [s]": uncertainty.correlation_time,
        "errors of channels": relative_errors(solved),
        "samples left out": {channel.name: channel.left_out for channel in solved.problem.channels},
        "converged": solved.converged,
        "profiles": {
            parameter.name: {
                "values": parameter.values.tolist(),
                "rise": parameter.misfit_rise.tolist(),
                "quadratic": parameter.is_quadratic,
            }
            for parameter in profiles
        },
    }


def estimate_correlation(uncertainty: Uncertainty) -> np.ndarray:
    """Correlation matrix (p, p) of the parameter estimates; 0 for estimates at a bound."""
    size = np.sqrt(np.clip(np.diag(uncertainty.covariance), 0.0, None))
    outer = np.outer(size, size)
    return np.divide(uncertainty.covariance, outer, out=np.zeros_like(outer), where=outer > 0.0)


def _finite_number(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None


def relative_errors(parameter_fit: ParameterFit) -> dict[str, float]:
    """For each channel, ratio of the rms error of the fitted model to the rms of the measured channel."""
    weights = parameter_fit.problem.weights > 0.0
    return {
        channel.name: float(np.sqrt(np.mean(row[used] ** 2)))
        for channel, row, used in zip(parameter_fit.problem.channels, parameter_fit.residuals, weights, strict=True)
    }


def identification_lines(uncertainty: Uncertainty, profiles: Sequence[LikelihoodProfile] = ()) -> list[str]:
    """Lines for the screen on the estimates, their uncertainty, and the fit of the channels."""
    solved = uncertainty.fit
    table = [f"  {'parameter':<32}{'estimate':>13}{'standard error':>16}"]
    for k, parameter in enumerate(solved.problem.parameters):
        error = "at its bound" if solved.is_at_bound[k] else f"{uncertainty.deviations[k]:.3g}"
        doubt = "" if uncertainty.is_determined[k] else "  not determined by the data"
        table.append(f"  {parameter.name:<32}{solved.values[k]:>13.6g}{error:>16}{doubt}")
    table += [
        f"  error of {name:<23}{100.0 * value:>12.3g} % of its rms" for name, value in relative_errors(solved).items()
    ]
    table += _combination_lines(uncertainty)
    table.append(
        f"  residuals stay alike for {uncertainty.correlation_time:.3g} s; "
        "standard errors count them so, not as independent samples"
    )
    left = {channel.name: channel.left_out for channel in solved.problem.channels}
    table.append("  left out as spikes or not measured: " + ", ".join(f"{n} of {name}" for name, n in left.items()))
    if not solved.converged:
        table.append("  the search has not settled: resume it, or start nearer")
    if late := clock_delay(uncertainty):
        table.append(
            f"  DOUBT: the measurement's clock seems {late:.4g} s later than the run's: take that off its times"
        )
    for curve in profiles:
        shape = "as the standard error says" if curve.is_quadratic else "not as the standard error says"
        curve_text = ", ".join(f"{r:.3g} at {v:.4g}" for v, r in zip(curve.values, curve.misfit_rise, strict=True))
        table.append(f"  profile of {curve.name}: {curve_text} (95 % below 3.84), {shape}")
    return table


def clock_delay(uncertainty: Uncertainty) -> float:
    """Delay (s) of the measurement's clock relative to the model; 0 unless a shift by it makes the difference
    ``SHIFT_IMPROVEMENT`` times smaller.

    The model is that of the start: estimates take up a part of the delay.
    """
    problem, clock_times = uncertainty.fit.problem, uncertainty.fit.problem.clock.times
    measured = [np.where(channel.is_used, channel.values, np.nan) for channel in problem.channels]
    start = np.array([parameter.start for parameter in problem.parameters])
    pairs = [
        ChannelPair(clock_times, row, clock_times, values)
        for row, values in zip(problem.predicted(start), measured, strict=True)
    ]
    shift = time_shift(pairs).seconds
    return (
        shift
        if _mean_channel_difference(pairs, shift) * SHIFT_IMPROVEMENT < _mean_channel_difference(pairs, 0.0)
        else 0.0
    )


def _mean_channel_difference(channel_pairs: Sequence[ChannelPair], time_shift_seconds: float) -> float:
    """Mean over channels of the rms difference of run and measurement divided by the measurement's standard deviation,
    with the measurement shifted earlier by a time (s)."""
    shares = []
    for pair in channel_pairs:
        shifted_times = pair.measured_times - time_shift_seconds
        is_within = (
            np.isfinite(pair.measured_values)
            & (shifted_times >= pair.run_times[0])
            & (shifted_times <= pair.run_times[-1])
        )
        gap = np.interp(shifted_times[is_within], pair.run_times, pair.run_values) - pair.measured_values[is_within]
        shares.append(float(np.sqrt(np.mean(gap**2))) / (float(np.nanstd(pair.measured_values)) or 1.0))
    return float(np.mean(shares))


def _combination_lines(uncertainty: Uncertainty) -> list[str]:
    combinations = uncertainty.combinations()
    if not combinations:
        return []
    names = [parameter.name for parameter in uncertainty.fit.problem.parameters]

    def vector_text(combination: np.ndarray) -> str:
        order = np.argsort(-np.abs(combination))
        return " ".join(
            f"{combination[k]:+.2f} {names[k]}" for k in order if abs(combination[k]) >= LEAST_NAMED_COMPONENT
        )

    (best, first_direction), (worst, last_direction) = combinations[0], combinations[-1]
    return [
        f"  best determined, within {100.0 * best:.2g} %: {vector_text(first_direction)}",
        f"  worst determined, within {100.0 * worst:.2g} %: {vector_text(last_direction)}",
        f"  condition of the information: {uncertainty.condition:.3g}",
    ]


def draw_fit(uncertainty: Uncertainty, title: str, figure_path: Path) -> None:
    """Save a figure of every measured channel with the fitted model, and below it their difference."""
    from models.drawing.figures import BLUE, DARK, VERMILION, add_heading, save, subplots

    problem = uncertainty.fit.problem
    predicted, clock_times = problem.predicted(uncertainty.fit.values), problem.clock.times
    count = len(problem.channels)
    figure, axes = subplots(2 * count, 1, figsize=(8.0, 2.6 * count + 0.8), sharex=True, squeeze=False)
    for (top, error_axis), channel, row in zip(axes[:, 0].reshape(count, 2), problem.channels, predicted, strict=True):
        measured = np.where(channel.is_used, channel.values, np.nan)
        top.plot(clock_times, measured, color=DARK, linewidth=1.2, label="measured")
        top.plot(clock_times, row, color=VERMILION, linewidth=0.8, label="model")
        top.set(title=channel.name, ylabel=f"[{channel.unit or '-'}]")
        error_axis.plot(clock_times, row - measured, color=BLUE, linewidth=0.8)
        error_axis.set(ylabel=f"model less\nmeasured [{channel.unit or '-'}]")
    axes[-1, 0].set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    add_heading(figure, title, {})
    save(figure, figure_path)
