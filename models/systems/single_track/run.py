"""Run of the single-track car over a measured drive: yaw rate, lateral acceleration, side slip, forces of the axles."""

import time

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.discretisation import (
    Estimate,
    estimate_rescaled,
    observed_order,
    reference_size,
    root_mean_square,
    with_stated_errors,
)
from models.core.errors import RunFailed
from models.core.result import Channel, Result, result
from models.core.smoothing import low_passed
from models.measured.drive import MeasuredDrive, read_drive
from models.systems.single_track.assumptions import assumptions
from models.systems.single_track.equations import march, motion_reports
from models.systems.single_track.scene import SensorErrorTable, SingleTrackScene

SETTLING_DURATION = 1.0
"""Time (s) for which the first sample's steer angle and speed act before the drive, so that the drive begins in a
steady turn.
"""
LARGEST_YAW_RATE = 20.0
"""Yaw rate (rad/s) beyond which a run fails: no car turns so fast."""
AXLE_CHANNELS = (
    "load front",
    "side force front",
    "slip angle front",
    "load rear",
    "side force rear",
    "slip angle rear",
)
AXLE_CHANNEL_COLUMNS = (1, 3, 5, 2, 4, 6)
AXLE_CHANNEL_UNITS = ("N", "N", "rad") * 2
"""Channels of the axles, their columns in ``motion_reports`` and their units."""
ESTIMATED_CHANNELS, HEUN_ORDER = ("yaw rate", "lateral acceleration", "side slip"), 2.0
"""Channels whose discretisation error is stated, and the order of Heun's method."""


def run(scene: SingleTrackScene, engine: str = "", *, error: bool = False) -> Result:
    """Run the car over the whole measured drive. Channels over time are the readings of the sensors, and loads, side
    forces and slip angles of both axles.

    error : whether the error of the time steps is estimated. Raises InputError for a file that is no drive, RunFailed
    where the motion is not finite.
    """
    drive = read_drive(scene.path(scene.drive.file, "drive.file"), tuple(scene.drive.stretch))
    start_time = time.process_time()
    inputs_of_samples = equation_inputs(drive, scene)
    motion, table = simulated_motion(scene, inputs_of_samples, float(drive.times[1] - drive.times[0]))
    channels = sensor_channels(scene.sensors, inputs_of_samples, motion, table[:, 0])
    channels |= {
        name: Channel("time", table[:, column], unit)
        for name, column, unit in zip(AXLE_CHANNELS, AXLE_CHANNEL_COLUMNS, AXLE_CHANNEL_UNITS, strict=True)
    }
    counts = {"steps": len(inputs_of_samples) - 1} | {
        f"samples of {name} left out": n for name, n in drive.left_out.items()
    }
    run = result(
        scene,
        channels,
        {"time": Channel("time", drive.times, "s")},
        engine="reference",
        counts=counts,
        seconds=time.process_time() - start_time,
        detail=drive,
    )
    run = with_assumptions(run, assumptions(scene))
    return _with_step_error(run, scene, inputs_of_samples, drive) if error else run


def _with_step_error(
    run_result: Result, scene: SingleTrackScene, input_samples: np.ndarray, measured_drive: MeasuredDrive
) -> Result:
    """Returns the result with the error of Heun's steps from sample to sample. It is estimated by steps of a half and
    of a quarter of that length, with inputs (n, 3) interpolated linearly between samples.

    Raises RunFailed, whose ``partial`` is the result, where steps are too long for the tyres, as with stiff tyres in a
    slow drive.
    """
    period = float(measured_drive.times[1] - measured_drive.times[0])
    half, quarter = (_sensed_in_finer_steps(scene, input_samples, period, parts) for parts in (2, 4))
    estimates = {}
    for name, finer in quarter.items():
        fine, values = half[name], np.asarray(run_result[name])
        order = observed_order(root_mean_square(finer - fine), root_mean_square(fine - values), HEUN_ORDER)
        error = root_mean_square(fine - values) / (1.0 - 0.5**order)
        estimates[name] = estimate_rescaled(
            Estimate(error, run_result.data[name].attrs["units"], 0.0, order, period), reference_size(values), period
        )
    return with_stated_errors(
        run_result, estimates, "steps of a half and a quarter of the drive's sampling period", "s between samples"
    )


