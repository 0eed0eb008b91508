"""How noisy forces scatter the run of a vehicle: thousands of noise paths, when they drift off, how wide they spread.

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

from models.core.assumptions import Watched, judged
from models.core.discretisation import by_chance, of_chance
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.steps import divides
from models.core.strict import Strict, quantity, read
from models.core.told import Results
from models.core.whole_files import write_whole
from models.engines.catalogue import CATALOGUE
from models.ensemble.runner import Blocks, run_paths
from models.ensemble.runner import Progress as Done
from models.ensemble.statistics import deviation, percentiles, quantile
from models.ensemble.store import Arrays
from models.ensemble.workers import Crew
from models.systems.pitch_plane.assumptions import upright
from models.systems.pitch_plane.noise_paths import gap, mujoco_threads, noise_paths
from models.systems.pitch_plane.run import run_away
from models.systems.pitch_plane.scene import Scene
from models.systems.pitch_plane.virtual_measurement import check_road, follower, measure, write_measurement
from models.vehicles.pitch_plane import STATE_NAMES

Progress = Callable[[str, float], None]

BLOCKS = "blocks"
"""Folder of the finished blocks, within that of the results; a study that has one can be resumed."""
QUANTILES = (0.05, 0.5, 0.95)


class Options(Strict):
    """[options] of this study."""

    paths: int = Field(500, ge=2, le=1_000_000, description="number of noise paths in the reference")
    engine_paths: int = Field(4, ge=1, le=10_000, description="number of the first paths that other engines repeat")
    seed: int = Field(1, ge=0, lt=2**64, description="seed of the noise")
    rows: float = quantity("s", "spacing of the saved states", default=0.5)
    times: list[float] = Field([1.0, 2.0, 5.0, 10.0, 15.0], description="times (s) of the table, on saved rows")
    threshold: float = quantity("rad", "pitch error at which a path has drifted off", default=0.05)
    sampling_rate: float = quantity("Hz", "rate at which forces are measured", default=1000.0)
    noise_fraction: float = quantity("", "standard deviation of the noise by the largest force", default=0.002)


def check(scene: Scene, engines: tuple[str, ...]) -> Options:
    """The scene's options; refuses, before anything is written, one that this study cannot follow."""
    options = read(Options, scene.options, scene.file, "options")
    check_road(scene, engines, options.sampling_rate)
    for engine in {"reference", *engines}:
        settings = scene.settings(engine)
        if CATALOGUE[engine][str(settings.integrator)].adaptive or settings.step != scene.run.step:
            allowed = "an ensemble compares states at run.step: name no adaptive integrator and no other step"
            raise InputError(scene.file, f"engines.{engine}", None, allowed)
    if not (divides(scene.run.step, options.rows) and divides(options.rows, scene.run.duration)):
        allowed = f"must be a multiple of run.step = {scene.run.step:g} s and divide run.duration"
        raise InputError(scene.file, "options.rows", options.rows, allowed)
    for time in options.times:
        if not 0 < time <= scene.run.duration or not divides(options.rows, time):
            allowed = f"each must be a multiple of options.rows = {options.rows:g} s within the run"
            raise InputError(scene.file, "options.times", time, allowed)
    return options


