"""Stated errors of random runs of the pitch-plane vehicle: every integrator, roads, tyres that lift off, wheel forces
and stabilisers, in steps from very fine to the longest stable. The true solution is the reference in Runge-Kutta steps
a hundredth as long, which shares no integrator with the engines."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.interpolate import CubicSpline

from models.core.discretisation import error_estimates_of
from models.core.errors import RunFailed
from models.core.result import Result
from models.core.steps import step_divides
from models.core.time_series import write_time_series
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE, UNAVAILABLE_INTEGRATORS
from models.systems.pitch_plane import run as single
from models.systems.pitch_plane.scene import Scene, build, parameter_set, settings_of
from models.systems.pitch_plane.virtual_measurement import measure, write_measurement
from validation.stated_errors.sample import Sample, random_samples

FINER_STEPS, FINEST_STEP = 100, 2e-6
"""Ratio of the run's step to that of the true solution, and shortest step (s) of a true solution, which is taken for
runs by adaptive methods."""
SAMPLING_PERIODS = (1e-3, 2e-3, 5e-3)
"""Sampling periods (s) of measured wheel forces and pitch."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random runs of the pitch-plane vehicle; scenes that an engine refuses are
    replaced."""
    with TemporaryDirectory() as folder:
        yield from random_samples(sample_count, [seed, 1], lambda generator: _sample_of_run(generator, Path(folder)))


def _sample_of_run(generator: np.random.Generator, scene_folder: Path) -> Sample:
    """Sample from a random run; raises for an unstable step, and for an interpolation that the method cannot use."""
    engine = str(generator.choice(["reference", "exudyn", "mujoco"]))
    known = [name for name in CATALOGUE[engine] if (engine, name) not in UNAVAILABLE_INTEGRATORS]
    integrator = str(generator.choice(known))
    scene = _random_scene(generator, scene_folder, engine, integrator)
    with _count_force_calls() as calls:
        run = _run_with_error(scene, engine)
    truth = _reference_run(scene, engine)
    estimates = error_estimates_of(run)
    true = {name: float(np.sqrt(np.mean((run[name] - _truth_at(truth, name, run.times)) ** 2))) for name in estimates}
    settings = settings_of(scene, engine)
    fine = f"tolerance {settings.tolerance:.1e}" if CATALOGUE[engine][integrator].adaptive else f"{settings.step:.3g} s"
    sample_name = " ".join((*scene.effects, scene.vehicle.geometry, integrator, fine))
    return Sample(sample_name, engine, estimates, true, calls[0], sum(calls[1:]))


def _run_with_error(scene: Scene, engine: str) -> Result:
    try:
        return single.run(scene, engine, error=True)
    except RunFailed as failure:
        if failure.partial is None:
            raise
        return failure.partial


def _reference_run(scene: Scene, engine: str) -> Result:
    """Result of the reference with fine steps, which divide the steps of the scene."""
    settings = settings_of(scene, engine)
    step, adaptive = settings.step, CATALOGUE[engine][settings.integrator].adaptive
    finer = max(1, round(step / FINEST_STEP if adaptive else min(FINER_STEPS, step / FINEST_STEP)))
    return single.run(scene, "reference", Settings("RK4", step / finer, scene.run.duration))


def _truth_at(true_result: Result, channel_name: str, times: np.ndarray) -> np.ndarray:
    """Channel of the true solution at times (n,) in s: its rows, or a cubic spline if the times lie between them."""
    rows = np.clip(np.searchsorted(true_result.times, times - 1e-9), 0, len(true_result.times) - 1)
    if np.abs(true_result.times[rows] - times).max() < 1e-9:
        return true_result[channel_name][rows]
    return CubicSpline(true_result.times, true_result[channel_name])(times)


@contextmanager
def _count_force_calls() -> Iterator[list[float]]:
    """Context that yields a list, to which every run within it adds its number of force calls."""
    calls: list[float] = []
    build_model = single.build

    def counting(*build_arguments: Any) -> Any:
        model = build_model(*build_arguments)
        march = model.run

        def run() -> Any:
            trajectory = march()
            calls.append(float(trajectory.counts["force calls"]))
            return trajectory

        setattr(model, "run", run)  # noqa: B010
        return model

    with patch.object(single, "build", counting):
        yield calls


def _random_scene(generator: np.random.Generator, scene_folder: Path, engine: str, integrator_name: str) -> Scene:
    table: dict[str, Any] = {
        "title": "random",
        "vehicle": {
            "geometry": str(generator.choice(["exact", "exact", "linear"])),
            "override": _random_parameters(generator),
        },
        "effects": {},
        "run": {"duration": float(generator.choice([1.0, 2.0, 3.0]))},
    }
    tolerance = (
        {"tolerance": float(10.0 ** generator.uniform(-11, -4))} if CATALOGUE[engine][integrator_name].adaptive else {}
    )
    table["engines"] = {engine: {"integrator": integrator_name, **tolerance}}
    kind = str(generator.choice(["free", "road", "road", "road", "forces", "forces"]))
    if kind == "free":
        table["start"] = {"pitch": float(generator.uniform(-0.1, 0.1)), "z3": float(generator.uniform(-0.1, 0.1))}
        table["effects"] = _random_lift_off(generator)
    elif kind == "road":
        table["effects"] = {"road": _random_road(generator, scene_folder), **_random_lift_off(generator)}
    else:
        table["effects"] = _random_force_effects(generator, scene_folder, table)
    period = table.pop("period", None)
    table["run"]["step"] = _random_step(generator, table["run"]["duration"], period)
    return build(table, "random.toml", scene_folder)


def _random_parameters(generator: np.random.Generator) -> dict[str, float]:
    """Random parameters of a published vehicle by name: factors from 0.6 to 1.6, suspension dampers down to a tenth."""
    p = parameter_set(str(generator.choice(["itwm_drift", "asymmetric_twin"])), "", Path())
    softer = float(generator.choice([1.0, 0.3, 0.1]))
    return {
        name: value * float(2.0 ** generator.uniform(-0.7, 0.7)) * (softer if name in ("d3", "d4") else 1.0)
        for name, value in p
        if name != "g"
    }


def _random_lift_off(generator: np.random.Generator) -> dict[str, Any]:
    return {"lift_off": {}} if generator.random() < 0.5 else {}


def _random_road(generator: np.random.Generator, scene_folder: Path) -> dict[str, Any]:
    speed = float(generator.uniform(5.0, 35.0))
    source = str(generator.choice(["study", "hills", "iso8608", "csv"]))
    options: dict[str, Any] = {}
    if source == "iso8608":
        options = {"road_class": str(generator.choice(list("ABCDE"))), "seed": int(generator.integers(1000))}
    if source == "csv":
        spacing = float(generator.choice([0.01, 0.05, 0.2]))
        stations = spacing * np.arange(round(20.0 / spacing) + 1)
        heights = np.cumsum(generator.normal(0.0, 0.01 * np.sqrt(spacing), len(stations)))
        lines = [f"{s:.3f}, {h:.6f}, {h:.6f}" for s, h in zip(stations, heights - heights[0], strict=True)]
        (scene_folder / "road.csv").write_text("\n".join(["s [m], left [m], right [m]", *lines]) + "\n")
        options = {"file": "road.csv", "beyond_end": "mirrored"}
    return {"source": source, "speed": speed, **options}


def _random_force_effects(
    generator: np.random.Generator, scene_folder: Path, scene_table: dict[str, Any]
) -> dict[str, Any]:
    """Table of effects: wheel forces from a virtual measurement, sometimes with noise, often with a random
    stabiliser."""
    period, duration = float(generator.choice(SAMPLING_PERIODS)), scene_table["run"]["duration"]
    road = {"source": "study", "speed": float(generator.uniform(8.0, 25.0))}
    on_road = build(
        {
            **{key: scene_table[key] for key in ("title", "vehicle")},
            "run": {"duration": duration, "step": 2e-4},
            "effects": {"road": road, "lift_off": {}},
        },
        "measured.toml",
    )
    measured = measure(on_road)
    write_measurement(measured, scene_folder, period)
    stride = round(period / 2e-4)
    both_columns = {"z3": ("m", measured["z3"][::stride]), "pitch": ("rad", measured["pitch"][::stride])}
    write_time_series(scene_folder / "both.csv", both_columns, period)
    scene_table["period"] = period
    rule = str(generator.choice(["held", "linear", "smooth"]))
    forces = {"file": "wheel_forces.csv", "interpolation": rule, "frame": str(generator.choice(["inertial", "body"]))}
    noise = (
        {"force_noise": {"deviation": 30.0, "seed": int(generator.integers(1000))}} if generator.random() < 0.5 else {}
    )
    holds: tuple[dict[str, Any], ...] = (
        {},
        {"pitch_spring": {"stiffness": 3e3, "damping": 1e3, "dead_band": float(generator.choice([0.0, 0.01]))}},
        {"high_pass": {"cut_off": 0.3}},
        {"prescribed_pitch": {"file": "pitch.csv", "bandwidth": 10.0}},
        {"prescribed_heave_and_pitch": {"file": "both.csv", "bandwidth": 10.0}},
        {"kalman_filter": {"file": "pitch.csv", "force_deviation": 50.0, "pitch_deviation": 2e-3}},
    )
    return {"wheel_forces": forces, **noise, **holds[int(generator.integers(len(holds)))]}


def _random_step(generator: np.random.Generator, duration: float, sample_period: float | None) -> float:
    """Random step (s) from 20 microseconds to 8 ms that divides the duration and the sampling period."""
    wanted = float(np.exp(generator.uniform(np.log(2e-5), np.log(8e-3))))
    divided_time = duration if sample_period is None else sample_period
    step = divided_time / max(1, round(divided_time / wanted))
    assert step_divides(step, duration)
    return step