def _sensed_in_finer_steps(
    scene: SingleTrackScene, input_samples: np.ndarray, sample_period: float, steps_per_sample: int
) -> dict[str, np.ndarray]:
    """ESTIMATED_CHANNELS at the samples (n,), computed with ``steps_per_sample`` time steps between two samples."""
    row_positions = np.linspace(0.0, len(input_samples) - 1.0, steps_per_sample * (len(input_samples) - 1) + 1)
    between = np.column_stack(
        [np.interp(row_positions, np.arange(len(input_samples)), column) for column in input_samples.T]
    )
    motion, table = simulated_motion(scene, np.ascontiguousarray(between), sample_period / steps_per_sample)
    sensed = sensor_channels(scene.sensors, input_samples, motion[::steps_per_sample], table[::steps_per_sample, 0])
    return {name: np.asarray(sensed[name].values) for name in ESTIMATED_CHANNELS}


def equation_inputs(measured_drive: MeasuredDrive, scene: SingleTrackScene) -> np.ndarray:
    """Steer angle of the wheels (rad), speed (m/s) and its rate (m/s^2) of a measured drive, shape (n, 3): low-passed,
    with the steer angle corrected for the sensor's errors.
    """
    period, sensors = float(measured_drive.times[1] - measured_drive.times[0]), scene.sensors
    steer, speed = measured_drive.steer, measured_drive.speed
    if scene.drive.low_pass:
        filtered = low_passed(
            np.column_stack([steer, speed]), period, scene.drive.low_pass, scene.file, "drive.low_pass"
        )
        steer, speed = filtered.T
    if sensors.steer_delay:
        steer = np.interp(measured_drive.times - sensors.steer_delay, measured_drive.times, steer)
    steer = sensors.steer_ratio * steer + sensors.steer_offset
    return np.ascontiguousarray(np.column_stack([steer, speed, np.gradient(speed, period)]))


def simulated_motion(
    scene: SingleTrackScene, input_samples: np.ndarray, sample_period: float
) -> tuple[np.ndarray, np.ndarray]:
    """Lateral velocity (m/s) and yaw rate (rad/s), shape (n, 2), and ``motion_reports`` (n, 7), for inputs
    ``sample_period`` (s) apart. The motion begins in the steady turn of the first sample.
    """
    parts = scene.car(), scene.front.axle(), scene.rear.axle()
    settling = np.repeat(input_samples[:1], max(2, round(SETTLING_DURATION / sample_period)), axis=0)
    first = march(*parts, settling, sample_period, (0.0, 0.0))[-1]
    motion = march(*parts, input_samples, sample_period, (float(first[0]), float(first[1])))
    bad = ~(np.abs(motion[:, 1]) < LARGEST_YAW_RATE)
    if bad.any():
        row = int(bad.argmax())
        why = "the car turns faster than any car: check units and signs of the drive, and the tyres"
        raise RunFailed("reference", why, sample_period * row, motion[max(row - 1, 0)])
    return motion, motion_reports(*parts, input_samples, motion)


def sensor_channels(
    sensor_errors: SensorErrorTable, input_samples: np.ndarray, motion: np.ndarray, lateral_acceleration: np.ndarray
) -> dict[str, Channel]:
    """Readings of the car's sensors, offsets included, by the channel names of a measurement.

    input_samples (n, 3) : see ``equation_inputs``; motion (n, 2) : lateral velocity (m/s), yaw rate (rad/s);
    lateral_acceleration (n,) : of the centre of mass (m/s^2).
    """
    slip = np.arctan2(motion[:, 0], input_samples[:, 1]) + sensor_errors.side_slip_offset
    acceleration = sensor_errors.acceleration_ratio * lateral_acceleration + sensor_errors.acceleration_offset
    return {
        "yaw rate": Channel("time", motion[:, 1] + sensor_errors.yaw_rate_offset, "rad/s", "left positive"),
        "lateral acceleration": Channel("time", acceleration, "m/s^2", "of the centre of mass, left positive"),
        "side slip": Channel("time", slip, "rad", "of the centre of mass, left positive"),
        "lateral velocity": Channel("time", motion[:, 0], "m/s", "of the centre of mass, left positive"),
        "wheels steer": Channel("time", input_samples[:, 0], "rad", "angle of the front wheels"),
        "forward acceleration": Channel("time", input_samples[:, 2], "m/s^2", "rate of the measured speed"),
    }
