"""Run of a pitch-plane scene in an engine, and its result."""

import json
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.discretisation import (
    FINE_WINDOW,
    RunSeries,
    reference_size,
    with_estimated_errors,
    with_tolerance_error,
)
from models.core.errors import InputError, RunFailed
from models.core.result import Channel, Result, result
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Channels, Settings
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES
from models.engines.model import Model
from models.engines.protocol import build
from models.systems.pitch_plane.assumptions import assumptions, principal_channels
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, settings_of
from models.vehicles.pitch_plane import STATES
from models.vehicles.pitch_plane_equations import suspension_loads

MEANINGS_OF_STATES = ("front wheel, down", "rear wheel, down", "chassis heave, down", "pitch, nose up")
"""Meanings of the coordinates in STATES."""
TOLERANCE_FACTOR = 100.0
"""Factor on the tolerance of an adaptive method in the further run that estimates its error; that run takes 0.56 of the
calls of a method of order 8.
"""


def run(
    scene: Scene, engine: str, settings: Settings | None = None, assembly: Assembly | None = None, error: bool = False
) -> Result:
    """Run a pitch-plane scene in an engine; the result's detail is the trajectory at every step. Raises InputError,
    Refused or RunFailed, never returns a partial run.

    settings : in place of the scene's; assembly : in place of the scene's, where it is known already or
    was changed by hand; error : whether the error of the time steps is estimated, by further runs. Assumptions are
    always checked. A run of an engine outside of this package is compared with the reference; the comparison is in
    "beside reference".
    """
    assembly, settings = (assembly or assembly_of_scene(scene), settings or settings_of(scene, engine))
    rows = slice(None, None, _steps_per_saved_row(scene, settings))
    model = build(engine, assembly, settings)
    start = time.perf_counter()
    trajectory = model.run()
    seconds = time.perf_counter() - start
    channels, comparison_texts = output_channels(assembly, trajectory, model), dict[str, str]()
    if engine in OUTSIDE_CLASSES:
        from models.engines.outside import beside_reference

        comparison_texts["beside reference"] = beside_reference(engine, assembly, settings, trajectory)
    labelled = result(
        scene,
        {name: Channel("time", values[rows], unit, meaning) for name, (unit, meaning, values) in channels.items()},
        {"time": Channel("time", trajectory.times[rows], "s", "time")},
        engine=engine,
        counts=trajectory.counts,
        seconds=seconds,
        doubts=assembly.doubts,
        detail=trajectory,
        mode=assembly.mode,
        integrator=settings.integrator,
        step=settings.step,
        integrated=json.dumps(STATES),
        **comparison_texts,
    )
    with_assumptions(labelled, assumptions(assembly))
    return _with_error(labelled, assembly, settings, channels) if error else labelled


def run_with_drift(scene: Scene, engine: str, estimate_error: bool = False) -> Result:
    """Run a scene of a vehicle that may drift off: a result whose error is as large as its motion is returned. Raises
    RunFailed only where a run has no result.
    """
    try:
        return run(scene, engine, error=estimate_error)
    except RunFailed as failure:
        if failure.partial is None:
            raise
        return failure.partial


def _with_error(
    run_result: Result, vehicle_assembly: Assembly, solver_settings: Settings, output_channels_of_run: Channels
) -> Result:
    """Returns the result with the stated errors of its principal channels, estimated from all steps and not only from
    the saved rows.
    """
    engine, names = run_result.data.attrs["engine"], principal_channels(vehicle_assembly)
    fine, sizes = (
        _series_of_run(run_result.detail.times, output_channels_of_run, names),
        _enforced_sizes(vehicle_assembly, output_channels_of_run),
    )
    method = CATALOGUE[engine][solver_settings.integrator]

    def rerun(changed_settings: Settings) -> RunSeries:
        trajectory = build(engine, vehicle_assembly, changed_settings).run()
        return _series_of_run(
            trajectory.times, output_channels(replace(vehicle_assembly, sensors=()), trajectory), names
        )

    if method.adaptive:
        looser = _with_longer_engine_step(
            rerun, replace(solver_settings, tolerance=TOLERANCE_FACTOR * solver_settings.tolerance)
        )
        return with_tolerance_error(run_result, fine, looser, TOLERANCE_FACTOR, solver_settings.tolerance, sizes)

    def longer(step_factor: float, run_share: float) -> RunSeries:
        return rerun(_settings_of_longer_step(solver_settings, step_factor, run_share))

    return with_estimated_errors(
        run_result,
        fine,
        longer,
        method.order,
        solver_settings.step,
        error_growth=_pitch_error_growth(vehicle_assembly),
        channel_sizes=sizes,
    )


