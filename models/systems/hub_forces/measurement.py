"""Virtual measurement: a vehicle on its tyres over a rough road, and the hub forces and angles that sensors record."""

from dataclasses import dataclass, replace

import numpy as np

from models.core.noise import FORCES, PITCH_SENSOR, normal_samples
from models.core.signals import Interpolation, signal_from_samples
from models.engines.cut_vehicle import HubModel, HubRun, build, run_with_forces
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_table import HubInputs, cut_vehicle_table
from models.road.profile import RoadProfile
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle


@dataclass(frozen=True)
class HubForces:
    """Measured hub forces. samples (m, 6 h) : three forces (N) and three moments (N m) hub by hub, the first at t = 0;
    period : time (s) between samples.

    frame : "hub", axes of the wheel carrier; "body", axes of the chassis; "inertial", axes fixed in space. x forward, y
    left, z up; the force acts on the hub from outside, the moment about the hub.
    """

    samples: np.ndarray
    period: float
    frame: str

    def hub_inputs(self, time_step: float, step_count: int, interpolation: Interpolation = "linear") -> HubInputs:
        """Returns the hub forces as inputs of a run, interpolated at every half of ``step_count`` steps of
        ``time_step`` (s).
        """
        signal = signal_from_samples(self.samples, self.period, interpolation)
        return HubInputs(
            signal.sample(0.0, time_step / 2, 2 * step_count + 1), self.frame, constant_in_step=signal.held
        )

    def with_noise(self, noise_deviation: np.ndarray, noise_seed: int, noise_path: int = 0) -> "HubForces":
        """Returns the hub forces with white noise on every sample, of standard deviations (6 h,) in N and N m."""
        noise = normal_samples(noise_seed, noise_path, len(self.samples), self.samples.shape[1], noise_source=FORCES)
        return replace(self, samples=self.samples + noise * noise_deviation)


@dataclass(frozen=True)
class MeasuredAngles:
    """Measured angles. samples (m, 4) : roll, pitch (rad) and their rates (rad/s), the first at t = 0; period : time
    (s) between samples.
    """

    samples: np.ndarray
    period: float

    def with_noise(
        self, noise_deviations: tuple[float, float], noise_seed: int, noise_path: int = 0
    ) -> "MeasuredAngles":
        """Returns the angles with white noise on every sample; noise_deviations : of angles (rad) and of rates
        (rad/s).
        """
        noise = normal_samples(noise_seed, noise_path, len(self.samples), 4, noise_source=PITCH_SENSOR)
        return replace(self, samples=self.samples + noise * np.repeat(noise_deviations, 2))


def road_under_wheels(
    vehicle: CutVehicle,
    left_profile: RoadProfile,
    right_profile: RoadProfile,
    speed: float,
    time_step: float,
    step_count: int,
) -> HubInputs:
    """Road heights (m) and their rates (m/s) under the wheels at half steps, positive upwards. The front axle is at
    the path v t, and axles behind it reach the same point later.
    """
    half_step_times, front = 0.5 * time_step * np.arange(2 * step_count + 1), max(vehicle.uncut.axles)
    heights, rates = [], []
    for tyre in vehicle.uncut.tyres:
        road = left_profile if tyre.point[1] > 0 else right_profile
        height, slope = road.height_and_slope(speed * half_step_times - (front - tyre.point[0]))
        heights.append(-height)  # roads count downwards
        rates.append(-speed * slope)
    return HubInputs(np.column_stack([*heights, *rates]), speed=speed)


def true_run(
    engine: str, vehicle: CutVehicle, road_inputs: HubInputs, force_frame: str, time_step: float, duration: float
) -> HubRun:
    """Run the vehicle on its tyres over a road; its hub forces are recorded in ``force_frame``."""
    return build(engine, vehicle, replace(road_inputs, frame=force_frame), time_step, duration).run()


def element_travels(vehicle: CutVehicle, hub_run: HubRun) -> dict[str, np.ndarray]:
    """Travel (m,) of every spring and mount (m) and every bar (rad) over a run, by name: from the design position,
    positive in compression.
    """
    gauges = tuple(element.travel_gauge() for element in vehicle.elements)
    still = HubInputs(np.zeros((2 * len(hub_run.times) - 1, WRENCH * len(vehicle.hubs))))
    gauged = replace(vehicle, elements=gauges)
    values = run_with_forces(
        gauged, cut_vehicle_table(gauged, still, float(hub_run.times[1])), hub_run.times, hub_run.states
    ).elements
    return {element.name: column for element, column in zip(vehicle.elements, values.T, strict=True)}


def recorded_measurement(hub_run: HubRun, force_frame: str, steps_per_sample: int) -> tuple[HubForces, MeasuredAngles]:
    """Hub forces and angles of a run as a measurement without noise, sampled at every ``steps_per_sample``-th step."""
    n, period = hub_run.states.shape[1] // 2, float(hub_run.times[1]) * steps_per_sample
    angles = hub_run.states[::steps_per_sample, [ROLL, PITCH, n + ROLL, n + PITCH]]
    wrenches = hub_run.wrenches[::steps_per_sample]
    return HubForces(wrenches.reshape(len(wrenches), -1), period, force_frame), MeasuredAngles(angles, period)


def hub_model(
    engine: str,
    vehicle: CutVehicle,
    hub_forces: HubForces,
    time_step: float,
    duration: float,
    interpolation: Interpolation = "linear",
) -> HubModel:
    """Build the model of a vehicle without tyres under measured hub forces, without a stabiliser."""
    return build(
        engine,
        vehicle,
        hub_forces.hub_inputs(time_step, round(duration / time_step), interpolation),
        time_step,
        duration,
    )
