"""A scene of hub forces in an engine: what its transducers say, what holds roll and pitch, and the run that follows.

A run reads its road or its forces at half steps. What changes faster between them is not resolved but mistaken for
something slower, which no state of the run shows: a run in other steps does.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.discretisation import Estimate, Series, not_estimated, step_errors, summed_error, with_stated_errors
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.signals import Smooth
from models.core.smoothing import low_passed
from models.core.steps import divides
from models.engines.assembly import Settings
from models.engines.cut_vehicle import ForceRoute, HubModel, HubRun, build
from models.engines.error_control import NO_ESTIMATE
from models.multibody.cut_table import HubInputs
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.assumptions import ON_TYRES, assumptions
from models.systems.hub_forces.measurement import Angles, HubForces, recorded_measurement, two_tracks
from models.systems.hub_forces.scene import Frame, HubScene, Method, Road
from models.vehicles.cut_vehicle import ANGLES, PITCH, ROLL, CutVehicle, X, Y, Z

if TYPE_CHECKING:
    from models.systems.hub_forces.tilt_filter import Tilt

TOLD_ORDERS, LIFTING_ORDER = 4.0, 3.0
"""Orders that errors are told by: of the classical Runge-Kutta method, and where wheels leave the road and land. Still
longer steps would tell less than these: waves of the road have few of them."""
REPEATED_PART_START = 0.4
"""Share of a run after which a part of it is repeated, where no longer step can be."""
LEAST_CHANGE_SHARE = 1e-3
"""Share of the largest change of any force, moment or angle below which another one carries nothing."""
STANDSTILL_CHANGE = 1e-6
"""rad, and share of the largest force, below which a change is rounding."""
MOTION_CHANNELS = {name: (column, "rad") for name, column in ANGLES.items()} | {
    "x": (X, "m"),
    "y": (Y, "m"),
    "z": (Z, "m"),
}
"""Channels of the chassis: its coordinate, and the unit of that."""


@dataclass(frozen=True)
class Measurement:
    """Measurement that drives the runs of a scene: hub forces and angles, and the true run, None where they come from
    files.

    errors : of the steps of the true run, where they were requested.
    """

    scene: HubScene
    vehicle: CutVehicle
    truth: HubRun | None
    forces: HubForces
    angles: Angles
    errors: dict[str, Estimate] = field(default_factory=dict)

    @cached_property
    def tilt(self) -> "Tilt":
        """The Kalman filter's estimate of roll and pitch; InputError where the measurement contradicts itself."""
        from models.systems.hub_forces.tilt_filter import Deviations, estimate

        scene = self.scene
        deviations = Deviations(scene.deviations(self.vehicle), scene.angles.deviations, scene.stabilise.model)
        return estimate(self.vehicle, self.forces, self.angles, deviations, scene.file)

    def hub_inputs(self, method: Method, step: float, steps: int) -> HubInputs:
        """Measured inputs for a run of ``steps`` steps of ``step`` (s); ``method`` holds roll and pitch.

        Raises InputError.
        """
        scene, free = self.scene, self.forces.hub_inputs(step, steps, self.scene.forces.interpolation)
        if method == "kalman":
            from models.systems.hub_forces.tilt_filter import inputs_with_moments

            return inputs_with_moments(free, self.vehicle, self.tilt, step, scene.stabilise.bandwidth)
        if method == "prescribed":
            return enforced_inputs(free, self.angles, step, scene.stabilise.smoothing, scene.file)
        return free

    def start(self, hub_inputs: HubInputs) -> np.ndarray:
        """Initial state (2 n,): at rest in the design position; enforced roll and pitch begin with the values of their
        file.
        """
        n = self.vehicle.size
        start = np.zeros(2 * n)
        if hub_inputs.guide is not None and hub_inputs.pull is None:
            start[[ROLL, PITCH, n + ROLL, n + PITCH]] = hub_inputs.guide[0, :4]
        return start


def enforced_inputs(hub_inputs: HubInputs, angles: Angles, step: float, smoothing: float, file: str = "") -> HubInputs:
    """Hub inputs with measured roll and pitch enforced, after a low-pass of ``smoothing`` (Hz); raises InputError."""
    quiet = low_passed(angles.samples[:, :2], angles.period, smoothing, file, "stabilise.smoothing")
    return with_angles(hub_inputs, quiet, angles.period, step)


