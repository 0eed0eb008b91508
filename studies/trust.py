"""Time for which a force-excited run can be trusted, and the data that a longer time would require.

Each source of error is predicted before any run, from the forces and the vehicle alone, and then measured: noise by
an ensemble of paths, the error between the samples and that of a wrong inertia by a run each. With a road in its
scene the forces are a virtual measurement and the true pitch is known; with a file of wheel forces there is no truth,
and only the noise can be run against the same forces without it.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.assumptions import with_assumptions
from models.core.discretisation import sampling_error, with_sampling_error
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.strict import Strict, quantity, read
from models.core.told import Results
from models.core.whole_files import write_whole
from models.drift.growth import pitch_variance
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.statistics import STANDARD_ERRORS_95, quantile_with_interval
from models.ensemble.workers import Crew
from models.systems.pitch_plane.noise_paths import noise_paths
from models.systems.pitch_plane.run import run_with_drift
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, changed_scene
from models.systems.pitch_plane.trust import (
    UNTRUSTED_PITCH,
    GrowthCurve,
    interpolation_error_curve,
    model_error_curve,
    noise_error_curve,
    pitch_error_growth,
    rounding_error_curve,
    small_errors,
)
from models.systems.pitch_plane.virtual_measurement import (
    check_road,
    check_steps,
    follower_builder,
    measure,
    write_measurement,
)

ReportProgress = Callable[[str, float], None]
TrustRow = dict[str, Any]
ROW_SPACING = 0.1
"""Row spacing (s) of the noise paths in the figure."""
ORDER_OF_INTERPOLATION = {"held": 2, "linear": 2, "smooth": 4}
"""Order of each interpolation rule between samples: its error falls with this power of the sampling period."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    sampling_rate: float | None = quantity("Hz", "rate of the virtual measurement on a road", default=None)
    noise_fraction: float = quantity("", "standard deviation of the force noise by the largest force", default=0.002)
    inertia_error: float = Field(0.05, gt=0, lt=1, description="share by which the pitch inertia may be wrong")
    wanted: float = quantity("s", "time for which the run shall be trusted", default=60.0)
    angle: float = quantity("rad", "pitch error from which on a run is not trusted", default=UNTRUSTED_PITCH)
    paths: int = Field(100, ge=20, description="noise paths of the ensemble")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of the noise")


