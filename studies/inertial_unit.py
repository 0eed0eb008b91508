"""Which inertial unit is good enough: from the grade of a gyro to the error in the damage of a component.

The pitch that a gyro gives errs by its random walk and by its wandering bias, as effects ``gyro`` and
``gyro_bias`` have them. A vehicle that is guided by this pitch stands wrong by that angle, and a slow angle turns the
section forces and changes nothing else (shown by a guided run in the validation case ``inertial_unit``): the
component along the chassis is f3 sin(pitch + error). So an hour needs no second simulation: the damage of the
scene's run, driven again and again, is counted once for each of some constant errors, and averaged over the
error's path.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from scipy.interpolate import CubicSpline

from models.core.errors import InputError, RunFailed
from models.core.noise import GYRO, normal
from models.core.result import Result
from models.core.strict import Strict, quantity, read
from models.core.whole_files import write_whole
from models.drift.score import CHANNELS, section_forces
from models.fatigue.damage import SLOPE, pseudo_damage
from models.sensors.inertial_unit import DEGREES_PER_HOUR, DEGREES_PER_ROOT_HOUR, angle_variance, bias
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene

Progress = Callable[[str, float], None]
Positive = Annotated[float, Field(gt=0)]
Minutes = Annotated[float, Field(ge=0.1, le=600)]

NODES = 41
"""Constant angle errors at which damage is counted; an odd number, so that one of them is zero."""
SMALLEST = 1e-3
"""rad; below it the nodes are evenly spaced, above it their spacing grows with the angle."""
SURE = 0.9
"""Part of all units of one grade that must keep within the allowed error."""
KEPT = 0.01
"""Spacing (s) of the saved runs."""


class Options(Strict):
    """[options] of this study."""

    grades: list[Positive] = Field(
        [0.001, 0.01, 0.1, 1.0, 10.0],
        min_length=1,
        description="standard deviation of the wandering bias, deg/h, rising",
    )
    random_walks: list[Positive] = Field(
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


def check(scene: Scene, engines: tuple[str, ...]) -> None:
    """Refuse, before anything is written, a scene without a road and lists that do not fit each other."""
    options = read(Options, scene.options, scene.file, "options")
    if "road" not in scene.effects:
        raise InputError(scene.file, "effects.road", None, "is missing: this study needs a run on a road")
    if len(options.grades) != len(options.random_walks):
        raise InputError(
            scene.file,
            "options.random_walks",
            options.random_walks,
            f"must have one value for each of the {len(options.grades)} grades",
        )
    for name in ("grades", "durations"):
        values = getattr(options, name)
        if (np.diff(values) <= 0).any():
            raise InputError(scene.file, f"options.{name}", values, "must rise from each value to the next one")


def run(scene: Scene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """The road run in each engine, angle errors, damage errors; saves runs, a table and two figures."""
    check(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    progress("angle errors", 0.0)
    paths = unit_paths(options)
    curves: dict[str, CubicSpline] = {}
    failed: dict[str, str] = {}
    for i, engine in enumerate(engines):
        progress(f"{engine}: run and damage", (i + 0.5) / (len(engines) + 1))
        try:
            result = simulate(scene, engine)
        except RunFailed as error:
            failed[engine] = str(error)
            continue
        result.every(KEPT).save(folder / f"{engine}.nc")
        curves[engine] = damage_curve(result, scene, largest(paths, options))
    pairs = [(grade, minutes) for grade in range(len(options.grades)) for minutes in options.durations]
    rows = [_row(options, grade, minutes, paths, curves) for grade, minutes in pairs]
    table = text(rows, options, tuple(curves))
    write_whole(folder / "table.txt", "\n".join(table) + "\n")
    if curves:
        _figures(rows, options, next(iter(curves.values())), folder)
    return {
        "scene": scene.title,
        "folder": str(folder),
        "rows": rows,
        "cheapest": cheapest(rows, options),
        "failed": failed,
        "table": table,
    }


def unit_paths(options: Options) -> tuple[np.ndarray, np.ndarray]:
    """Angle errors (samples, seconds + 1) at each second: of a random walk of 1 rad per sqrt(s), of a bias of 1 rad/s.

    Every grade is a multiple of the same paths, so that grades are compared without scatter between them.
    """
    rate, length = options.sampling_rate, round(60 * options.durations[-1])
    made = [_unit_path(options.seed, path, rate, length, options.correlation_time) for path in range(options.samples)]
    walk, wander = (np.array(part) for part in zip(*made, strict=True))
    return walk, wander


def _unit_path(seed: int, path: int, rate: int, length: int, correlation_time: float) -> tuple[np.ndarray, np.ndarray]:
    """Both parts of one path, integrated from the samples that the effects would add to a reading."""
    noise = normal(seed, path, rate * length, 1, source=GYRO)[:, 0] / rate**0.5
    drift = bias(rate * length, 1 / rate, 0.0, 1.0, correlation_time, seed, path) / rate
    walk, wander = (np.concatenate([[0.0], part.reshape(length, rate).sum(axis=1).cumsum()]) for part in (noise, drift))
    return walk, wander


def angle_errors(paths: tuple[np.ndarray, np.ndarray], options: Options, grade: int) -> np.ndarray:
    """Angle errors (samples, seconds + 1) in rad of one grade, by its number."""
    walk, drift = options.random_walks[grade] * DEGREES_PER_ROOT_HOUR, options.grades[grade] * DEGREES_PER_HOUR
    return walk * paths[0] + drift * paths[1]


def largest(paths: tuple[np.ndarray, np.ndarray], options: Options) -> float:
    """Largest angle error (rad) of any grade; a quarter turn at most, beyond which no pitch is left to speak of."""
    found = max(float(np.abs(angle_errors(paths, options, i)).max()) for i in range(len(options.grades)))
    return min(found, np.pi / 2)


def damage_curve(result: Result, scene: Scene, reach: float) -> CubicSpline:
    """Logarithm of the damage of all section forces by the true ones', over a constant error of the pitch (rad)."""
    widest = np.arcsinh(reach / SMALLEST)
    angles = SMALLEST * np.sinh(np.linspace(-widest, widest, NODES))
    damage = np.array([_damage(result, angle) for angle in angles])
    true = damage[NODES // 2]
    if not (true > 0).all():
        raise InputError(
            scene.file,
            "effects.road",
            None,
            "leaves no damage in the section forces to compare with: use a road that moves the vehicle",
        )
    return CubicSpline(angles, np.log(damage / true))


def _damage(result: Result, error: float) -> list[float]:
    forces = section_forces(result["f3"], result["f4"], result["pitch"] + error)
    return [pseudo_damage(repeated(forces[name])) for name in CHANNELS]


def repeated(load: np.ndarray) -> np.ndarray:
    """The load (n,) from its largest value round to the same: what one of many passes does (ASTM E1049-85, 5.4.5).

    Cut elsewhere, the largest cycle of all would stay open and count one half.
    """
    top = int(np.argmax(load))
    return np.concatenate([load[top:], load[: top + 1]])


def damage_errors(curve: CubicSpline, angles: np.ndarray) -> np.ndarray:
    """Relative error (samples, 4) of the damage of each section force over error paths (samples, n) in rad."""
    reach = curve.x[-1]
    return np.expm1(curve(np.clip(angles, -reach, reach))).mean(axis=1)


def _row(
    options: Options, grade: int, minutes: float, paths: tuple[np.ndarray, np.ndarray], curves: dict[str, CubicSpline]
) -> dict[str, Any]:
    """One grade over one duration: angle error by law and measured, damage error per engine."""
    end = round(60 * minutes)
    angles = angle_errors(paths, options, grade)[:, : end + 1]
    law = angle_variance(
        np.array(float(end)),
        options.random_walks[grade] * DEGREES_PER_ROOT_HOUR,
        0.0,
        options.grades[grade] * DEGREES_PER_HOUR,
        options.correlation_time,
    )
    worst = {engine: np.abs(damage_errors(curve, angles)).max(axis=1) for engine, curve in curves.items()}
    return {
        "grade": options.grades[grade],
        "random walk": options.random_walks[grade],
        "minutes": minutes,
        "angle by law": float(np.degrees(law**0.5)),
        "angle measured": float(np.degrees(np.mean(angles[:, -1] ** 2) ** 0.5)),
        "damage error": {name: [float(np.quantile(one, part)) for part in (0.5, SURE)] for name, one in worst.items()},
    }


def cheapest(rows: list[dict[str, Any]], options: Options) -> dict[str, float | None]:
    """Duration in minutes -> coarsest grade (deg/h) of which SURE of all units keep the allowed damage error."""
    found: dict[str, float | None] = {}
    for minutes in options.durations:
        good = [
            row["grade"]
            for row in rows
            if row["minutes"] == minutes
            and row["damage error"]
            and max(sure for _, sure in row["damage error"].values()) <= options.allowed_damage_error
        ]
        found[f"{minutes:g}"] = max(good, default=None)
    return found


def text(rows: list[dict[str, Any]], options: Options, engines: tuple[str, ...]) -> list[str]:
    """The table as lines of text."""
    names = " ".join(f"{engine:>18}" for engine in engines)
    lines = [
        f"  {row['grade']:>7g} {row['random walk']:>9g} {row['minutes']:>8g}   {row['angle by law']:>9.2e} "
        f"{row['angle measured']:>9.2e}   "
        + " ".join(f"{_percent(half):>8} /{_percent(sure):>8}" for half, sure in row["damage error"].values())
        for row in rows
    ]
    best = [f"  {minutes:>5} min: {_named(grade)}" for minutes, grade in cheapest(rows, options).items()]
    return [
        f"  Damage: rainflow after ASTM E1049-85, the run repeated; slope {SLOPE:g}; worst of {', '.join(CHANNELS)}.",
        f"  Angle: rms of {options.samples} units at the end. Damage error [%]: median / {SURE:.0%} of all units.",
        f"    grade      walk     time     angle error [deg]   {names}",
        "    deg/h  deg/rt(h)     min          law  measured",
        *lines,
        f"  Coarsest grade of which {SURE:.0%} of all units keep the damage within {options.allowed_damage_error:.2g}:",
        *best,
    ]


def _percent(part: float) -> str:
    return f"{100 * part:.2g}" if part < 1 else f"{100 * part:,.0f}"


def _named(grade: float | None) -> str:
    return "none of these" if grade is None else f"{grade:g} deg/h"


def _figures(rows: list[dict[str, Any]], options: Options, curve: CubicSpline, folder: Path) -> None:
    from models.drawing.figures import save

    save(_figure_grades(rows, options), folder / "grades.png")
    save(_figure_curve(curve), folder / "damage_of_an_angle.png")


def _figure_grades(rows: list[dict[str, Any]], options: Options) -> Any:
    """Angle error and damage error over the length of the drive, a line per grade."""
    from models.drawing.figures import plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4))
    times = np.geomspace(options.durations[0], options.durations[-1], 60)
    for i, grade in enumerate(options.grades):
        own = [row for row in rows if row["grade"] == grade]
        law = angle_variance(
            60 * times,
            options.random_walks[i] * DEGREES_PER_ROOT_HOUR,
            0.0,
            grade * DEGREES_PER_HOUR,
            options.correlation_time,
        )
        minutes = [row["minutes"] for row in own]
        axes[0].loglog(times, np.degrees(law**0.5), color=f"C{i}")
        axes[0].loglog(minutes, [row["angle measured"] for row in own], "o", color=f"C{i}", markersize=4)
        error = [100 * next(iter(row["damage error"].values()))[1] for row in own]
        axes[1].loglog(minutes, error, "o-", color=f"C{i}", markersize=4, label=f"{grade:g} deg/h")
    axes[1].axhline(100 * options.allowed_damage_error, color="black", linestyle=":", label="allowed")
    axes[0].set(title="angle error, rms [deg]; line: law, dots: measured", xlabel="length of the drive [min]")
    axes[1].set(title=f"damage error that {SURE:.0%} of all units keep [%]", xlabel="length of the drive [min]")
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=len(options.grades) + 1)
    figure.suptitle("What the grade of a gyro does to angle and damage", x=0.01, ha="left", fontweight="bold")
    return figure


def _figure_curve(curve: CubicSpline) -> Any:
    """Damage over a constant angle error."""
    from models.drawing.figures import plt

    figure, axis = plt.subplots(figsize=(7, 3.8))
    angles = np.linspace(curve.x[0], curve.x[-1], 401)
    for i, name in enumerate(CHANNELS):
        axis.semilogy(np.degrees(angles), np.exp(curve(angles)[:, i]), label=name)
    axis.set(title="damage by true damage", xlabel="constant error of the pitch [deg]")
    axis.legend(ncols=2)
    figure.suptitle("What a wrong pitch does to the damage of the section forces", x=0.01, ha="left", fontweight="bold")
    return figure


if __name__ == "__main__":
    from studies.command_line import study

    study("inertial_unit")