def _with_longer_engine_step(
    run_with_settings: Callable[[Settings], RunSeries], solver_settings: Settings
) -> RunSeries:
    """Repeats a run with the engine's longest step doubled as well, where the input allows it: this step may dominate
    the error.
    """
    try:
        return run_with_settings(replace(solver_settings, step=2.0 * solver_settings.step))
    except InputError:
        return run_with_settings(solver_settings)


def _series_of_run(times: np.ndarray, run_channels: Channels, channel_names: tuple[str, ...]) -> RunSeries:
    """Time series of the named channels of a run."""
    return RunSeries(times, {name: run_channels[name][2] for name in channel_names})


def _enforced_sizes(vehicle_assembly: Assembly, run_channels: Channels) -> dict[str, float]:
    """Sizes by which errors of the enforced moment and force are divided, as these may be zero: the chassis' inertia
    term (N m), and the sum of the suspension forces (N).
    """
    sizes = {}
    if "enforced_moment" in run_channels:
        sizes["enforced_moment"] = reference_size(run_channels["inertia_term"][2])
    if "enforced_force" in run_channels:
        sizes["enforced_force"] = reference_size(run_channels["f3"][2] + run_channels["f4"][2])
    return sizes


def _pitch_error_growth(vehicle_assembly: Assembly) -> dict[str, float]:
    """Ratio of the rms pitch error over a run to the rms pitch error over its first part, for vehicles under wheel
    forces, whose pitch error grows; else empty.
    """
    if (
        vehicle_assembly.mode != "force"
        or vehicle_assembly.vehicle.geometry == "linear"
        or vehicle_assembly.vehicle.pitch_springs
    ):
        return {}
    from models.drift.growth import pitch_variance
    from models.systems.pitch_plane.trust import pitch_error_growth

    forces = pitch_error_growth(vehicle_assembly)
    grown = np.asarray(pitch_variance(forces.times, forces.sinh_rate, 1.0))
    rows_of_part = max(2, round(FINE_WINDOW * len(grown)))
    return {"pitch": float(np.sqrt(np.mean(grown) / np.mean(grown[:rows_of_part])))}


def _settings_of_longer_step(solver_settings: Settings, step_factor: float, run_share: float) -> Settings:
    """Returns settings with a step ``step_factor`` times as long, over the first ``run_share`` of the run, rounded down
    to whole steps, at least one."""
    step = step_factor * solver_settings.step
    return replace(
        solver_settings,
        step=step,
        duration=step * max(1, math.floor(run_share * solver_settings.duration / step + 1e-9)),
    )


def _steps_per_saved_row(scene: Scene, solver_settings: Settings) -> int:
    """Number of time steps between saved rows; raises InputError if run.output_step is no multiple of the step."""
    wanted = scene.run.output_step
    if wanted is None:
        return 1
    ratio = wanted / solver_settings.step
    if ratio < 0.5 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        raise InputError(
            scene.file, "run.output_step", wanted, f"must be a multiple of the step {solver_settings.step:g} s"
        )
    return round(ratio)


