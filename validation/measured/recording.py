"""A public recording of a moving car, one minute long: a telephone's gyro, and the pose from its camera (comma2k19, MIT
licence). It is optional."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from models.sensors.rotations import conjugate_quaternion, integrate_attitude, quaternion_product, rotation_vector
from validation.common.scenes import data_folder

RECORDING_FILE = "comma2k19_example_60s.npz"
"""Not part of the repository. The axes of both frames are x forward, y right, z down. The pose turns them into the
frame of the earth."""
SAMPLE_PERIOD = 0.01
"""Sampling period, s. The clock of the recording varies by 0.6 %, so it is interpolated to this period."""


@dataclass(frozen=True)
class Recording:
    """The public recording: angular rates (n, 3) in rad/s, corrected for the gyro's bias, and pose (n, 4) from the
    camera, as quaternions that turn local into global axes."""

    rates: np.ndarray
    pose: np.ndarray


def find_recording() -> Path | None:
    """Path of the recording, or None if it is not in the folder that TWINRIG_DATA names."""
    folder = data_folder()
    return folder / RECORDING_FILE if folder and (folder / RECORDING_FILE).is_file() else None


def read_recording(recording_path: Path) -> Recording:
    """Rates and poses on a common clock. Rates are interpolated linearly, poses along the shortest rotation."""
    with np.load(recording_path) as data:
        gyro_times, frame_times = data["gyro_t"], data["frame_t"]
        clock = np.arange(max(gyro_times[0], frame_times[0]), min(gyro_times[-1], frame_times[-1]), SAMPLE_PERIOD)
        free = data["gyro"] - data["gyro_bias"]
        rates = np.column_stack([np.interp(clock, gyro_times, free[:, i]) for i in range(3)])
        pose = Slerp(frame_times, Rotation.from_quat(data["frame_q"], scalar_first=True))(clock)
    return Recording(rates, pose.as_quat(scalar_first=True))


def gyro_error(recording: Recording) -> np.ndarray:
    """Angle (n,) in rad between the camera's attitude and the attitude integrated from the gyro, which starts at the
    camera's."""
    attitudes = integrate_attitude(recording.rates, SAMPLE_PERIOD, recording.pose[0], "mean")
    return np.linalg.norm(rotation_vector(quaternion_product(conjugate_quaternion(recording.pose), attitudes)), axis=1)
