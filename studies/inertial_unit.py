"""Required grade of an inertial unit: from the drift of a gyro to the error in the damage of a component.

The pitch that a gyro gives errs by its random walk and by its wandering bias, as effects ``gyro`` and
``gyro_bias`` have them. What such an angle does to the damage is in models/drift/angle_damage.py (shown by a guided run
in the validation case ``inertial_unit``): an hour needs no second simulation.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from scipy.interpolate import CubicSpline

from models.core.assumptions import Assumption, with_assumptions
from models.core.discretisation import sampling_error, with_sampling_error
from models.core.errors import InputError, RunFailed
from models.core.result import Channel, Result
from models.core.result import result as labelled
from models.core.strict import Strict, quantity, read
from models.core.told import Results
from models.core.whole_files import write_whole
from models.drift.angle_damage import UnitErrorPaths, damage_errors, log_damage_over_pitch_error, unit_angle_error_paths
from models.drift.score import SECTION_FORCE_CHANNELS
from models.ensemble.statistics import STANDARD_ERRORS_95, quantile_with_interval
from models.fatigue.damage import WOEHLER_SLOPE
from models.sensors.inertial_unit import DEGREES_PER_HOUR, DEGREES_PER_ROOT_HOUR, angle_variance
from models.systems.pitch_plane.assumptions import watch_function
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene

ReportProgress = Callable[[str, float], None]
PositiveNumber = Annotated[float, Field(gt=0)]
Minutes = Annotated[float, Field(ge=0.1, le=600)]

SUFFICIENT_SHARE = 0.9
"""Share of the units of a grade whose damage error must be within the allowed error."""
LARGEST_ANGLE_ERROR = 0.5
"""Largest angle error (rad) for which the study is valid; it exceeds any tilt of a vehicle on a road."""
SAVED_SPACING = 0.01
"""Row spacing (s) of the saved runs."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    grades: list[PositiveNumber] = Field(
        [0.001, 0.01, 0.1, 1.0, 10.0],
        min_length=1,
        description="standard deviation of the wandering bias, deg/h, rising",
    )
    random_walks: list[PositiveNumber] = Field(
        [0.0005, 0.002, 0.02, 0.1, 0.5], min_length=1, description="random walk of each grade, deg/sqrt(h)"
    )
    durations: list[Minutes] = Field(
        [1.0, 5.0, 10.0, 60.0], min_length=1, description="lengths of a drive, min, rising, to a second"
    )
    correlation_time: float = quantity("s", "time in which the bias forgets itself", default=3600.0)
    allowed_damage_error: float = quantity("", "largest error of the damage that is good enough", default=0.05)
    sampling_rate: int = Field(100, ge=1, le=1000, description="samples of the gyro in a second")
    samples: int = Field(200, ge=10, le=10_000, description="units of each grade")
    seed: int = Field(1, ge=0, lt=2**64, description="seed of noise and bias")


def check(scene: Scene, engines: tuple[str, ...]) -> Options:
    """Options of the scene; raises InputError for a scene without a road and for lists that do not fit each other."""
    options = read(Options, scene.options, scene.file, "options")
    if "road" not in scene.effects:
        raise InputError(scene.file, "effects.road", None, "is missing: this study needs a run on a road")
    if len(options.grades) != len(options.random_walks):
        allowed = f"must have one value for each of the {len(options.grades)} grades"
        raise InputError(scene.file, "options.random_walks", options.random_walks, allowed)
    for name in ("grades", "durations"):
        values = getattr(options, name)
        if (np.diff(values) <= 0).any():
            raise InputError(scene.file, f"options.{name}", values, "must rise from each value to the next one")
    return options