def output_channels(vehicle_assembly: Assembly, trajectory: Trajectory, engine_model: Model | None = None) -> Channels:
    """Returns all channels of a run as name -> (unit, meaning, values): states, forces, and channels of effects.

    engine_model : the model that made the run; effects that need accelerations compute them with it.
    """
    channels: Channels = {}
    for i, (name, meaning) in enumerate(zip(STATES, MEANINGS_OF_STATES, strict=True)):
        unit = "rad" if name == "pitch" else "m"
        channels[name] = (unit, meaning, trajectory.states[:, i])
        channels[f"{name}_rate"] = (f"{unit}/s", f"rate of {meaning}", trajectory.states[:, 4 + i])
    channels |= _force_channels(vehicle_assembly, trajectory, _inputs_at_times(vehicle_assembly, trajectory.times))
    for output in vehicle_assembly.outputs:
        channels |= output(vehicle_assembly, trajectory.times, trajectory.states)
    for sensor in vehicle_assembly.sensors:
        assert engine_model is not None
        channels |= sensor(vehicle_assembly, trajectory, engine_model)
    return channels


def _inputs_at_times(vehicle_assembly: Assembly, times: np.ndarray) -> np.ndarray | None:
    """Values of the vehicle's input (road or wheel forces, prescribed motion) at times (n,) in s;
    None for free motion.
    """
    if vehicle_assembly.input is None:
        return None
    step = times[1] - times[0]
    if np.allclose(np.diff(times), step, rtol=1e-6, atol=0):
        return vehicle_assembly.input.sample(0.0, float(step), len(times))
    return np.array([vehicle_assembly.input.at(time) for time in times])


def _force_channels(vehicle_assembly: Assembly, trajectory: Trajectory, input_values: np.ndarray | None) -> Channels:
    """Channels of wheel forces f1, f2, suspension forces f3, f4 and suspension moment; road heights, enforced force and
    moment, and inertia term where the run has them (eqs 33, 35, 36).
    """
    f1, f2 = _wheel_forces(vehicle_assembly, trajectory.states, input_values)
    f3, f4, moment = suspension_loads(
        trajectory.states.T, vehicle_assembly.parameters, vehicle_assembly.vehicle.geometry
    )
    channels: Channels = {
        "f1": ("N", "front wheel force, up", f1),
        "f2": ("N", "rear wheel force, up", f2),
        "f3": ("N", "front suspension force, compression", f3),
        "f4": ("N", "rear suspension force, compression", f4),
        "suspension_moment": ("N m", "pitch moment of the suspension on the chassis, nose up", moment),
    }
    if vehicle_assembly.mode == "road" and input_values is not None:
        channels["zeta1"] = ("m", "road under the front wheel, down", input_values[:, 0])
        channels["zeta2"] = ("m", "road under the rear wheel, down", input_values[:, 1])
    if trajectory.force is not None:
        channels["enforced_force"] = (
            "N",
            "force on the chassis, down, that the prescribed heave takes",
            trajectory.force,
        )
    if trajectory.moment is not None and input_values is not None:
        channels["inertia_term"] = ("N m", "I beta''", vehicle_assembly.parameters.I * input_values[:, -1])
        channels["enforced_moment"] = ("N m", "moment, nose up, that the prescribed pitch takes", trajectory.moment)
    return channels


def _wheel_forces(
    vehicle_assembly: Assembly, states: np.ndarray, input_values: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Front and rear wheel force (n,) in N, positive up, from states and inputs."""
    p = vehicle_assembly.parameters
    if vehicle_assembly.mode not in ("free", "road"):
        assert input_values is not None
        return input_values[:, 0], input_values[:, 1]
    u = np.zeros((len(states), 4)) if input_values is None else input_values
    pressed = np.array([p.k1, p.k2]) * (states[:, :2] - u[:, :2])
    forces = pressed + np.array([p.d1, p.d2]) * (states[:, 4:6] - u[:, 2:])
    if any(tyre.pushes_only for tyre in vehicle_assembly.vehicle.tyres):
        forces = np.maximum(np.minimum(forces, 2.0 * pressed), 0.0)
    return forces[:, 0], forces[:, 1]


def channel_summary(result: Result) -> dict[str, Any]:
    """Largest magnitude and root mean square of every channel of a result, with its unit."""
    return {
        str(name): {
            "unit": channel.attrs["units"],
            "max": float(np.abs(channel.values).max()),
            "rms": float(np.sqrt(np.mean(channel.values**2))),
        }
        for name, channel in result.data.data_vars.items()
    }
