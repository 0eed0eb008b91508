"""Attitudes of rotating bodies measured by a noisy gyro, for the validation cases of the inertial unit."""

import math

import numpy as np

from models.sensors.inertial_unit import error_rotation, measured_attitude, true_attitude
from models.sensors.rotations import (
    conjugate_quaternion,
    quaternion_of_rotation_vector,
    quaternion_product,
    rotation_matrix,
    rotation_vector,
)

SEED = 30
PATHS_IN_MEMORY = 500
"""Number of noise paths that are computed at a time."""
START_ATTITUDE = np.array([1.0, 0.0, 0.0, 0.0])


def turning_rates(sample_count: int, sample_period: float) -> np.ndarray:
    """Angular velocities (sample_count, 3) in rad/s, in body axes, of a body that turns about all axes by one or two
    radians in two seconds.
    """
    t = sample_period * np.arange(sample_count)
    return np.column_stack([0.5 + 0.4 * np.sin(2.1 * t), 0.2 - 0.3 * np.cos(1.7 * t), 0.8 + 0.2 * np.cos(1.3 * t)])


def coning_motion(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angular velocity in body axes (n, 3) in rad/s and attitude quaternion (n, 4) of a coning motion at times t (s).

    The rotation is S = Rz(W t) Rx(c) Rz(-W t) with W = 2 rad/s and c = 0.3, its angular velocity W (S^T e_z - e_z).
    """
    spin, half = 2.0, 0.3
    turn_about_vertical = quaternion_of_rotation_vector(spin * times[:, None] * np.array([0.0, 0.0, 1.0]))
    tilt = quaternion_of_rotation_vector(np.array([half, 0.0, 0.0]))
    rates = spin * np.column_stack(
        [
            -math.sin(half) * np.sin(spin * times),
            math.sin(half) * np.cos(spin * times),
            np.full_like(times, math.cos(half) - 1),
        ]
    )
    return rates, quaternion_product(
        quaternion_product(turn_about_vertical, tilt), conjugate_quaternion(turn_about_vertical)
    )


def largest_angle(first_attitudes: np.ndarray, second_attitudes: np.ndarray) -> float:
    """Largest angle (rad) between two arrays of attitude quaternions (..., 4)."""
    return float(
        np.abs(rotation_vector(quaternion_product(conjugate_quaternion(first_attitudes), second_attitudes))).max()
    )


def attitude_errors(
    angular_rates: np.ndarray, sample_period: float, noise_deviation: np.ndarray, path_count: int
) -> np.ndarray:
    """Rotation quaternions (path_count, 4) between the true attitude and the attitudes from noisy rates at the end of a
    motion. noise_deviation: of the noise of each rate sample (rad/s)."""
    true = true_attitude(angular_rates, sample_period, START_ATTITUDE)[-1]
    chunks = [range(first, min(first + PATHS_IN_MEMORY, path_count)) for first in range(0, path_count, PATHS_IN_MEMORY)]
    ends = [
        measured_attitude(angular_rates, sample_period, noise_deviation, START_ATTITUDE, chunk, SEED)[-1]
        for chunk in chunks
    ]
    return error_rotation(np.concatenate(ends), true)


def standard_errors(attitudes: np.ndarray, expected_rotation: np.ndarray) -> float:
    """Largest difference between the mean rotation matrix of quaternions (n, 4) and the expected matrix (3, 3), divided
    by the standard error of the entry."""
    samples = rotation_matrix(attitudes)
    error = samples.std(axis=0, ddof=1) / math.sqrt(len(samples))
    return float((np.abs(samples.mean(axis=0) - expected_rotation) / error).max())
