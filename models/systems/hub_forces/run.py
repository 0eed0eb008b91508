"""Runs of a hub forces scene in an engine: the measurement, the stabiliser of roll and pitch, the run and its errors.

A run reads its road or its forces at half steps. Faster changes between these are aliased. No state of a single run
shows this; a run in other steps does.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.discretisation import Estimate, RunSeries, not_estimated, step_errors, summed_error, with_stated_errors
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.signals import Smooth
from models.core.smoothing import low_passed
from models.core.steps import step_divides
from models.engines.assembly import Settings
from models.engines.cut_vehicle import ForceRoute, HubModel, HubRun, build
from models.engines.error_control import NO_ESTIMATE
from models.multibody.cut_table import HubInputs
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.assumptions import RUN_ON_TYRES, assumptions
from models.systems.hub_forces.measurement import HubForces, MeasuredAngles, recorded_measurement, road_under_wheels
from models.systems.hub_forces.scene import ForceFrame, HubScene, StabiliserMethod, TwoTrackRoadTable
from models.vehicles.cut_vehicle import ANGLES, PITCH, ROLL, CutVehicle, X, Y, Z

if TYPE_CHECKING:
    from models.systems.hub_forces.tilt_filter import TiltEstimate

STEP_ERROR_ORDER, LIFTING_ORDER = 4.0, 3.0
"""Orders of convergence by which step errors are estimated: that of the classical Runge-Kutta method, and the lower one
where wheels leave the road and land. Steps longer than twice are not used: they resolve too few points of the road's
waves."""
REPEATED_PART_START = 0.4
"""Share of a run after which part of it is repeated in half the step, where a longer step is impossible."""
LEAST_CHANGE_SHARE = 1e-3
"""Variation of a channel, divided by the largest variation of the same unit, below which it has no stated error."""
STANDSTILL_CHANGE = 1e-6
"""Variation below which a channel is only rounding: rad, and share of the largest force."""
MOTION_CHANNELS = {name: (column, "rad") for name, column in ANGLES.items()} | {
    "x": (X, "m"),
    "y": (Y, "m"),
    "z": (Z, "m"),
}
"""Channels of the chassis' motion: index of the coordinate, and unit."""


@dataclass(frozen=True)
class HubMeasurement:
    """Hub forces and angles that drive the runs of a scene. truth : the true run on tyres; None where files are
    measured.

    errors : errors of the time steps in the true run, where they were requested.
    """

    scene: HubScene
    vehicle: CutVehicle
    truth: HubRun | None
    forces: HubForces
    angles: MeasuredAngles
    errors: dict[str, Estimate] = field(default_factory=dict)

    @cached_property
    def tilt(self) -> "TiltEstimate":
        """The Kalman filter's estimate of roll and pitch. Raises InputError where angles and forces contradict each
        other.
        """
        from models.systems.hub_forces.tilt_filter import StatedDeviations, estimate_tilt

        scene = self.scene
        deviations = StatedDeviations(scene.deviations(self.vehicle), scene.angles.deviations, scene.stabilise.model)
        return estimate_tilt(self.vehicle, self.forces, self.angles, deviations, scene.file)

    def hub_inputs(self, stabiliser_method: StabiliserMethod, time_step: float, step_count: int) -> HubInputs:
        """Returns the inputs of a run of ``step_count`` steps of ``time_step`` (s): hub forces, and the stabiliser that
        ``stabiliser_method`` names.

        Raises InputError.
        """
        scene, free = self.scene, self.forces.hub_inputs(time_step, step_count, self.scene.forces.interpolation)
        if stabiliser_method == "kalman":
            from models.systems.hub_forces.tilt_filter import inputs_with_moments

            return inputs_with_moments(free, self.vehicle, self.tilt, time_step, scene.stabilise.bandwidth)
        if stabiliser_method == "prescribed":
            return inputs_with_smoothed_angles(free, self.angles, time_step, scene.stabilise.smoothing, scene.file)
        return free

    def start(self, hub_inputs: HubInputs) -> np.ndarray:
        """Initial state (2 n,) of a run: at rest in the design position, except that enforced roll and pitch begin with
        their measured values and rates.
        """
        n = self.vehicle.size
        start = np.zeros(2 * n)
        if hub_inputs.guide is not None and hub_inputs.pull is None:
            start[[ROLL, PITCH, n + ROLL, n + PITCH]] = hub_inputs.guide[0, :4]
        return start