def with_angles(hub_inputs: HubInputs, angles: np.ndarray, sample_period: float, step: float) -> HubInputs:
    """Hub inputs with enforced roll and pitch (m, 2), rad, interpolated by a quintic spline through the samples."""
    motion = Smooth(angles, sample_period, derivatives=2, degree=5)
    return replace(hub_inputs, guide=motion.sample(0.0, step / 2, len(hub_inputs.hubs)))


def measure(scene: HubScene, engine: str, error: bool = False) -> Measurement:
    """The transducers' measurement: from files, or from a run on the road with noise added.

    error : whether the error of the steps of that run is estimated, by further runs.
    """
    vehicle, road, step = scene.cut_vehicle(), scene.road, scene.run.step
    if road is None:
        return Measurement(scene, vehicle, None, *scene.measured(vehicle))
    march = (engine, scene.settings(engine), scene.run.forces)
    true, errors = on_road(vehicle, road, scene.forces.frame, march, error and engine not in scene.engines)
    forces, angles = recorded_measurement(true, scene.forces.frame, round(1.0 / (scene.forces.sampling_rate * step)))
    if scene.forces.noise == "white":
        forces = forces.noisy(scene.deviations(vehicle), scene.seed)
    if scene.angles.noise == "white":
        angles = angles.noisy(scene.angles.deviations, scene.seed)
    return Measurement(scene, vehicle, true, forces, angles, errors)


def on_road(
    vehicle: CutVehicle, road: Road, frame: Frame, march_choice: tuple[str, Settings, ForceRoute], error: bool = False
) -> tuple[HubRun, dict[str, Estimate]]:
    """Run the vehicle on its tyres over a road. Returns the run, with hub forces in a frame, and its errors if they are
    requested.

    march_choice : engine, its integrator with step and duration, and the route by which the springs' forces are
    computed.
    """
    engine, settings, kind = march_choice
    left, right = (iso8608_road(road.iso8608, road.seed + i) for i in range(2))

    def hub_inputs(step: float, steps: int) -> HubInputs:
        return replace(two_tracks(vehicle, left, right, road.speed, step, steps), frame=frame)

    true = HubModel(engine, vehicle, hub_inputs(settings.step, settings.steps), settings, kind).run()
    return true, errors_of_steps(engine, vehicle, true, hub_inputs, forces=kind)[0] if error else {}


def errors_of_steps(
    engine: str,
    vehicle: CutVehicle,
    run: HubRun,
    hub_inputs: Callable[[float, int], HubInputs],
    sample_period: float = 0.0,
    forces: ForceRoute = "compiled",
) -> tuple[dict[str, Estimate], str]:
    """Estimated errors of the channels that ``principal_series`` lists, by name, and the method of the estimate.

    hub_inputs : function of a step (s) and a number of steps; sample_period : of its samples (s), 0 for none: longer
    steps must divide it, or they would take the samples' noise for motion; forces : route by which the springs' are
    computed.
    """
    step, steps = float(run.times[1]), len(run.times) - 1

    def rerun(factor: float, share: float) -> Series:
        tried_step, count = factor * step, max(1, int(share * steps / factor + 1e-9))
        if factor > 2.0 or (factor > 1.0 and sample_period and not divides(tried_step, sample_period)):
            raise InputError(
                "", "run.step", tried_step, "is not taken: longer steps must divide the period of the samples"
            )
        row = 0 if factor > 1.0 else round(min(REPEATED_PART_START, 1.0 - share) * steps)  # a road begins gently
        first = round(row / factor)
        inputs = hub_inputs(tried_step, first + count)
        guide = None if inputs.guide is None else inputs.guide[2 * first :]
        inputs_of_part = replace(inputs, hubs=inputs.hubs[2 * first :], guide=guide)
        path = build(engine, vehicle, inputs_of_part, tried_step, count * tried_step, forces).run(
            run.positions[row], run.rates[row]
        )
        return principal_series(vehicle, path, first * tried_step)

    fine, units = principal_series(vehicle, run), dict.fromkeys(("roll", "pitch"), "rad")
    units |= {element.name: element.unit for element in vehicle.elements}
    order = LIFTING_ORDER if vehicle.uncut.lifts else TOLD_ORDERS
    estimates, method_text = step_errors(
        fine._replace(channels=_moving_channels(fine.channels, units)), rerun, order, step
    )
    return {
        name: replace(channel_estimate, unit=units[name]) for name, channel_estimate in estimates.items()
    }, method_text


