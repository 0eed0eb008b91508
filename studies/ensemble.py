"""Effect of force noise on a vehicle's run: thousands of noise paths, their drift-off times and their scatter.

A virtual measurement on a road gives wheel forces; every path is driven by them with its own white noise. Finished
blocks of paths are kept in the folder ``blocks``, so that ``twinrig run ensemble --resume FOLDER`` goes on with a run
that was killed, to the same bits. Each other engine repeats the first paths on the same noise samples.
"""

import json
import math
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pydantic import Field

from models.core.assumptions import Watched, with_assumptions
from models.core.discretisation import sampling_error, with_sampling_error
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.steps import step_divides
from models.core.strict import Strict, quantity, read
from models.core.told import Results
from models.core.whole_files import write_whole
from models.engines.catalogue import CATALOGUE
from models.ensemble.runner import PATHS_PER_BLOCK, PathBlocks, arrays_by_block, run_paths
from models.ensemble.runner import EnsembleProgress as Done
from models.ensemble.workers import Crew
from models.systems.pitch_plane.assumptions import upright_assumption
from models.systems.pitch_plane.noise_paths import largest_difference, mujoco_threads, noise_paths
from models.systems.pitch_plane.path_statistics import PITCH_STATE_INDEX, PathStatistics
from models.systems.pitch_plane.run import run_with_drift
from models.systems.pitch_plane.scene import Scene
from models.systems.pitch_plane.virtual_measurement import check_road, follower_builder, measure, write_measurement
from models.vehicles.pitch_plane import STATE_NAMES

ReportProgress = Callable[[str, float], None]

BLOCKS_FOLDER = "blocks"
"""Name of the folder of finished blocks in the results' folder; a study with this constant can be resumed."""
PITCH_QUANTILES = (0.05, 0.5, 0.95)
HEAVE_STATE_INDEX = 2
"""Index of the heave in the state."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    paths: int = Field(500, ge=2, le=1_000_000, description="number of noise paths in the reference")
    saved: int = Field(1000, ge=1, le=1_000_000, description="first paths that are saved; statistics are of all")
    engine_paths: int = Field(4, ge=1, le=10_000, description="number of the first paths that other engines repeat")
    block: int = Field(PATHS_PER_BLOCK, ge=1, le=100_000, description="paths that are computed, sent and kept together")
    seed: int = Field(1, ge=0, lt=2**64, description="seed of the noise")
    rows: float = quantity("s", "spacing of the saved states", default=0.5)
    times: list[float] = Field([1.0, 2.0, 5.0, 10.0, 15.0], description="times (s) of the table, on saved rows")
    threshold: float = quantity("rad", "pitch error at which a path has drifted off", default=0.05)
    sampling_rate: float = quantity("Hz", "rate at which forces are measured", default=1000.0)
    noise_fraction: float = quantity("", "standard deviation of the noise by the largest force", default=0.002)


def check(scene: Scene, engines: tuple[str, ...]) -> Options:
    """Options of the scene; raises InputError if the study cannot compute the scene with them."""
    options = read(Options, scene.options, scene.file, "options")
    check_road(scene, engines, options.sampling_rate)
    for engine in {"reference", *engines}:
        settings = scene.settings(engine)
        if CATALOGUE[engine][str(settings.integrator)].adaptive or settings.step != scene.run.step:
            allowed = "an ensemble compares states at run.step: name no adaptive integrator and no other step"
            raise InputError(scene.file, f"engines.{engine}", None, allowed)
    if not (step_divides(scene.run.step, options.rows) and step_divides(options.rows, scene.run.duration)):
        allowed = f"must be a multiple of run.step = {scene.run.step:g} s and divide run.duration"
        raise InputError(scene.file, "options.rows", options.rows, allowed)
    for time in options.times:
        if not 0 < time <= scene.run.duration or not step_divides(options.rows, time):
            allowed = f"each must be a multiple of options.rows = {options.rows:g} s within the run"
            raise InputError(scene.file, "options.times", time, allowed)
    return options


def run(scene: Scene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Run all noise paths in the reference, and the first paths in the other engines; saves ``ensemble.nc``, a table
    and a figure, and returns the summary."""
    options = check(scene, engines)
    measured, period = measure(scene, scene.error), 1.0 / options.sampling_rate
    row_times = options.rows * np.arange(round(scene.run.duration / options.rows) + 1)
    true = measured.states[np.rint(row_times / scene.run.step).astype(int)]
    statistics = PathStatistics(true, max(options.saved, options.engine_paths))

    def tell(ensemble_progress: Done) -> None:
        report_progress(f"reference: {ensemble_progress}", ensemble_progress.done / ensemble_progress.paths)

    crew, cut = Crew.of(scene), PathBlocks(options.block)
    with TemporaryDirectory() as name, crew.at_work(cut.count(options.paths)) as pool:
        largest = write_measurement(measured, Path(name), period)
        noise = {"deviation": options.noise_fraction * largest, "seed": options.seed}
        noisy = follower_builder(scene, Path(name))({}, {"force_noise": noise})
        first = run_with_drift(noisy, "reference", scene.error)
        path_arguments = (noisy, row_times, measured["pitch"], options.threshold)
        for block in arrays_by_block(
            noise_paths(*path_arguments), options.paths, output_folder / BLOCKS_FOLDER, pool, cut, tell
        ):
            statistics.add(block)
        gaps = {}
        for engine in (engine for engine in engines if engine != "reference"):
            report_progress(f"{engine}: {options.engine_paths} of the same paths", 1.0)
            if engine == "mujoco":
                repeated = run_paths(mujoco_threads(*path_arguments, crew.workers), options.engine_paths)
            else:
                repeated = run_paths(
                    noise_paths(*path_arguments, engine), options.engine_paths, executor=pool, path_blocks=PathBlocks(1)
                )
            gaps[engine] = largest_difference(statistics.first, repeated, row_times)
    write_measurement(measured, output_folder, period)
    rows = _deviation_rows(options, row_times, statistics)
    channels, axes = _result_channels(row_times, statistics, options.saved)
    saved = result(noisy, channels, axes, engine="reference", threshold=options.threshold)
    _with_stated_errors(saved, first, rows, options, statistics).save(output_folder / "ensemble.nc")
    table = summary_lines(options, scene, rows, statistics, gaps)
    write_whole(output_folder / "table.txt", "\n".join(table) + "\n")
    results = {"measurement": measured, "all paths": saved}
    _figure(row_times, statistics, options, results, output_folder)
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "results": results,
        "paths": options.paths,
        "rows": rows,
        "gaps": {engine: None if math.isnan(worst) else worst for engine, worst in gaps.items()},
        "failed": {},
        "table": table,
    }


