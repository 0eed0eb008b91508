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

    def hub_inputs(self, step: float, steps: int, interpolation: Interpolation = "linear") -> HubInputs:
        """Returns the hub forces as inputs of a run, interpolated at every half of ``steps`` steps of ``step`` (s)."""
        signal = signal_from_samples(self.samples, self.period, interpolation)
        return HubInputs(signal.sample(0.0, step / 2, 2 * steps + 1), self.frame, constant_in_step=signal.held)

    def with_noise(self, deviation: np.ndarray, seed: int, path: int = 0) -> "HubForces":
        """Returns the hub forces with white noise on every sample, of standard deviations (6 h,) in N and N m."""
        noise = normal_samples(seed, path, len(self.samples), self.samples.shape[1], noise_source=FORCES)
        return replace(self, samples=self.samples + noise * deviation)


@dataclass(frozen=True)
class Angles:
    """Measured angles. samples (m, 4) : roll, pitch (rad) and their rates (rad/s), the first at t = 0; period : time
    (s) between samples.
    """

    samples: np.ndarray
    period: float

    def with_noise(self, deviations: tuple[float, float], seed: int, path: int = 0) -> "Angles":
        """Returns the angles with white noise on every sample; deviations : of angles (rad) and of rates (rad/s)."""
        noise = normal_samples(seed, path, len(self.samples), 4, noise_source=PITCH_SENSOR)
        return replace(self, samples=self.samples + noise * np.repeat(deviations, 2))


def two_tracks(
    vehicle: CutVehicle, left_profile: RoadProfile, right_profile: RoadProfile, speed: float, step: float, steps: int
) -> HubInputs:
    """Road heights (m) and their rates (m/s) under the wheels at half steps, positive upwards. The front axle is at
    the path v t, and axles behind it reach the same point later.
    """
    half_step_times, front = 0.5 * step * np.arange(2 * steps + 1), max(vehicle.uncut.axles)
    heights, rates = [], []
    for tyre in vehicle.uncut.tyres:
        road = left_profile if tyre.point[1] > 0 else right_profile
        height, slope = road.height_and_slope(speed * half_step_times - (front - tyre.point[0]))
        heights.append(-height)  # roads count downwards
        rates.append(-speed * slope)
    return HubInputs(np.column_stack([*heights, *rates]), speed=speed)


def true_run(engine: str, vehicle: CutVehicle, road: HubInputs, frame: str, step: float, duration: float) -> HubRun:
    """Run the vehicle on its tyres over a road; its hub forces are recorded in ``frame``."""
    return build(engine, vehicle, replace(road, frame=frame), step, duration).run()


def element_travels(vehicle: CutVehicle, run: HubRun) -> dict[str, np.ndarray]:
    """Travel (m,) of every spring and mount (m) and every bar (rad) over a run, by name: from the design position,
    positive in compression.
    """
    gauges = tuple(element.travel_gauge() for element in vehicle.elements)
    still = HubInputs(np.zeros((2 * len(run.times) - 1, WRENCH * len(vehicle.hubs))))
    gauged = replace(vehicle, elements=gauges)
    values = run_with_forces(
        gauged, cut_vehicle_table(gauged, still, float(run.times[1])), run.times, run.states
    ).elements
    return {element.name: column for element, column in zip(vehicle.elements, values.T, strict=True)}


def recorded_measurement(run: HubRun, frame: str, stride: int) -> tuple[HubForces, Angles]:
    """Hub forces and angles of a run as a measurement without noise, sampled at every ``stride``-th step."""
    n, period = run.states.shape[1] // 2, float(run.times[1]) * stride
    angles = run.states[::stride, [ROLL, PITCH, n + ROLL, n + PITCH]]
    wrenches = run.wrenches[::stride]
    return HubForces(wrenches.reshape(len(wrenches), -1), period, frame), Angles(angles, period)


def hub_model(
    engine: str,
    vehicle: CutVehicle,
    forces: HubForces,
    step: float,
    duration: float,
    interpolation: Interpolation = "linear",
) -> HubModel:
    """Build the model of a vehicle without tyres under measured hub forces, without a stabiliser."""
    return build(engine, vehicle, forces.hub_inputs(step, round(duration / step), interpolation), step, duration)