def principal_series(vehicle: CutVehicle, run: HubRun, start_time: float = 0.0) -> Series:
    """Channels whose error is estimated, over the time of a run that begins at ``start_time`` (s): forces of all
    elements, roll and pitch.
    """
    channels = {element.name: run.elements[:, i] for i, element in enumerate(vehicle.elements)}
    return Series(start_time + run.times, channels | {"roll": run.states[:, ROLL], "pitch": run.states[:, PITCH]})


def _moving_channels(channels: Mapping[str, np.ndarray], units: Mapping[str, str]) -> dict[str, np.ndarray]:
    """Channels that vary by more than a small share of the variation of the largest channel with the same unit."""
    change = {name: float(np.std(values)) for name, values in channels.items()}
    largest_by_unit = {
        unit: max(change[name] for name in change if units[name] == unit) for unit in set(units.values())
    }
    largest = max((float(np.abs(channels[name]).max()) for name in channels if units[name] == "N"), default=0.0)
    still = {"rad": STANDSTILL_CHANGE, "N": STANDSTILL_CHANGE * largest, "N m": STANDSTILL_CHANGE * largest}
    return {
        name: values
        for name, values in channels.items()
        if change[name] > max(LEAST_CHANGE_SHARE * largest_by_unit[units[name]], still[units[name]])
    }


def run(
    scene: HubScene,
    engine: str,
    method: Method | None = None,
    measurement: Measurement | None = None,
    error: bool = False,
) -> Result:
    """Run the cut vehicle under its hub forces; the result's detail is the HubRun. Raises InputError, Refused,
    RunFailed.

    method : what holds roll and pitch, the scene's own where none is named; measurement : of the scene, where it was
    made before, as for runs in several engines; else this engine makes it. error : whether the error of the steps is
    estimated, by further runs, on top of that of the measurement.
    """
    measurement, method = measurement or measure(scene, engine, error), method or scene.stabilise.method
    hub_inputs = measurement.hub_inputs(method, scene.run.step, scene.steps)
    kind = scene.forces_with(method)
    model = HubModel(engine, measurement.vehicle, hub_inputs, scene.settings(engine), kind)
    start_time = time.process_time()
    path = model.run(*np.split(measurement.start(hub_inputs), 2))
    seconds = time.process_time() - start_time
    result = labelled_result(measurement, path, engine, method, seconds)
    if not error:
        return result
    if engine in scene.engines:
        return not_estimated(result, NO_ESTIMATE)
    vehicle, period = measurement.vehicle, measurement.forces.period
    estimates, method_text = errors_of_steps(
        engine, vehicle, path, partial(measurement.hub_inputs, method), period, kind
    )
    if (
        measurement_errors := measurement.errors
    ):  # in roll and pitch moments that are measured wrong add up: nobody can tell by how much
        estimates = {
            name: summed_error(estimates[name], measurement_errors[name])
            for name in estimates
            if name in measurement_errors and name not in ANGLES
        }
    return with_stated_errors(result, estimates, method_text)


def labelled_result(
    measurement: Measurement, path: HubRun, engine: str, method: str = ON_TYRES, seconds: float = 0.0
) -> Result:
    """The result of a run of the measurement's vehicle: chassis motion, section forces, and the moments that hold roll
    and pitch.
    """
    channels = {name: Channel("time", path.states[:, column], unit) for name, (column, unit) in MOTION_CHANNELS.items()}
    channels |= {
        "section_force": Channel(("time", "element"), path.elements, "N", "compression; of bars a moment, N m"),
        "holding_moment": Channel(("time", "held"), path.moments, "N m", "of the stabiliser on roll and pitch"),
    }
    axes = {
        "time": Channel("time", path.times, "s"),
        "element": Channel("element", [element.name for element in measurement.vehicle.elements]),
        "held": Channel("held", ["roll", "pitch"]),
    }
    labelled = result(
        measurement.scene,
        channels,
        axes,
        engine=engine,
        counts=path.counts | {"states": path.states.shape[1]},
        seconds=seconds,
        doubts=measurement.tilt.objections if method == "kalman" else (),
        detail=path,
        method=method,
    )
    return with_assumptions(labelled, assumptions(measurement.scene, measurement.vehicle, method, measurement.angles))
