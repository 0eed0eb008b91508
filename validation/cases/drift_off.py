"""When a run drifts off: predicted before it starts, and measured, over roads, speeds, sampling rates and sources.

A run has drifted off when its pitch is 0.05 rad from the true one, that of the road-excited run. Noise is random, so
its ensemble has paths. The other sources are not: the ensemble of the error between the samples is made of
neighbouring speeds or of the seeds of an ISO 8608 road, that of a wrong model of random models (each of k3, k4, d3,
d4 and I times a factor between 0.9 and 1.1, as in Fig. 7 of the paper).
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from models.core.result import Result
from models.engines.assembly import Assembly
from models.ensemble.runner import run_paths
from models.ensemble.statistics import quantile_with_interval
from models.systems.pitch_plane.noise_paths import noise_paths
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.trust import (
    UNTRUSTED_PITCH,
    GrowthCurve,
    interpolation_error_curve,
    model_error_curve,
    noise_error_curve,
)
from models.systems.pitch_plane.virtual_measurement import PAPER_FACTORS, perturbed_parameters
from models.vehicles.pitch_plane import Parameters
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table
from validation.common.scenes import force_scene, on_paper_road, virtual_drive

TITLE = "When a force-excited run drifts off, predicted before it starts"
SYSTEM: System = "drift"
SEED = 12
PATHS, QUICK_PATHS = 300, 60
STEP = 5e-4
"""Of the runs, s."""
MODELS = 15
"""Random models; seven neighbouring roads stand for the error between the samples."""
SPEEDS = (0.94, 0.96, 0.98, 1.0, 1.02, 1.04, 1.06)
"""Factors on the speed."""


@dataclass(frozen=True)
class Combination:
    """One combination to compare. source : cause of the error: noise, interpolation or model; road : settings of the
    road effect; rate : sampling rate (Hz); size : noise (N)."""

    name: str
    source: str
    road: Saved
    rate: float
    duration: float
    size: float = 0.0
    interpolation: str = "linear"


STUDY = {"source": "study"}
ISO = {"source": "iso8608", "road_class": "D", "level": "one-sided"}
COMBINATIONS = (
    Combination("study 20 m/s", "noise", {**STUDY, "speed": 20.0}, 1000.0, 16.0, 30.7),
    Combination("study 20 m/s", "noise", {**STUDY, "speed": 20.0}, 200.0, 16.0, 30.7),
    Combination("study 10 m/s", "noise", {**STUDY, "speed": 10.0}, 500.0, 24.0, 30.0),
    Combination("study 20 m/s, smoother", "noise", {**STUDY, "speed": 20.0, "gd": 6e-4}, 1000.0, 30.0, 10.0),
    Combination("study 30 m/s, smoother", "noise", {**STUDY, "speed": 30.0, "gd": 1.2e-3}, 1000.0, 30.0, 3.0),
    Combination("ISO class D 25 m/s", "noise", {**ISO, "speed": 25.0, "seed": 3}, 500.0, 30.0, 15.0),
    Combination("study 20 m/s", "interpolation", {**STUDY, "speed": 20.0}, 100.0, 30.0),
    Combination("study 20 m/s", "interpolation", {**STUDY, "speed": 20.0}, 500.0, 40.0),
    Combination("study 20 m/s", "interpolation", {**STUDY, "speed": 20.0}, 1000.0, 40.0),
    Combination("study 15 m/s", "interpolation", {**STUDY, "speed": 15.0}, 200.0, 50.0, interpolation="held"),
    Combination("ISO class E 20 m/s", "interpolation", {**ISO, "road_class": "E", "speed": 20.0}, 200.0, 40.0),
    Combination("study 20 m/s", "model", {**STUDY, "speed": 20.0}, 1000.0, 30.0),
    Combination("study 10 m/s", "model", {**STUDY, "speed": 10.0}, 500.0, 40.0),
    Combination("ISO class D 25 m/s", "model", {**ISO, "speed": 25.0, "seed": 3}, 1000.0, 40.0),
)


@on_paper_road()
@allowing_breaches("that runs drift off is what is shown", "upright")
def measure(quick: bool, folder: Path) -> CaseAnswer:
    """A row per combination; quick: the first one, by few paths."""
    combinations = [
        _combination(combination, folder, quick) for combination in (COMBINATIONS[:1] if quick else COMBINATIONS)
    ]
    return [_row(figures) for figures in combinations], {"combinations": combinations}


def _combination(combination: Combination, folder: Path, quick: bool) -> Saved:
    """Predicted and measured drift-off times of all members of a combination; infinite for members that never drift
    off."""
    members = {"noise": _noise, "interpolation": _run_neighbours, "model": _models}[combination.source]
    predicted, measured = members(combination, folder, QUICK_PATHS if quick else PATHS)
    late = [np.inf if time is None else time for time in predicted]
    median, low, high = quantile_with_interval(np.array(measured), 0.5)
    inner = [quantile_with_interval(np.array(measured), level)[0] for level in (0.25, 0.75)]
    source_text = (
        combination.source
        + (f" {combination.size:g} N" if combination.size else "")
        + ("" if combination.interpolation == "linear" else ", held")
    )
    return {
        "name": combination.name,
        "source": source_text,
        "rate": combination.rate,
        "predicted": quantile_with_interval(np.array(late), 0.5)[0],
        "median": median,
        "low": low,
        "high": high,
        "quartiles": inner,
        "members": len(measured),
    }


def _noise(combination: Combination, folder: Path, paths: int) -> tuple[list[float | None], list[float]]:
    """One predicted drift-off time, and the drift-off time of every noise path."""
    true = virtual_drive(folder, combination.duration, 1 / combination.rate, road=combination.road)
    effects = {"force_noise": {"deviation": combination.size, "seed": SEED}}
    scene = force_scene(folder, duration=combination.duration, effects=effects)
    times = run_paths(noise_paths(scene, np.array([]), true["pitch"], UNTRUSTED_PITCH), paths)["drift_off"]
    quiet = assembly_of_scene(force_scene(folder, duration=combination.duration))
    return [noise_error_curve(quiet, combination.size).passing_time()], times.tolist()


def _run_neighbours(combination: Combination, folder: Path, paths: int) -> tuple[list[float | None], list[float]]:
    """Predicted and measured drift-off times on roads that are similar: with other speeds, or with other seeds."""
    speed = combination.road["speed"]
    roads = [
        combination.road | ({"seed": i} if combination.road["source"] == "iso8608" else {"speed": speed * factor})
        for i, factor in enumerate(SPEEDS)
    ]
    predicted, measured = [], []
    for road in roads:
        true = virtual_drive(folder, combination.duration, 1 / combination.rate, STEP, road=road)
        assembly = assembly_of_scene(
            force_scene(folder, step=STEP, duration=combination.duration, interpolation=combination.interpolation)
        )
        predicted.append(interpolation_error_curve(assembly).passing_time())
        measured.append(_drift_off(assembly, true))
    return predicted, measured


def _models(combination: Combination, folder: Path, paths: int) -> tuple[list[float | None], list[float]]:
    """Predicted and measured drift-off times of vehicles with random parameters, all started from the true state."""
    true = virtual_drive(folder, combination.duration, 1 / combination.rate, STEP, road=combination.road)
    assembly = assembly_of_scene(force_scene(folder, step=STEP, duration=combination.duration))
    p, other_vehicles = assembly.parameters, list[Parameters]()
    for i in range(MODELS):
        factors = np.random.Generator(np.random.Philox(key=[SEED, i])).uniform(0.9, 1.1, len(PAPER_FACTORS))
        other_vehicles.append(
            p.model_copy(update=perturbed_parameters(p, dict(zip(PAPER_FACTORS, factors, strict=True))))
        )
    return (
        [model_error_curve(assembly, other_vehicle).passing_time() for other_vehicle in other_vehicles],
        [_drift_off(replace(assembly, parameters=other_vehicle), true) for other_vehicle in other_vehicles],
    )


def _drift_off(assembly: Assembly, true_run: Result) -> float:
    """First time (s) at which the run's pitch differs from the true pitch by UNTRUSTED_PITCH; infinite if it never
    does.
    """
    run = simulate(assembly.scene, "reference", assembly=assembly)
    time = GrowthCurve(run.times, np.abs(run["pitch"] - true_run["pitch"])).passing_time()
    return np.inf if time is None else time


def _row(combination: Saved) -> Row:
    key = f"drift_off.{combination['source']}.{combination['name']}.{combination['rate']:g}Hz".replace(
        " ", "-"
    ).replace(",", "")
    scatter = "{:.1f} to {:.1f} s".format(*combination["quartiles"])
    what = (
        f"drift-off of {combination['name']}, {combination['source']}, {combination['rate']:g} Hz: "
        f"median of {combination['members']} runs "
        f"(half of them {scatter}) over the prediction {combination['predicted']:.2f} s"
    )
    why = f"10 % is asked; the median lies in {combination['low']:.2f} to {combination['high']:.2f} s at 95 %"
    return Observed(key, SYSTEM, what, combination["median"] / combination["predicted"], "").within(
        1.0, 0.1, why, "closed form"
    )


def tables(case_data: Saved) -> list[Table]:
    """All combinations."""
    rows = tuple(
        (
            combination["name"],
            combination["source"],
            f"{combination['rate']:g}",
            f"{combination['predicted']:.2f}",
            f"{combination['median']:.2f}",
            f"{combination['low']:.2f} to {combination['high']:.2f}",
            "{:.1f} to {:.1f}".format(*combination["quartiles"]),
            str(combination["members"]),
            f"{combination['median'] / combination['predicted']:.3f}",
        )
        for combination in case_data["combinations"]
    )
    heads = (
        "road",
        "source",
        "rate [Hz]",
        "predicted [s]",
        "median [s]",
        "its 95 % interval [s]",
        "quartiles [s]",
        "runs",
        "median / prediction",
    )
    note = (
        f"Drift-off: pitch {UNTRUSTED_PITCH} rad from the true one. The prediction of an ensemble is its median, too."
    )
    return [Table("Drift-off, predicted and measured", note, heads, rows)]


def draw(case_data: Saved) -> Drawn:
    """Plot measured over predicted drift-off times."""
    from models.drawing.figures import BLUE, DARK, GREEN, VERMILION, add_heading, subplots

    figure, axis = subplots(figsize=(5.2, 4.2))
    ends = [combination["predicted"] for combination in case_data["combinations"]]
    line = np.array([0.9 * min(ends), 1.1 * max(ends)])
    axis.fill_between(line, 0.9 * line, 1.1 * line, alpha=0.15, color=DARK, linewidth=0, label="within 10 %")
    for source, colour in (("noise", BLUE), ("interpolation", VERMILION), ("model", GREEN)):
        of_source = [
            combination for combination in case_data["combinations"] if combination["source"].startswith(source)
        ]
        if of_source:
            predicted, middle, quartiles = (
                np.array([combination[k] for combination in of_source]) for k in ("predicted", "median", "quartiles")
            )
            spread = np.abs(quartiles.T - middle)
            axis.errorbar(predicted, middle, spread, fmt="o", color=colour, label=source, markersize=4, elinewidth=0.8)
    axis.set(xlabel="predicted before the run [s]", ylabel="measured: median and quartiles [s]")
    axis.legend(loc="upper left")
    add_heading(figure, "Drift-off is known before the run")
    caption = "Time at which the pitch is 0.05 rad off, over roads, speeds, sampling rates and sources of error."
    return [(caption, figure)]
