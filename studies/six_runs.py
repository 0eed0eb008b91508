"""Why a force-excited vehicle runs away: the six runs of the paper, Section 4.

A virtual measurement on a road gives wheel forces and pitch. The vehicle is then driven by these forces:
undisturbed, with noise, with a perturbed model, with both; at last its pitch is prescribed, and the moment
that this takes is the price. Each run is a scene of its own on the files that the measurement left.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import RunFailed
from models.core.result import Result
from models.core.strict import Strict, quantity, read
from models.core.whole_files import write_whole
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene
from studies.virtual_measurement import PAPER, check_road, follower, measure, stride, write_measurement

Progress = Callable[[str, float], None]

DRIFT = 0.05
"""A run has drifted off when its pitch is this far (rad) from the measured one."""
KEPT = 0.01
"""Spacing (s) of the saved runs; the table is made from every step."""


class Options(Strict):
    """[options] of this study."""

    sampling_rate: float = quantity("Hz", "rate at which forces and pitch are measured", default=1000.0)
    noise_fraction: float = quantity(
        "", "standard deviation of the noise by the largest force", default=0.002, zero=True
    )
    noise_samples: int = Field(5, ge=1, description="number of noise samples")
    perturbed_models: int = Field(5, ge=0, description="number of random models beside the paper's")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of noise and models")


def run(scene: Scene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """All six runs in each engine; saves every result, five figures and ``table.txt``."""
    check(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    measured, deviation, scenes = followed(scene, folder)
    measured.save(folder / "measurement.nc")
    runs: dict[str, dict[str, Result]] = {engine: {} for engine in engines}
    failed: dict[str, str] = {}
    pairs = [(engine, name) for engine in engines for name in scenes]
    for i, (engine, name) in enumerate(pairs):
        progress(f"{engine}: {name}", i / len(pairs))
        try:
            runs[engine][name] = simulate(scenes[name], engine)
        except RunFailed as error:
            failed[f"{engine}, {name}"] = str(error)
            continue
        runs[engine][name].every(KEPT).save(folder / f"{engine} {name}.nc")
    found = [row(engine, name, measured, result) for engine in engines for name, result in runs[engine].items()]
    table = text(found, engines, options, deviation)
    write_whole(folder / "table.txt", "\n".join(table) + "\n")
    progress("figures", 1.0)
    if not failed:
        _figures(measured, runs[engines[0]], folder)
    return {
        "scene": scene.title,
        "folder": str(folder),
        "sampling rate": options.sampling_rate,
        "noise deviation": deviation,
        "rows": found,
        "failed": failed,
        "table": table,
    }


def followed(scene: Scene, folder: Path) -> tuple[Result, float, dict[str, Scene]]:
    """The measurement, the noise's deviation (N), and by name the scenes of runs on the files that it leaves."""
    options = read(Options, scene.options, scene.file, "options")
    measured = measure(scene)
    largest = write_measurement(measured, options.sampling_rate, stride(scene, options.sampling_rate), folder)
    deviation = options.noise_fraction * largest
    return measured, deviation, _scenes(scene, options, folder, deviation)


def check(scene: Scene, engines: tuple[str, ...]) -> None:
    """Refuse, before anything is written, a scene that this study cannot follow through all its runs."""
    options = read(Options, scene.options, scene.file, "options")
    check_road(scene, engines, options.sampling_rate)


def _scenes(scene: Scene, options: Options, folder: Path, deviation: float) -> dict[str, Scene]:
    """The runs that follow the measurement, by name."""
    base = scene.vehicle_parameters()
    paper = {name: getattr(base, name) * factor for name, factor in PAPER.items()}
    make = follower(scene, folder)
    noises = [
        {"force_noise": {"deviation": deviation, "seed": 1000 * options.seed + i}} for i in range(options.noise_samples)
    ]
    scenes = {"undisturbed": make({}, {})}
    scenes |= {f"noisy {i + 1}": make({}, noise) for i, noise in enumerate(noises)}
    scenes["perturbed"] = make(paper, {})
    for i in range(options.perturbed_models):
        scenes[f"model {i + 1}"] = make(_random_model(base, options.seed, i), {})
    scenes["both"] = make(paper, noises[0])
    guide = {"prescribed_pitch": {"file": "pitch.csv"}}
    scenes["guided, undisturbed"] = make({}, guide)
    scenes["guided, noisy"] = make({}, noises[0] | guide)
    scenes["guided, perturbed"] = make(paper, guide)
    scenes["guided, both"] = make(paper, noises[0] | guide)
    return scenes