def inputs_with_smoothed_angles(
    hub_inputs: HubInputs,
    measured_angles: MeasuredAngles,
    time_step: float,
    smoothing_frequency: float,
    angles_path: str = "",
) -> HubInputs:
    """Returns hub inputs that enforce measured roll and pitch, after a low-pass of ``smoothing_frequency`` (Hz); raises
    InputError.
    """
    quiet = low_passed(
        measured_angles.samples[:, :2], measured_angles.period, smoothing_frequency, angles_path, "stabilise.smoothing"
    )
    return inputs_with_angles(hub_inputs, quiet, measured_angles.period, time_step)


def inputs_with_angles(
    hub_inputs: HubInputs, measured_angles: np.ndarray, sample_period: float, time_step: float
) -> HubInputs:
    """Returns hub inputs that enforce roll and pitch, samples (m, 2) in rad interpolated by a quintic spline."""
    motion = Smooth(measured_angles, sample_period, derivatives=2, degree=5)
    return replace(hub_inputs, guide=motion.sample(0.0, time_step / 2, len(hub_inputs.hubs)))


def measure(scene: HubScene, engine: str, estimate_error: bool = False) -> HubMeasurement:
    """Returns the measured hub forces and angles of a scene: from files, or from a run on the road with noise added.

    estimate_error : whether the errors of the time steps in that run are estimated, by further runs.
    """
    vehicle, road, step = scene.cut_vehicle(), scene.road, scene.run.step
    if road is None:
        return HubMeasurement(scene, vehicle, None, *scene.measured(vehicle))
    march = (engine, scene.settings(engine), scene.run.forces)
    true, errors = run_on_road(vehicle, road, scene.forces.frame, march, estimate_error and engine not in scene.engines)
    forces, angles = recorded_measurement(true, scene.forces.frame, round(1.0 / (scene.forces.sampling_rate * step)))
    if scene.forces.noise == "white":
        forces = forces.with_noise(scene.deviations(vehicle), scene.seed)
    if scene.angles.noise == "white":
        angles = angles.with_noise(scene.angles.deviations, scene.seed)
    return HubMeasurement(scene, vehicle, true, forces, angles, errors)


def run_on_road(
    vehicle: CutVehicle,
    road: TwoTrackRoadTable,
    force_frame: ForceFrame,
    engine_choice: tuple[str, Settings, ForceRoute],
    estimate_error: bool = False,
) -> tuple[HubRun, dict[str, Estimate]]:
    """Run the vehicle on its tyres over a road. Returns the run, with hub forces in ``force_frame``, and the errors of
    its time steps if they are requested.

    engine_choice : engine, its integrator with step and duration, and whether spring forces are native or compiled.
    """
    engine, settings, kind = engine_choice
    left, right = (iso8608_road(road.iso8608, road.seed + i) for i in range(2))

    def hub_inputs(time_step: float, step_count: int) -> HubInputs:
        return replace(road_under_wheels(vehicle, left, right, road.speed, time_step, step_count), frame=force_frame)

    true = HubModel(engine, vehicle, hub_inputs(settings.step, settings.steps), settings, kind).run()
    return true, errors_of_steps(engine, vehicle, true, hub_inputs, force_route=kind)[0] if estimate_error else {}


def errors_of_steps(
    engine: str,
    vehicle: CutVehicle,
    hub_run: HubRun,
    hub_inputs_of_step: Callable[[float, int], HubInputs],
    sample_period: float = 0.0,
    force_route: ForceRoute = "compiled",
) -> tuple[dict[str, Estimate], str]:
    """Estimate the errors of a run's time steps. Returns the errors of element forces, roll and pitch by name, and text
    on the method.

    hub_inputs_of_step : function of a step (s) and a number of steps; sample_period : of its samples (s), 0 for none:
    longer steps must divide it, or they would take the samples' noise for motion; force_route : whether spring forces
    are native or compiled.
    """
    step, steps = float(hub_run.times[1]), len(hub_run.times) - 1

    def rerun(step_factor: float, run_share: float) -> RunSeries:
        tried_step, count = step_factor * step, max(1, int(run_share * steps / step_factor + 1e-9))
        if step_factor > 2.0 or (step_factor > 1.0 and sample_period and not step_divides(tried_step, sample_period)):
            raise InputError(
                "", "run.step", tried_step, "is not taken: longer steps must divide the period of the samples"
            )
        row = (
            0 if step_factor > 1.0 else round(min(REPEATED_PART_START, 1.0 - run_share) * steps)
        )  # a road begins gently
        first = round(row / step_factor)
        inputs = hub_inputs_of_step(tried_step, first + count)
        guide = None if inputs.guide is None else inputs.guide[2 * first :]
        inputs_of_part = replace(inputs, hubs=inputs.hubs[2 * first :], guide=guide)
        path = build(engine, vehicle, inputs_of_part, tried_step, count * tried_step, force_route).run(
            hub_run.positions[row], hub_run.rates[row]
        )
        return principal_series(vehicle, path, first * tried_step)

    fine, units = principal_series(vehicle, hub_run), dict.fromkeys(("roll", "pitch"), "rad")
    units |= {element.name: element.unit for element in vehicle.elements}
    order = LIFTING_ORDER if vehicle.uncut.lifts else STEP_ERROR_ORDER
    estimates, method_text = step_errors(
        fine._replace(channels=_moving_channels(fine.channels, units)), rerun, order, step
    )
    return {
        name: replace(channel_estimate, unit=units[name]) for name, channel_estimate in estimates.items()
    }, method_text


