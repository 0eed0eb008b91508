"""A moving car for a minute: gyro of a telephone and pose of its camera (comma2k19, MIT licence), where it is there."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from models.sensors.rotations import conjugate_quaternion, integrate_attitude, quaternion_product, rotation_vector
from validation.common.scenes import data_folder

RECORDING_FILE = "comma2k19_example_60s.npz"
"""Not part of the repository. Both frames are x forward, y right, z down; the pose turns them to the earth's."""
SAMPLE_PERIOD = 0.01
"""s; the clock of the recording wanders by 0.6 % and is read on this one."""


@dataclass(frozen=True)
class Recording:
    """A public recording: angular rates (n, 3) in rad/s without the telephone's bias; pose (n, 4) by the camera, as
    quaternions from local to global axes."""

    rates: np.ndarray
    pose: np.ndarray


def find() -> Path | None:
    """Path of the recording; None if TWINRIG_DATA does not lead to it."""
    folder = data_folder()
    return folder / RECORDING_FILE if folder and (folder / RECORDING_FILE).is_file() else None


def read(path: Path) -> Recording:
    """Rates and poses on a common clock. Rates are interpolated linearly, poses along the shortest rotation."""
    with np.load(path) as data:
        gyro_times, frame_times = data["gyro_t"], data["frame_t"]
        clock = np.arange(max(gyro_times[0], frame_times[0]), min(gyro_times[-1], frame_times[-1]), SAMPLE_PERIOD)
        free = data["gyro"] - data["gyro_bias"]
        rates = np.column_stack([np.interp(clock, gyro_times, free[:, i]) for i in range(3)])
        pose = Slerp(frame_times, Rotation.from_quat(data["frame_q"], scalar_first=True))(clock)
    return Recording(rates, pose.as_quat(scalar_first=True))


def gyro_error(recording: Recording) -> np.ndarray:
    """Angle (n,) in rad between the attitude by the gyro alone, started at the camera's attitude, and the camera's."""
    attitudes = integrate_attitude(recording.rates, SAMPLE_PERIOD, recording.pose[0], "mean")
    return np.linalg.norm(rotation_vector(quaternion_product(conjugate_quaternion(recording.pose), attitudes)), axis=1)