def _random_model(base: Any, seed: int, index: int) -> dict[str, float]:
    """Chassis springs, dampers and inertia, each times a random factor between 0.9 and 1.1 (Fig. 7)."""
    factors = np.random.Generator(np.random.Philox(key=[seed, index])).uniform(0.9, 1.1, 5)
    return {name: float(getattr(base, name) * factor) for name, factor in zip(PAPER, factors, strict=True)}


def drift_off(measured: Result, run: Result) -> float | None:
    """First time (s) at which the pitch is more than DRIFT from the measured one; None if it never is."""
    far = np.flatnonzero(np.abs(_error(measured, run, "pitch")) > DRIFT)
    return float(run.times[far[0]]) if len(far) else None


def _error(measured: Result, run: Result, channel: str) -> np.ndarray:
    """Difference to the measurement at the run's own times."""
    return run[channel] - np.interp(run.times, measured.times, measured[channel])


def row(engine: str, name: str, measured: Result, run: Result) -> dict[str, Any]:
    """Drift-off time, heave error, and for a guided run the enforced moment and the inertia term."""
    found: dict[str, Any] = {"engine": engine, "run": name, "drift-off": drift_off(measured, run)}
    found["heave error"] = float(np.abs(_error(measured, run, "z3")).max())
    if "enforced_moment" in run.data:
        moment, inertia = run["enforced_moment"], run["inertia_term"]
        found["moment rms"] = float(np.sqrt(np.mean(moment**2)))
        found["moment max"] = float(np.abs(moment).max())
        found["inertia max"] = float(np.abs(inertia).max())
    return found


PUBLISHED = {
    "undisturbed": "about 30 s",
    "noisy 1": "about 10 s",
    "perturbed": "about 10 s",
    "guided, undisturbed": "about 70 N m",
    "guided, both": "+-800 N m; inertia term about 15 kN m",
}
"""What the paper prints. Its "85 kN m" cannot be: |I beta''| <= b|f3| + a|f4|, and 5 % of it is the moment."""


def text(found: list[dict[str, Any]], engines: tuple[str, ...], options: Options, deviation: float) -> list[str]:
    """The table as lines of text: a line per run, a column per engine."""
    by_run: dict[str, list[dict[str, Any]]] = {}
    for line in found:
        by_run.setdefault(line["run"], []).append(line)
    names = " ".join(f"{engine:>9}" for engine in engines)
    free = [
        f"  {name:<20} {_cells(lines, _when)}   {_heave(lines):>9}   {PUBLISHED.get(name, '')}".rstrip()
        for name, lines in by_run.items()
        if "moment max" not in lines[0]
    ]
    guided = [
        f"  {name:<20} {_cells(lines, _moment)}   {lines[0]['moment rms']:>9.1f}   "
        f"{lines[0]['inertia max'] / 1e3:>9.1f}   {PUBLISHED.get(name, '')}".rstrip()
        for name, lines in by_run.items()
        if "moment max" in lines[0]
    ]
    return [
        f"  Sampled at {options.sampling_rate:g} Hz, linear in between; noise {deviation:.1f} N.",
        f"  Time [s] until the pitch is {DRIFT} rad wrong",
        f"  {'force-excited':<20} {names}   heave [m]   paper",
        *free,
        "  Largest enforced moment [N m]",
        f"  {'pitch prescribed':<20} {names}   rms [N m]   I b'' [kN m]   paper",
        *guided,
        "  rms and I b'' (largest) are those of the first column; generalised-alpha's moment errs by some "
        "1e-3 of I b'' at 1 ms on this road",
    ]


def _cells(lines: list[dict[str, Any]], form: Callable[[dict[str, Any]], str]) -> str:
    return " ".join(f"{form(line):>9}" for line in lines)