def _result_channels(
    times: np.ndarray, path_statistics: PathStatistics, saved_paths: int
) -> tuple[dict[str, Channel], dict[str, Channel]]:
    """Channels and axes of the saved result: the first paths, and statistics over all paths."""
    paths = {name: values[:saved_paths] for name, values in path_statistics.first.items()}
    units, names = "m, rad, m/s, rad/s", list(STATE_NAMES)
    channels = {
        "states": Channel(("path", "time", "state"), paths["states"], units),
        "drift_off": Channel("path", paths["drift_off"], "s", "drift-off, infinite if never"),
        "failed": Channel("path", paths["failed"], "s", "last good time of a path that failed"),
        "mean_error": Channel(
            ("time", "state"), path_statistics.covariance.mean, units, "mean of all paths less the true one"
        ),
        "covariance": Channel(
            ("time", "state", "other_state"), path_statistics.covariance.covariance, units, "of all paths"
        ),
        "drift_offs": Channel(
            "drift_off_time", path_statistics.drift_off.counts, "-", "number of all paths that drifted off"
        ),
    }
    axes = {
        "time": Channel("time", times, "s"),
        "state": Channel("state", names),
        "other_state": Channel("other_state", names),
        "drift_off_time": Channel("drift_off_time", path_statistics.drift_off.values, "s"),
    }
    return channels, axes


def _with_stated_errors(
    ensemble_result: Result,
    first_path: Result,
    deviation_rows: list[dict[str, float]],
    study_options: Options,
    path_statistics: PathStatistics,
) -> Result:
    """The ensemble's result with two stated errors: the step error, estimated on the first path, and the standard
    errors of the standard deviations."""
    error = json.loads(first_path.data.attrs["error"])
    ensemble_result.data.attrs["error"] = json.dumps(
        error | ({"how": f"{error['how']}, of the first path"} if error else {})
    )
    worst = {
        name: sampling_error(row[f"{name} error"], row[name], unit, study_options.paths)
        for name, unit in (("pitch", "rad"), ("heave", "m"))
        for row in [max(deviation_rows, key=lambda row: row[f"{name} error"] / (row[name] or 1.0))]
    }
    assumed = [
        upright_assumption(
            "end the runs before, or hold their pitch (kalman_filter)", lambda run: _largest_pitch(path_statistics)
        )
    ]
    return with_sampling_error(
        with_assumptions(ensemble_result, assumed),
        {f"deviation of {name}": breach for name, breach in worst.items()},
        study_options.paths,
    )