def principal_series(vehicle: CutVehicle, hub_run: HubRun, start_time: float = 0.0) -> RunSeries:
    """Time series of the channels whose error is estimated, for a run that begins at ``start_time`` (s): forces of all
    elements, roll and pitch.
    """
    channels = {element.name: hub_run.elements[:, i] for i, element in enumerate(vehicle.elements)}
    return RunSeries(
        start_time + hub_run.times, channels | {"roll": hub_run.states[:, ROLL], "pitch": hub_run.states[:, PITCH]}
    )


def _moving_channels(
    values_by_channel: Mapping[str, np.ndarray], unit_by_channel: Mapping[str, str]
) -> dict[str, np.ndarray]:
    """Returns the channels that vary by more than a small share of the largest variation among channels of their
    unit.
    """
    change = {name: float(np.std(values)) for name, values in values_by_channel.items()}
    largest_by_unit = {
        unit: max(change[name] for name in change if unit_by_channel[name] == unit)
        for unit in set(unit_by_channel.values())
    }
    largest = max(
        (float(np.abs(values_by_channel[name]).max()) for name in values_by_channel if unit_by_channel[name] == "N"),
        default=0.0,
    )
    still = {"rad": STANDSTILL_CHANGE, "N": STANDSTILL_CHANGE * largest, "N m": STANDSTILL_CHANGE * largest}
    return {
        name: values
        for name, values in values_by_channel.items()
        if change[name] > max(LEAST_CHANGE_SHARE * largest_by_unit[unit_by_channel[name]], still[unit_by_channel[name]])
    }


def run(
    scene: HubScene,
    engine: str,
    method: StabiliserMethod | None = None,
    measurement: HubMeasurement | None = None,
    error: bool = False,
) -> Result:
    """Run the vehicle without tyres under its hub forces; the result's detail is the HubRun. Raises InputError,
    Refused or RunFailed.

    method : stabiliser of roll and pitch, by default the scene's; measurement : of the scene, if it exists
    already, as for runs in several engines; else this engine makes it. error : whether the errors of the time steps are
    estimated, by further runs, and added to those of the measurement.
    """
    measurement, method = (measurement or measure(scene, engine, error), method or scene.stabilise.method)
    hub_inputs = measurement.hub_inputs(method, scene.run.step, scene.step_count)
    kind = scene.spring_force_route(method)
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
    measurement: HubMeasurement,
    hub_run: HubRun,
    engine: str,
    stabiliser_method: str = RUN_ON_TYRES,
    run_seconds: float = 0.0,
) -> Result:
    """Returns the result of a run: motion of the chassis, section forces of all elements, moments of the stabiliser on
    roll and pitch, and broken assumptions.
    """
    channels = {
        name: Channel("time", hub_run.states[:, column], unit) for name, (column, unit) in MOTION_CHANNELS.items()
    }
    channels |= {
        "section_force": Channel(("time", "element"), hub_run.elements, "N", "compression; of bars a moment, N m"),
        "holding_moment": Channel(("time", "held"), hub_run.moments, "N m", "of the stabiliser on roll and pitch"),
    }
    axes = {
        "time": Channel("time", hub_run.times, "s"),
        "element": Channel("element", [element.name for element in measurement.vehicle.elements]),
        "held": Channel("held", ["roll", "pitch"]),
    }
    labelled = result(
        measurement.scene,
        channels,
        axes,
        engine=engine,
        counts=hub_run.counts | {"states": hub_run.states.shape[1]},
        seconds=run_seconds,
        doubts=measurement.tilt.objections if stabiliser_method == "kalman" else (),
        detail=hub_run,
        method=stabiliser_method,
    )
    return with_assumptions(
        labelled, assumptions(measurement.scene, measurement.vehicle, stabiliser_method, measurement.angles)
    )