def run(scene: Scene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """All paths in the reference, the first ones in the other engines; saves ``ensemble.nc``, table and figure."""
    options = check(scene, engines)
    measured, period = measure(scene, scene.error), 1.0 / options.sampling_rate
    times = options.rows * np.arange(round(scene.run.duration / options.rows) + 1)

    def tell(finished: Done) -> None:
        progress(f"reference: {finished}", finished.done / finished.paths)

    crew, size = Crew.of(scene), Blocks()
    with TemporaryDirectory() as name, crew.at_work(len(size.cut(options.paths))) as pool:
        largest = write_measurement(measured, Path(name), period)
        noise = {"deviation": options.noise_fraction * largest, "seed": options.seed}
        noisy = follower(scene, Path(name))({}, {"force_noise": noise})
        first = run_away(noisy, "reference", scene.error)
        asked = (noisy, times, measured["pitch"], options.threshold)
        paths = run_paths(noise_paths(*asked), options.paths, folder / BLOCKS, pool, progress=tell)
        gaps = {}
        for engine in (engine for engine in engines if engine != "reference"):
            progress(f"{engine}: {options.engine_paths} of the same paths", 1.0)
            if engine == "mujoco":
                repeated = run_paths(mujoco_threads(*asked, crew.workers), options.engine_paths)
            else:
                repeated = run_paths(noise_paths(*asked, engine), options.engine_paths, executor=pool, blocks=Blocks(1))
            gaps[engine] = gap(paths, repeated, times)
    write_measurement(measured, folder, period)
    true = measured.states[np.rint(times / scene.run.step).astype(int)]
    channels = {
        "states": Channel(("path", "time", "state"), paths["states"], "m, rad, m/s, rad/s"),
        "drift_off": Channel("path", paths["drift_off"], "s", "drift-off, infinite if never"),
        "failed": Channel("path", paths["failed"], "s", "last good time of a path that failed"),
    }
    axes = {"time": Channel("time", times, "s"), "state": Channel("state", list(STATE_NAMES))}
    rows = _rows(options, times, paths["states"] - true)
    saved = _told(result(noisy, channels, axes, engine="reference", threshold=options.threshold), first, rows, options)
    saved.save(folder / "ensemble.nc")
    table = text(options, scene, rows, paths, gaps)
    write_whole(folder / "table.txt", "\n".join(table) + "\n")
    results = {"measurement": measured, "all paths": saved}
    _figure(times, paths["states"][:, :, 3] - true[:, 3], paths["drift_off"], options, results, folder)
    return {
        "scene": scene.title,
        "folder": str(folder),
        "results": results,
        "paths": options.paths,
        "rows": rows,
        "gaps": {engine: None if math.isnan(worst) else worst for engine, worst in gaps.items()},
        "failed": {},
        "table": table,
    }


def _told(saved: Result, first: Result, rows: list[dict[str, float]], options: Options) -> Result:
    """The ensemble with the error of the steps, of its first path, and the standard errors of its deviations."""
    error = json.loads(first.data.attrs["error"])
    saved.data.attrs["error"] = json.dumps(error | ({"how": f"{error['how']}, of the first path"} if error else {}))
    worst = {
        name: by_chance(row[f"{name} error"], row[name], unit, options.paths)
        for name, unit in (("pitch", "rad"), ("heave", "m"))
        for row in [max(rows, key=lambda row: row[f"{name} error"] / (row[name] or 1.0))]
    }
    assumed = [upright("end the runs before, or hold their pitch (kalman_filter)", _steepest)]
    return of_chance(
        judged(saved, assumed), {f"deviation of {name}": breach for name, breach in worst.items()}, options.paths
    )


def _steepest(run: Result) -> Watched:
    """Largest pitch (rad) of all paths at each time; of those that left all bounds it is none."""
    return {"any path": np.fmax.reduce(np.abs(run["states"][:, :, 3]), axis=0)}


def _rows(options: Options, times: np.ndarray, errors: np.ndarray) -> list[dict[str, float]]:
    """Standard deviation and its standard error of pitch and heave at the asked times."""
    names, rows = ("time", "pitch", "pitch error", "heave", "heave error"), []
    for time in options.times:
        row = round(time / options.rows)
        figures = (float(times[row]), *deviation(errors[:, row, 3]), *deviation(errors[:, row, 2]))
        rows.append(dict(zip(names, figures, strict=True)))
    return rows


def text(
    options: Options, scene: Scene, rows: list[dict[str, float]], paths: Arrays, gaps: dict[str, float]
) -> list[str]:
    """The table as lines of text."""
    lines = [
        f"  {options.paths} paths of {scene.run.duration:g} s, forces at {options.sampling_rate:g} Hz, noise "
        f"{100 * options.noise_fraction:g} % of the largest force",
        "  time [s]   sd of pitch [rad]         sd of heave [m]",
    ]
    lines += [
        f"  {row['time']:8g}   {row['pitch']:.3e} +- {row['pitch error']:.0e}   "
        f"{row['heave']:.3e} +- {row['heave error']:.0e}"
        for row in rows
    ]
    lines.append(f"  Drift-off ({options.threshold:g} rad), quantiles with their 95 % intervals [s]")
    for level in QUANTILES:
        value, low, high = quantile(paths["drift_off"], level)
        lines.append(f"  {100 * level:7g} %   {_time(value)}   ({_time(low)} to {_time(high)})")
    lost = int(np.isfinite(paths["failed"]).sum())
    lines += [f"  {lost} paths left all bounds and count as drifted off by then"] if lost else []
    for engine, worst in gaps.items():
        differ = (
            f"{options.engine_paths} of these paths differ by at most {worst:.0e} of the largest state before drift-off"
        )
        none = "not compared, as every path drifts off before the first saved row"
        lines.append(f"  {engine}: {none if math.isnan(worst) else differ}")
    return lines


def _time(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "never"


def _figure(
    times: np.ndarray, errors: np.ndarray, drift_off: np.ndarray, options: Options, results: Results, folder: Path
) -> None:
    """Percentiles of the pitch error over time, and a histogram of the drift-off times."""
    from models.drawing.drift import draw_fan
    from models.drawing.figures import BLUE, DARK, WIDE, heading, plt, save

    figure, (fan, histogram) = plt.subplots(1, 2, figsize=(WIDE, 3.8), width_ratios=(3, 2))
    draw_fan(fan, times[1:], percentiles(errors[:, 1:]))
    fan.axhline(
        options.threshold, color=DARK, linestyle="--", linewidth=0.8, label=f"drift-off, {options.threshold:g} rad"
    )
    fan.legend(loc="lower right")
    drifted = drift_off[np.isfinite(drift_off)]
    histogram.hist(drifted, bins=40, color=BLUE, alpha=0.6)
    for level, style in zip(QUANTILES, (":", "-", ":"), strict=True):
        value = quantile(drift_off, level)[0]
        if np.isfinite(value):
            histogram.axvline(value, color=DARK, linestyle=style, label=f"{100 * level:g} %: {value:.1f} s")
    histogram.set_title(f"Drift-offs: paths [-] ({len(drift_off) - len(drifted)} never)")
    if len(drifted):
        histogram.legend()
    plt.setp((fan, histogram), xlabel="time [s]")
    title = f"{options.paths} noise paths of one measured run, forces at {options.sampling_rate:g} Hz"
    heading(figure, title, results)
    save(figure, folder / "ensemble.png")


if __name__ == "__main__":
    from studies.command_line import study

    study("ensemble")