def run(scene: Scene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Run the vehicle on the road in each engine, and compute angle and damage errors of all gyro grades; saves runs, a
    table and two figures, and returns the summary."""
    options = check(scene, engines)
    report_progress("angle errors", 0.0)
    length = round(60 * options.durations[-1])
    paths = unit_angle_error_paths(
        options.samples, options.sampling_rate, length, options.correlation_time, options.seed
    )
    largest = max(float(np.abs(angle_errors(paths, options, i)).max()) for i in range(len(options.grades)))
    reach = min(largest, np.pi / 2)  # beyond a quarter turn no pitch is left to speak of
    curves: dict[str, CubicSpline] = {}
    results: dict[str, Result] = {}
    failed: dict[str, str] = {}
    for i, engine in enumerate(engines):
        report_progress(f"{engine}: run and damage", (i + 0.5) / (len(engines) + 1))
        try:
            result = simulate(scene, engine, error=scene.error)
        except RunFailed as error:
            failed[engine] = str(error)
            continue
        result.every(SAVED_SPACING).save(output_folder / f"{engine}.nc")
        results[engine] = result
        curves[engine] = log_damage_over_pitch_error(result, reach, scene.file)
    pairs = [(grade, minutes) for grade in range(len(options.grades)) for minutes in options.durations]
    rows = [
        _row_of_grade(options, grade, minutes, angle_errors(paths, options, grade), curves) for grade, minutes in pairs
    ]
    table = summary_lines(rows, options, tuple(curves))
    write_whole(output_folder / "table.txt", "\n".join(table) + "\n")
    if curves:
        from models.drawing.figures import save

        results["units"] = _errors_of_grades(scene, paths, options, next(iter(curves.values())))
        save(_grade_error_figure(rows, options, results), output_folder / "grades.png")
        save(_damage_curve_figure(next(iter(curves.values()))), output_folder / "damage_of_an_angle.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "rows": rows,
        "cheapest": coarsest_sufficient_grade(rows, options),
        "failed": failed,
        "results": results,
        "table": table,
    }


def angle_errors(error_paths: UnitErrorPaths, study_options: Options, grade_number: int) -> np.ndarray:
    """Angle errors (samples, seconds + 1) in rad of the units of gyro grade number ``grade_number``, at every full
    second."""
    walk, drift = (
        study_options.random_walks[grade_number] * DEGREES_PER_ROOT_HOUR,
        study_options.grades[grade_number] * DEGREES_PER_HOUR,
    )
    return walk * error_paths[0] + drift * error_paths[1]


def _errors_of_grades(
    scene: Scene, error_paths: UnitErrorPaths, study_options: Options, damage_curve: CubicSpline
) -> Result:
    """Result with, for each gyro grade, the largest angle error (rad) over the longest drive, and the damage error that
    the share SUFFICIENT_SHARE of its units does not exceed, with its standard error."""
    angles = [angle_errors(error_paths, study_options, grade) for grade in range(len(study_options.grades))]
    worst = [np.abs(damage_errors(damage_curve, errors_of_grade)).max(axis=1) for errors_of_grade in angles]
    bounds_of_grades = [quantile_with_interval(errors_of_grade, SUFFICIENT_SHARE) for errors_of_grade in worst]
    channels = {
        "angle_error": Channel(
            "grade", [float(np.abs(errors_of_grade).max()) for errors_of_grade in angles], "rad", "largest angle error"
        ),
        "damage_error": Channel("grade", [middle for middle, _, _ in bounds_of_grades], "", "damage error"),
    }
    units = labelled(scene, channels, {"grade": Channel("grade", study_options.grades, "deg/h")})
    says, remedy = "the angle errors are small ones", "take finer grades, or shorter drives"
    with_assumptions(
        units,
        [
            Assumption(
                "small angle errors",
                says,
                remedy,
                watch_function(units="angle_error"),
                "rad",
                upper_limit=LARGEST_ANGLE_ERROR,
            )
        ],
    )
    chances = {
        f"damage error at {grade:g} deg/h": sampling_error(
            (high - low) / (2 * STANDARD_ERRORS_95), middle, "", study_options.samples
        )
        for grade, (middle, low, high) in zip(study_options.grades, bounds_of_grades, strict=True)
    }
    return with_sampling_error(units, chances, study_options.samples)


def angle_error_deviation(times: np.ndarray, study_options: Options, grade_number: int) -> np.ndarray:
    """Standard deviation (deg) of the angle error of a gyro grade at times (s), in closed form."""
    walk, drift = (
        study_options.random_walks[grade_number] * DEGREES_PER_ROOT_HOUR,
        study_options.grades[grade_number] * DEGREES_PER_HOUR,
    )
    return np.degrees(angle_variance(times, walk, 0.0, drift, study_options.correlation_time) ** 0.5)


def _row_of_grade(
    study_options: Options,
    grade_number: int,
    drive_minutes: float,
    simulated_angles: np.ndarray,
    damage_curves: dict[str, CubicSpline],
) -> dict[str, Any]:
    """Results for a gyro grade over a duration: angle error (deg) in closed form and of the simulated units, and damage
    errors by engine."""
    end = round(60 * drive_minutes)
    angles = simulated_angles[:, : end + 1]
    worst = {engine: np.abs(damage_errors(curve, angles)).max(axis=1) for engine, curve in damage_curves.items()}
    return {
        "grade": study_options.grades[grade_number],
        "random walk": study_options.random_walks[grade_number],
        "minutes": drive_minutes,
        "angle by law": float(angle_error_deviation(np.array(float(end)), study_options, grade_number)),
        "angle measured": float(np.degrees(np.mean(angles[:, -1] ** 2) ** 0.5)),
        "damage error": {
            name: [float(np.quantile(errors, level)) for level in (0.5, SUFFICIENT_SHARE)]
            for name, errors in worst.items()
        },
    }


def coarsest_sufficient_grade(grade_rows: list[dict[str, Any]], study_options: Options) -> dict[str, float | None]:
    """For each duration (min), the coarsest gyro grade (deg/h) of which the share SUFFICIENT_SHARE of units keeps the
    allowed damage error; None if no grade does."""
    cheapest_grades: dict[str, float | None] = {}
    for minutes in study_options.durations:
        judged = (row for row in grade_rows if row["minutes"] == minutes and row["damage error"])
        worst = {row["grade"]: max(sure for _, sure in row["damage error"].values()) for row in judged}
        good = (grade for grade, error in worst.items() if error <= study_options.allowed_damage_error)
        cheapest_grades[f"{minutes:g}"] = max(good, default=None)
    return cheapest_grades


def summary_lines(grade_rows: list[dict[str, Any]], study_options: Options, engines: tuple[str, ...]) -> list[str]:
    """Lines for the screen: angle and damage errors of all grades and durations, and the coarsest sufficient grades."""
    names = " ".join(f"{engine:>18}" for engine in engines)
    lines = [
        f"  {row['grade']:>7g} {row['random walk']:>9g} {row['minutes']:>8g}   {row['angle by law']:>9.2e} "
        f"{row['angle measured']:>9.2e}   "
        + " ".join(f"{_percent_text(half):>8} /{_percent_text(sure):>8}" for half, sure in row["damage error"].values())
        for row in grade_rows
    ]
    best = [
        f"  {minutes:>5} min: {'none of these' if grade is None else f'{grade:g} deg/h'}"
        for minutes, grade in coarsest_sufficient_grade(grade_rows, study_options).items()
    ]
    return [
        f"  Damage: rainflow after ASTM E1049-85, the run repeated; slope {WOEHLER_SLOPE:g}; worst of "
        f"{', '.join(SECTION_FORCE_CHANNELS)}.",
        f"  Angle: rms of {study_options.samples} units at the end. Damage error [%]: median / {SUFFICIENT_SHARE:.0%} "
        "of all units.",
        f"    grade      walk     time     angle error [deg]   {names}",
        "    deg/h  deg/rt(h)     min          law  measured",
        *lines,
        f"  Coarsest grade of which {SUFFICIENT_SHARE:.0%} of all units keep the damage within "
        f"{study_options.allowed_damage_error:.2g}:",
        *best,
    ]


def _percent_text(damage_error: float) -> str:
    return f"{100 * damage_error:.2g}" if damage_error < 1 else f"{100 * damage_error:,.0f}"


def _grade_error_figure(grade_rows: list[dict[str, Any]], study_options: Options, shown_results: Results) -> Any:
    """Figure of angle error and damage error over the duration of the drive, with a line for each gyro grade."""
    from models.drawing.figures import COLUMN_WIDTH, DARK, add_heading, legend_below, subplots

    figure, axes = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8))
    duration_minutes = np.geomspace(study_options.durations[0], study_options.durations[-1], 60)
    for i, grade in enumerate(study_options.grades):
        of_grade = [row for row in grade_rows if row["grade"] == grade]
        minutes = [row["minutes"] for row in of_grade]
        axes[0].loglog(duration_minutes, angle_error_deviation(60 * duration_minutes, study_options, i), color=f"C{i}")
        axes[0].loglog(minutes, [row["angle measured"] for row in of_grade], "o", color=f"C{i}", markersize=4)
        error = [100 * next(iter(row["damage error"].values()))[1] for row in of_grade]
        axes[1].loglog(minutes, error, "o-", color=f"C{i}", markersize=4, label=f"{grade:g} deg/h")
    axes[1].axhline(100 * study_options.allowed_damage_error, color=DARK, linestyle=":", label="allowed")
    axes[0].set(title="Angle error, rms [deg]; line: law, dots: measured", xlabel="length of the drive [min]")
    axes[1].set(
        title=f"Damage error that {SUFFICIENT_SHARE:.0%} of all units keep [%]", xlabel="length of the drive [min]"
    )
    legend_below(figure, axes[1], column_count=len(study_options.grades) + 1)
    add_heading(figure, "What the grade of a gyro does to angle and damage", shown_results)
    return figure


def _damage_curve_figure(damage_curve: CubicSpline) -> Any:
    """Figure of the damage ratio of each section force over a constant pitch error."""
    from models.drawing.drift import CHANNEL_LABELS
    from models.drawing.figures import add_heading, subplots

    figure, axis = subplots(figsize=(7, 3.8))
    angles = np.linspace(damage_curve.x[0], damage_curve.x[-1], 401)
    for i, name in enumerate(SECTION_FORCE_CHANNELS):
        axis.semilogy(np.degrees(angles), np.exp(damage_curve(angles)[:, i]), label=CHANNEL_LABELS[name])
    axis.set(ylabel="damage / true damage [-]", xlabel="constant error of the pitch [deg]")
    axis.legend(ncols=2)
    add_heading(figure, "What a wrong pitch does to the damage of the section forces")
    return figure


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("inertial_unit")
