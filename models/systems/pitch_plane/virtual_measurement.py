"""Virtual measurement: a run on a road, files of its wheel forces and pitch, and scenes that are
driven by these files.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.result import Result
from models.core.time_series import write_time_series
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, build
from models.vehicles.pitch_plane import STATE_NAMES, PitchPlaneParameters

PAPER_FACTORS = {"k3": 1.05, "k4": 0.95, "d3": 0.95, "d4": 1.05, "I": 0.95}
"""Perturbed model of the paper's Appendix B, as factors on the vehicle's parameters."""
FEWEST_SAMPLES = 8
"""Fewest samples of a measurement, as a spline through the measured pitch needs them."""

MEASURING_EFFECTS = ("road", "lift_off")
"""Effects that the run of the virtual measurement may have; the runs on its files have no tyres."""
PRESCRIBED_STATES = {
    "prescribed_heave_and_pitch": ("z3", "z3_rate", "pitch", "pitch_rate"),
    "prescribed_pitch": ("pitch", "pitch_rate"),
}
"""States that an effect prescribes from its file."""

BuildFollower = Callable[[Mapping[str, float], Mapping[str, Any]], Scene]
"""Function that builds a force-excited scene from overrides of vehicle parameters and further effects."""


def perturbed_parameters(
    vehicle_parameters: PitchPlaneParameters, factor_by_parameter: Mapping[str, float] = PAPER_FACTORS
) -> dict[str, float]:
    """Returns the changed parameters by name: each is the value in ``vehicle_parameters`` times its factor."""
    return {name: getattr(vehicle_parameters, name) * factor for name, factor in factor_by_parameter.items()}


def measure(scene: Scene, estimate_error: bool = False) -> Result:
    """Run the vehicle on the road in the reference, with Runge-Kutta 4; estimate_error : whether its error is
    estimated.
    """
    return run(scene, "reference", Settings("RK4", scene.run.step, scene.run.duration), error=estimate_error)


def check_road(scene: Scene, engines: tuple[str, ...], sampling_rate: float) -> None:
    """Raise InputError for a scene that is no virtual measurement, or for which a run on its measured forces is
    impossible.
    """
    for name in scene.effects:
        if name not in MEASURING_EFFECTS:
            allowed = "this study measures on a road and names the effects of the other runs itself: drop it"
            raise InputError(scene.file, f"effects.{name}", None, allowed)
    if "road" not in scene.effects:
        raise InputError(scene.file, "effects.road", None, "is missing: this study measures on a road")
    if scene.run.output_step is not None:
        allowed = "this study makes its table from every step, and chooses the rows that it saves: drop this key"
        raise InputError(scene.file, "run.output_step", scene.run.output_step, allowed)
    steps_per_sample(scene, sampling_rate)
    if scene.run.duration * sampling_rate < FEWEST_SAMPLES:
        allowed = f"must last at least {FEWEST_SAMPLES} samples, {FEWEST_SAMPLES / sampling_rate:g} s"
        raise InputError(scene.file, "run.duration", scene.run.duration, allowed)
    for engine in engines:
        integrator = scene.engines[engine].integrator if engine in scene.engines else None
        if integrator is not None and not CATALOGUE[engine][integrator].constraints:
            allowed = "some runs prescribe the pitch, which this integrator does not solve for: drop this key"
            raise InputError(scene.file, f"engines.{engine}.integrator", integrator, allowed)


def check_steps(scene: Scene, engines: tuple[str, ...]) -> None:
    """Raise InputError for an engine whose time step differs from the measurement's, where runs are compared row by
    row.
    """
    for engine in engines:
        step = scene.settings(engine).step
        if step != scene.run.step:
            allowed = (
                "this study compares runs row by row with the measurement, whose step is run.step = "
                f"{scene.run.step:g} s: drop this key"
            )
            raise InputError(scene.file, f"engines.{engine}.step", step, allowed)


def steps_per_sample(scene: Scene, sampling_rate: float) -> int:
    """Number of time steps of the measurement between samples; raises InputError if it is not whole."""
    ratio = 1.0 / (sampling_rate * scene.run.step)
    if ratio < 0.5 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        allowed = f"the sampling period must be a multiple of run.step = {scene.run.step:g} s"
        raise InputError(scene.file, "options.sampling_rate", sampling_rate, allowed)
    return round(ratio)


def write_wheel_forces(
    output_folder: Path, front_forces: np.ndarray, rear_forces: np.ndarray, sample_period: float
) -> None:
    """Write ``wheel_forces.csv`` with front and rear wheel forces (n,) in N, positive up, every
    ``sample_period`` (s).
    """
    write_time_series(
        output_folder / "wheel_forces.csv", {"front": ("N", front_forces), "rear": ("N", rear_forces)}, sample_period
    )


def write_measurement(measured_run: Result, output_folder: Path, sample_period: float) -> float:
    """Write ``wheel_forces.csv`` and ``pitch.csv`` of a measurement with a sample every ``sample_period`` (s). Returns
    the largest force (N).
    """
    stride = round(sample_period / float(measured_run.times[1] - measured_run.times[0]))
    front, rear, pitch = (measured_run[name][::stride] for name in ("f1", "f2", "pitch"))
    write_wheel_forces(output_folder, front, rear, sample_period)
    write_time_series(output_folder / "pitch.csv", {"pitch": ("rad", pitch)}, sample_period)
    return float(max(np.abs(front).max(), np.abs(rear).max()))


def follower_builder(scene: Scene, measured_folder: Path) -> BuildFollower:
    """Returns a function that builds scenes driven by the measured files in ``measured_folder``; their runs start in
    the state in which the measurement started.
    """
    initial = dict(zip(STATE_NAMES, assembly_of_scene(scene).initial.tolist(), strict=True))
    parameters = scene.vehicle_parameters().model_dump()

    def follow(parameter_override: Mapping[str, float], effects: Mapping[str, Any]) -> Scene:
        prescribed = next((states for effect, states in PRESCRIBED_STATES.items() if effect in effects), ())
        table = {
            "title": scene.title,
            "vehicle": {"geometry": scene.vehicle.geometry, "override": {**parameters, **parameter_override}},
            "run": {"duration": scene.run.duration, "step": scene.run.step},
            "start": {name: value for name, value in initial.items() if name not in prescribed},
            "engines": {name: settings.model_dump(exclude_unset=True) for name, settings in scene.engines.items()},
            "effects": {"wheel_forces": {"file": "wheel_forces.csv", "interpolation": "linear"}, **effects},
        }
        return build(table, scene.file, measured_folder)

    return follow