def _when(line: dict[str, Any]) -> str:
    return "never" if line["drift-off"] is None else f"{line['drift-off']:.2f}"


def _moment(line: dict[str, Any]) -> str:
    return f"{line['moment max']:.1f}"


def _heave(lines: list[dict[str, Any]]) -> str:
    return f"{lines[0]['heave error']:.1e}"


def _figures(measured: Result, runs: dict[str, Result], folder: Path) -> None:
    """Figures like the paper's 4 to 8."""
    from models.drawing.figures import save

    save(_figure_measurement(measured), folder / "fig4_measurement.png")
    main = {
        "virtual measurement": measured,
        "undisturbed": runs["undisturbed"],
        "noisy": runs["noisy 1"],
        "perturbed model": runs["perturbed"],
        "both": runs["both"],
    }
    save(_figure_drift(main, "Force-excited runs beside the measurement"), folder / "fig5_drift.png")
    for prefix, title, name in (
        ("noisy", "noise samples", "fig6_noise_samples"),
        ("model", "perturbed models", "fig7_perturbed_models"),
    ):
        chosen = {"virtual measurement": measured} | {key: run for key, run in runs.items() if key.startswith(prefix)}
        if len(chosen) == 1:
            continue
        save(_figure_drift(chosen, f"Force-excited runs: {len(chosen) - 1} {title}"), folder / f"{name}.png")
    save(_figure_moment(runs["guided, both"]), folder / "fig8_enforced_moment.png")


def _figure_measurement(measured: Result) -> Any:
    from models.drawing.figures import plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 5), width_ratios=(2, 1))
    middle = round(float(measured.times[-1]) / 2, 1)
    detail = (measured.times >= middle) & (measured.times <= middle + 1)
    for row, (channels, label, scale) in enumerate(
        ((("zeta1", "zeta2"), "road under the wheels, up [m]", -1.0), (("f1", "f2"), "wheel force [kN]", 1e-3))
    ):
        for channel, name in zip(channels, ("front", "rear"), strict=True):
            axes[row, 0].plot(measured.times, scale * measured[channel], label=name, linewidth=0.7)
            axes[row, 1].plot(measured.times[detail], scale * measured[channel][detail], label=name)
        axes[row, 0].set_title(label)
        axes[row, 1].set_title(f"detail, from {middle:g} s on")
    axes[0, 0].legend(ncols=2, loc="upper right")
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    figure.suptitle("Virtual measurement: road and wheel forces", x=0.01, ha="left", fontweight="bold")
    return figure


def _figure_drift(results: dict[str, Result], title: str) -> Any:
    """Heave error on a logarithmic scale, and pitch; the first result is the measurement."""
    from models.drawing.figures import plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 3.8))
    (name, measured), *runs = results.items()
    axes[1].plot(measured.times, measured["pitch"], label=name, color="black", linewidth=1.8, zorder=9)
    for i, (name, run) in enumerate(runs):
        axes[0].semilogy(run.times, np.abs(_error(measured, run, "z3")) + 1e-12, color=f"C{i}", linewidth=0.8)
        axes[1].plot(run.times, run["pitch"], label=name, color=f"C{i}")
    axes[0].set_title("error of the chassis' heave [m]")
    axes[0].set_ylim(1e-9, 10)
    axes[1].set_title("pitch, nose up [rad]")
    axes[1].set_ylim(-1, 1)
    for axis in axes:
        axis.set_xlabel("time [s]")
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=len(results), fontsize=8.5)
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    return figure


def _figure_moment(result: Result) -> Any:
    from models.drawing.figures import plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 3.4))
    axes[0].plot(result.times, result["inertia_term"] / 1e3, linewidth=0.5)
    axes[0].set_title("inertia term I beta'' [kN m]")
    axes[1].plot(result.times, result["enforced_moment"], linewidth=0.5, color="C1")
    axes[1].set_title("enforced moment [N m]")
    for axis in axes:
        axis.set_xlabel("time [s]")
    figure.suptitle(
        "Pitch prescribed, perturbed model and noisy forces: what the guidance takes",
        x=0.01,
        ha="left",
        fontweight="bold",
    )
    return figure


if __name__ == "__main__":
    from studies.command_line import study

    study("six_runs")