def _largest_pitch(path_statistics: PathStatistics) -> Watched:
    """Largest pitch (rad) over all paths at each time, for the check of an assumption; NaN where no path remains."""
    return {"any path": path_statistics.steepest}


def _deviation_rows(
    study_options: Options, times: np.ndarray, path_statistics: PathStatistics
) -> list[dict[str, float]]:
    """Standard deviations of pitch (rad) and heave (m), with standard errors, at the times (s) that the options
    list."""
    names, rows = ("time", "pitch", "pitch error", "heave", "heave error"), []
    for time in study_options.times:
        row = round(time / study_options.rows)
        pitch, heave = (
            path_statistics.moments.deviation(row, state) for state in (PITCH_STATE_INDEX, HEAVE_STATE_INDEX)
        )
        figures = (float(times[row]), *pitch, *heave)
        rows.append(dict(zip(names, figures, strict=True)))
    return rows


def summary_lines(
    study_options: Options,
    scene: Scene,
    deviation_rows: list[dict[str, float]],
    path_statistics: PathStatistics,
    engine_differences: dict[str, float],
) -> list[str]:
    """Lines for the screen: standard deviations over time, quantiles of the drift-off time, and differences of
    engines."""
    lines = [
        f"  {study_options.paths} paths of {scene.run.duration:g} s, forces at {study_options.sampling_rate:g} Hz, "
        f"noise {100 * study_options.noise_fraction:g} % of the largest force",
        "  time [s]   sd of pitch [rad]         sd of heave [m]",
    ]
    lines += [
        f"  {row['time']:8g}   {row['pitch']:.3e} +- {row['pitch error']:.0e}   "
        f"{row['heave']:.3e} +- {row['heave error']:.0e}"
        for row in deviation_rows
    ]
    lines.append(f"  Drift-off ({study_options.threshold:g} rad), quantiles with their 95 % intervals [s]")
    for level in PITCH_QUANTILES:
        value, low, high = path_statistics.drift_off.quantile(level)
        lines.append(f"  {100 * level:7g} %   {_time_text(value)}   ({_time_text(low)} to {_time_text(high)})")
    lines += (
        [f"  {path_statistics.lost} paths left all bounds and count as drifted off by then"]
        if path_statistics.lost
        else []
    )
    for engine, worst in engine_differences.items():
        differ = (
            f"{study_options.engine_paths} of these paths differ by at most {worst:.0e} of the largest state "
            "before drift-off"
        )
        not_compared = "not compared, as every path drifts off before the first saved row"
        lines.append(f"  {engine}: {not_compared if math.isnan(worst) else differ}")
    return lines


def _time_text(drift_off_time: float) -> str:
    return f"{drift_off_time:.2f}" if np.isfinite(drift_off_time) else "never"


def _figure(
    times: np.ndarray,
    path_statistics: PathStatistics,
    study_options: Options,
    shown_results: Results,
    output_folder: Path,
) -> None:
    """Save a figure of percentiles of the pitch error over time, and of a histogram of the drift-off times."""

    from models.drawing.drift import draw_quantile_bands
    from models.drawing.figures import BLUE, COLUMN_WIDTH, DARK, add_heading, save, subplots

    figure, (fan, histogram) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8), width_ratios=(3, 2))
    draw_quantile_bands(fan, times[1:], path_statistics.pitch_error_percentiles[:, 1:])
    fan.axhline(
        study_options.threshold,
        color=DARK,
        linestyle="--",
        linewidth=0.8,
        label=f"drift-off, {study_options.threshold:g} rad",
    )
    fan.legend(loc="lower right")
    has_drifted = np.isfinite(path_statistics.drift_off.values)
    drifted, counts = path_statistics.drift_off.values[has_drifted], path_statistics.drift_off.counts[has_drifted]
    histogram.hist(drifted, bins=40, weights=counts, color=BLUE, alpha=0.6)
    for level, style in zip(PITCH_QUANTILES, (":", "-", ":"), strict=True):
        value = path_statistics.drift_off.quantile(level)[0]
        if np.isfinite(value):
            histogram.axvline(value, color=DARK, linestyle=style, label=f"{100 * level:g} %: {value:.1f} s")
    histogram.set_title(f"Drift-offs: paths [-] ({study_options.paths - counts.sum()} never)")
    if len(drifted):
        histogram.legend()
    for axes in (fan, histogram):
        axes.set_xlabel("time [s]")
    title = f"{study_options.paths} noise paths of one measured run, forces at {study_options.sampling_rate:g} Hz"
    add_heading(figure, title, shown_results)
    save(figure, output_folder / "ensemble.png")


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("ensemble")