def run(scene: Scene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Predict the growth of errors, and measure it by an ensemble and two runs in the first engine; saves
    ``table.txt``, ``trust.nc`` and a figure, and returns the summary."""
    options = check(scene, engines)
    base, measured, largest = _scene_under_forces(scene, options, output_folder)
    deviation, assembly = options.noise_fraction * largest, assembly_of_scene(base)
    other_parameters = assembly.parameters.model_copy(update={"I": assembly.parameters.I * (1 - options.inertia_error)})
    report_progress("predictions", 0.1)
    curves = {
        "noise": noise_error_curve(assembly, deviation),
        "interpolation": interpolation_error_curve(assembly),
        "inertia": model_error_curve(assembly, other_parameters),
        "rounding": rounding_error_curve(assembly),
    }
    runs = {}
    if measured is not None:
        report_progress("runs", 0.2)
        clean = run_with_drift(base, engines[0])
        wrong = run_with_drift(
            changed_scene(base, vehicle={"override": {**base.vehicle.override, "I": other_parameters.I}}), engines[0]
        )
        runs = {
            "interpolation": _pitch_difference(clean, measured["pitch"]),
            "inertia": _pitch_difference(wrong, clean["pitch"]),
        }
    report_progress("noise paths", 0.4)
    quiet = run_with_drift(base, "reference", scene.error)
    spread = _ensemble_of_paths(base, quiet, deviation, options, engines[0], Crew.of(scene, default_workers=1))
    rows = _drift_off_rows(curves, runs, spread, options)
    table = _table_lines(rows, options, deviation, pitch_error_growth(assembly).rate, base, curves)
    write_whole(output_folder / "table.txt", "\n".join(table) + "\n")
    saved = _with_stated_errors(_result_of_paths(scene, rows, spread), quiet, spread, options)
    saved.save(output_folder / "trust.nc")
    results = {"forces without noise": quiet, "growth": saved} | ({} if measured is None else {"measurement": measured})
    report_progress("figure", 0.9)
    _figure(curves, runs, spread, options, results, output_folder / "error_growth.png")
    summary = {"scene": scene.title, "folder": str(output_folder), "rows": rows, "failed": {}, "table": table}
    return summary | {"results": results}


def check(scene: Scene, engines: tuple[str, ...]) -> Options:
    """Options of the scene; raises InputError for a scene that is neither a run on a road nor a free run under wheel
    forces."""
    options = read(Options, scene.options, scene.file, "options")
    check_steps(scene, engines)
    if "road" in scene.effects:
        if options.sampling_rate is None:
            raise InputError(scene.file, "options.sampling_rate", None, "is missing: forces measured on a road need it")
        check_road(scene, engines, options.sampling_rate)
    elif set(scene.effects) != {"wheel_forces"}:
        allowed = "this study takes a road or wheel forces alone, and names noise itself"
        raise InputError(scene.file, "effects", sorted(scene.effects), allowed)
    elif options.sampling_rate is not None:
        allowed = "the file of wheel forces has its own: drop this key"
        raise InputError(scene.file, "options.sampling_rate", options.sampling_rate, allowed)
    return options


def _scene_under_forces(
    scene: Scene, study_options: Options, output_folder: Path
) -> tuple[Scene, Result | None, float]:
    """The scene under wheel forces; the run on the road that gave the forces, None if they are from a file; and the
    largest force (N)."""
    if "road" not in scene.effects:
        return scene, None, float(np.abs(assembly_of_scene(scene).input.values).max())  # type: ignore[union-attr]
    assert study_options.sampling_rate is not None
    measured = measure(scene, scene.error)
    largest = write_measurement(measured, output_folder, 1.0 / study_options.sampling_rate)
    return follower_builder(scene, output_folder)({}, {}), measured, largest


def _pitch_difference(disturbed_run: Result, undisturbed_pitch: np.ndarray) -> GrowthCurve:
    """Magnitude of the difference between a run's pitch and the pitch (n,) in rad of a run without one source of
    error."""
    return GrowthCurve(disturbed_run.times, np.abs(disturbed_run["pitch"] - undisturbed_pitch))


def _ensemble_of_paths(
    base_scene: Scene, quiet_run: Result, noise_deviation: float, study_options: Options, engine: str, worker_crew: Crew
) -> dict[str, np.ndarray]:
    """Run the noise paths; returns their row times (rows,) in s, drift-off times (paths,) in s and pitch errors (paths,
    rows) in rad relative to the run without noise, ``quiet_run``.

    The errors are nan from where a path left all bounds.
    """
    noisy = changed_scene(
        base_scene, effects={"force_noise": {"deviation": noise_deviation, "seed": study_options.seed}}
    )
    rows = np.arange(0, len(quiet_run.times), max(1, round(ROW_SPACING / base_scene.run.step)))
    row_times, true = quiet_run.times[rows], quiet_run["pitch"]
    with worker_crew.at_work(PathBlocks().count(study_options.paths)) as pool:
        paths = run_paths(
            noise_paths(noisy, row_times, true, study_options.angle, engine), study_options.paths, executor=pool
        )
    errors = np.abs(paths["states"][:, :, 3] - true[rows])
    return {"times": row_times, "drift_off": paths["drift_off"], "errors": errors}


def _with_stated_errors(
    trust_result: Result, quiet_run: Result, drift_off_times: dict[str, np.ndarray], study_options: Options
) -> Result:
    """The result with two stated errors: the step error, estimated on the run without noise, and the standard error of
    the median drift-off time."""
    trust_result.data.attrs["error"] = quiet_run.data.attrs["error"]
    with_assumptions(trust_result, [small_errors(study_options.angle)])
    middle, low, high = quantile_with_interval(drift_off_times["drift_off"], 0.5)
    if not math.isfinite(high):
        return trust_result
    error = sampling_error((high - low) / (2.0 * STANDARD_ERRORS_95), middle, "s", study_options.paths)
    return with_sampling_error(trust_result, {"median drift-off by noise": error}, study_options.paths)


def _result_of_paths(scene: Scene, trust_rows: list[TrustRow], drift_off_times: dict[str, np.ndarray]) -> Result:
    """Result to be saved: times (s) after which each source of error takes the motion out of tolerance, and the same
    times and the pitch errors of random runs with noise."""
    drift_off = {
        name: Channel(
            "source", [np.nan if row[name] is None else row[name] for row in trust_rows], "s", f"drift-off, {name}"
        )
        for name in ("predicted", "measured")
    }
    paths = {
        "drift_off": Channel("path", drift_off_times["drift_off"], "s", "drift-off, infinite if never"),
        "error": Channel(("path", "time"), drift_off_times["errors"], "rad", "pitch error"),
    }
    axes = {"source": Channel("source", list(SOURCE_NAMES)), "time": Channel("time", drift_off_times["times"], "s")}
    return result(scene, drift_off | paths, axes)


SOURCE_NAMES = {
    "noise": "noise on the samples",
    "interpolation": "interpolation between them",
    "inertia": "a wrong inertia",
    "rounding": "rounding",
}


def _drift_off_rows(
    predicted_curves: dict[str, GrowthCurve],
    measured_curves: dict[str, GrowthCurve],
    path_results: dict[str, np.ndarray],
    study_options: Options,
) -> list[TrustRow]:
    """Predicted and measured drift-off times (s) for each source of error; None if they lie beyond the run."""
    rows = list[TrustRow]()
    for name, curve in predicted_curves.items():
        measured, quartiles = (
            measured_curves[name].passing_time(study_options.angle) if name in measured_curves else None,
            None,
        )
        if name == "noise":
            drift_off_times = [
                quantile_with_interval(path_results["drift_off"], level)[0] for level in (0.5, 0.25, 0.75)
            ]
            measured, *quartiles = [time if math.isfinite(time) else None for time in drift_off_times]
        rows.append(
            {
                "source": name,
                "predicted": curve.passing_time(study_options.angle),
                "measured": measured,
                "quartiles": quartiles,
            }
        )
    return rows


def _table_lines(
    trust_rows: list[TrustRow],
    study_options: Options,
    noise_deviation: float,
    growth_rate: float,
    base_scene: Scene,
    predicted_curves: dict[str, GrowthCurve],
) -> list[str]:
    """Lines for the screen: predicted and measured drift-off times, and the requirements of a longer trustworthy
    run."""
    lines = [
        f"  pitch {study_options.angle:g} rad off after [s]     predicted   measured",
        *(
            f"  {SOURCE_NAMES[row['source']]:<28} {_drift_off_text(row['predicted']):>14} "
            f"{_measured_drift_off_text(row):>10}"
            for row in trust_rows
        ),
    ]
    limits = [row["predicted"] for row in trust_rows if row["predicted"] is not None]
    until = f"until about {min(limits):.3g} s" if limits else "to its end"
    lines.append(
        f"  trusted {until}; a tilt error grows by e in {1 / growth_rate:.2g} s (growth rate {growth_rate:.3g} 1/s)"
        if growth_rate
        else f"  trusted {until}; a tilt error does not grow exponentially"
    )
    return lines + _remedy_lines(study_options, noise_deviation, growth_rate, base_scene, predicted_curves)


def _drift_off_text(drift_off_time: float | None) -> str:
    return "beyond the run" if drift_off_time is None else f"{drift_off_time:.2f}"


def _measured_drift_off_text(trust_row: TrustRow) -> str:
    if trust_row["source"] == "rounding":
        return "-"
    if trust_row["quartiles"]:
        ends = " to ".join(_drift_off_text(time) for time in trust_row["quartiles"])
        return f"{_drift_off_text(trust_row['measured']):>10}   (median; half of all paths {ends})"
    return _drift_off_text(trust_row["measured"])


def _remedy_lines(
    study_options: Options,
    noise_deviation: float,
    growth_rate: float,
    base_scene: Scene,
    predicted_curves: dict[str, GrowthCurve],
) -> list[str]:
    """Lines for the screen on the noise, sampling rate and accuracy of the inertia that a trustworthy run of the wanted
    length would require, extrapolated by the growth rate of errors."""
    forces = assembly_of_scene(base_scene).input
    assert forces is not None and forces.period is not None
    lines = [f"  for {study_options.wanted:g} s it would take:"]
    for name in ("noise", "interpolation", "inertia"):
        excess = _error_at_wanted_time(predicted_curves[name], study_options, growth_rate)
        order = ORDER_OF_INTERPOLATION[base_scene.effects["wheel_forces"].interpolation]
        takes = {
            "noise": f"noise of {noise_deviation / excess:.2g} N instead of {noise_deviation:.3g} N on each sample",
            "interpolation": f"samples at {excess ** (1 / order) / forces.period:.3g} Hz instead of "
            f"{1 / forces.period:g} Hz",
            "inertia": f"an inertia known to {100 * study_options.inertia_error / excess:.2g} % instead of "
            f"{100 * study_options.inertia_error:g} %",
        }
        lines.append(f"    {takes[name]}" if excess > 1 else f"    nothing against {SOURCE_NAMES[name]}")
    return [*lines, "  or a stabiliser: see the effects prescribed_pitch, pitch_spring, kalman_filter"]


def _error_at_wanted_time(predicted_curve: GrowthCurve, study_options: Options, growth_rate: float) -> float:
    """Ratio of the pitch error at the wanted time to the allowed angle; beyond drift-off or the end of the run it is
    extrapolated by the growth law of noise.

    Its deviation grows as t^1.5 at first and exponentially where the rate has had its time: what follows the run is
    taken for as rough as the run.
    """
    time = predicted_curve.passing_time(study_options.angle)
    start = min(study_options.wanted, predicted_curve.times[-1] if time is None else time)
    size = float(predicted_curve.size[: np.searchsorted(predicted_curve.times, start) + 1].max())
    longer = pitch_variance(study_options.wanted, growth_rate, 1.0) / pitch_variance(start, growth_rate, 1.0)
    return size / study_options.angle * math.sqrt(float(longer))


def _figure(
    predicted_curves: dict[str, GrowthCurve],
    measured_curves: dict[str, GrowthCurve],
    drift_off_times: dict[str, np.ndarray],
    study_options: Options,
    shown_results: Results,
    figure_path: Path,
) -> None:
    """Save a figure of the growth of the pitch error by source of error on a logarithmic scale: predictions dashed,
    runs solid."""
    from models.drawing.figures import BLUE, COLUMN_WIDTH, DARK, GREEN, GREY, VERMILION, add_heading, save, subplots

    colours = {"noise": BLUE, "interpolation": VERMILION, "inertia": GREEN, "rounding": GREY}
    figure, axis = subplots(figsize=(COLUMN_WIDTH, 4.8))
    axis.semilogy(drift_off_times["times"], drift_off_times["errors"][:20].T, color=BLUE, alpha=0.15, linewidth=0.6)
    middle = np.median(drift_off_times["errors"], axis=0)
    axis.semilogy(drift_off_times["times"], middle, color=BLUE, label="noise: median of the paths (20 of them thin)")
    for name, curve in measured_curves.items():
        axis.semilogy(curve.times[::50], curve.size[::50], color=colours[name], linewidth=0.9, label=f"{name}: run")
    for name, curve in predicted_curves.items():
        small = np.where(np.maximum.accumulate(curve.size) < 1.0, curve.size, np.nan)  # no law holds for a tumbling run
        axis.semilogy(
            curve.times[::50], small[::50], "--", color=colours[name], linewidth=1.5, label=f"{name}: predicted"
        )
    axis.axhline(study_options.angle, color=DARK, linewidth=0.8, label=f"not trusted above {study_options.angle:g} rad")
    axis.set(
        xlabel="time [s]", ylabel="pitch error [rad]", ylim=(1e-12, 10), xlim=(0, predicted_curves["noise"].times[-1])
    )
    figure.legend(loc="outside lower center", ncols=3)
    add_heading(
        figure, "How long a force-excited run can be trusted: growth of its pitch error by source", shown_results
    )
    save(figure, figure_path)


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("trust")
