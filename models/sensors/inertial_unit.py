"""Effect of white noise on measured angular rates on the attitude integrated from them (Section 3.2 of the paper).

A gyro's sample errs by ``deviation`` (rad/s) on each axis, white at the sampling rate; over many samples that is a
random walk of the angle with s = deviation / sqrt(rate) in rad per sqrt(s). S and S~ are the true and the measured
attitude (local to global, local rates), and E = S~ S^T is the error rotation, in global components.

Ito and Stratonovich. The kinematic equation with noise, S~' = S~ skew(w + noise), means Stratonovich: samples are
real numbers held over a period, and every step is a rotation. Read after Ito, eq. (25) loses the correction term: the
quaternion then grows, by exp(k s^2 t / 8) for k noisy axes, as eq. (28) has it, while its direction is the same. So
    normalised quaternion, or steps by the exponential: E[q] = exp(-sum of s^2 t / 8) q_true, laws of E as below;
    not normalised, explicit Euler or Ito: E[q] = q_true, but the matrix of eq. (21) is a rotation times |q|^2.
"""

import math

import numpy as np
from scipy.signal import lfilter
from scipy.special import hyp1f1

from models.core.errors import InputError
from models.core.noise import GYRO, GYRO_BIAS, normal_samples
from models.sensors.rotations import (
    conjugate_quaternion,
    integrate_attitude,
    quaternion_product,
    rotation_matrix,
    skew_matrix,
)


def angle_random_walk_of(rate_deviation: float, sampling_rate: float) -> float:
    """Angle random walk s (rad per sqrt(s)) of gyro samples with standard deviation ``rate_deviation`` (rad/s) at
    ``sampling_rate`` (Hz), eq. (5).

    Raises InputError for a rate that is not above 0.
    """
    if not sampling_rate > 0.0:
        raise InputError("", "rate", sampling_rate, "must be above 0, in Hz")
    return rate_deviation / sampling_rate**0.5


def measured_attitude(
    rates: np.ndarray,
    sample_period: float,
    rate_deviation: np.ndarray,
    start_attitude: np.ndarray,
    path_numbers: range,
    seed: int = 0,
) -> np.ndarray:
    """Quaternions (n + 1, paths, 4) of the attitude from noisy rates, which are constant over each period and
    integrated by exact rotations.

    rates : true local rates (n, 3) in rad/s, one for each period (s); rate_deviation : (3,) in rad/s per sample, each
    axis its own; start_attitude : the true attitude (4,) at t = 0. Path i draws from the stream (seed, i).
    """
    noise = np.stack([normal_samples(seed, path, len(rates), 3, noise_source=GYRO) for path in path_numbers], axis=1)
    return true_attitude(rates[:, None, :] + rate_deviation * noise, sample_period, start_attitude)


def true_attitude(rates: np.ndarray, sample_period: float, start_attitude: np.ndarray) -> np.ndarray:
    """Quaternions (n + 1, ..., 4) of the attitude from rates (n, ..., 3) in rad/s that are constant over each period
    (s), integrated exactly."""
    return integrate_attitude(np.concatenate([rates, rates[-1:]]), sample_period, start_attitude, "held")


def error_rotation(measured_attitudes: np.ndarray, true_attitudes: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) of the error E = S~ S^T, the rotation from the true to the measured attitude, in global
    components."""
    return quaternion_product(measured_attitudes, conjugate_quaternion(true_attitudes))


def mean_error_scalar(angle_random_walks: np.ndarray, time: float) -> float:
    """Expected scalar part q1 of the attitude's error quaternion after ``time`` (s), on any motion: exp(-sum of s^2 t /
    8) with the angle random walks s.

    angle_random_walks : (k,) in rad per sqrt(s). It holds for unequal noise and on a turning body alike, because the
    squares of the three matrices of eq. (26) are all -1: the quaternion's mean cannot see which axis is the noisy one.
    """
    return float(np.exp(-np.sum(np.square(angle_random_walks)) * time / 8))


def mean_error_trace(angle_random_walk: float, time: float) -> float:
    """Expected trace E[tr E] = 3 exp(-s^2 t) of the error rotation E after ``time`` t (s), for three axes of equal
    noise s on any true motion: beyond the paper, and exact.

    Equal noise is the same in every frame, so that E is the Brownian motion of the rotation group itself.
    """
    return float(3 * np.exp(-(angle_random_walk**2) * time))


def mean_error_rotation(
    angle_random_walks: np.ndarray, rates: np.ndarray, sample_period: float, start_attitude: np.ndarray
) -> np.ndarray:
    """Mean rotation matrix E[E] (3, 3) of the attitude error, for unequal noise on a turning body.

    From Stratonovich to Ito the noise leaves 1/2 sum s_i^2 G_i^2, with G_i the generator of a turn about local axis
    i, and therefore
        d E[E] / dt = E[E] S (1/2 sum s_i^2 G_i^2) S^T,
    turned by the true motion S; or, for the measured attitude itself, d E[S~] / dt = E[S~] (skew(w) + 1/2 sum s_i^2
    G_i^2). The latter has constant coefficients over each period and is stepped by its matrix exponential: exact for
    rates that are held.

    angle_random_walks : (3,) in rad per sqrt(s); rates : (n, 3) in rad/s, local; sample_period : s; start_attitude :
    unit quaternion (4,).
    """
    mean = rotation_matrix(start_attitude)
    for step in _matrix_exponentials((skew_matrix(rates) + noise_decay_matrix(angle_random_walks)) * sample_period):
        mean = mean @ step
    return mean @ rotation_matrix(true_attitude(rates, sample_period, start_attitude)[-1]).T


def _matrix_exponentials(matrices: np.ndarray) -> np.ndarray:
    """Matrix exponentials of all matrices m (n, 3, 3): power series of m / 2^k with small entries, squared k times.

    scipy's own goes matrix by matrix through a threaded library, and takes many times as long where others run.
    """
    squarings = max(0, int(np.ceil(np.log2(2 * np.abs(matrices).sum(axis=-1).max(initial=0.5)))))
    small, exponential = matrices / 2**squarings, np.broadcast_to(np.eye(3), matrices.shape)
    for k in range(16, 0, -1):  # (1/2)^17 / 17! is below 1e-19
        exponential = np.eye(3) + small @ exponential / k
    for _ in range(squarings):
        exponential = exponential @ exponential
    return exponential


def noise_decay_matrix(angle_random_walks: np.ndarray) -> np.ndarray:
    """Matrix 1/2 sum s_i^2 G_i^2 (3, 3) in 1/s, the rate at which noise with angle random walks s_i reduces the mean
    rotation matrix, in local components (G_i: generator of a rotation about axis i)."""
    return 0.5 * np.diag(np.square(angle_random_walks) - np.sum(np.square(angle_random_walks)))


def quaternion_norm_by_ito(angle_random_walks: np.ndarray, time: float) -> float:
    """Norm |q| of the quaternion of eq. (28) after ``time`` (s): exp(sum of s^2 t / 8) with the angle random walks s,
    without any scatter."""
    return 1 / mean_error_scalar(angle_random_walks, time)


def mean_square_norm_by_euler(
    angle_random_walk: float, axis_count: int, sample_period: float, step_count: int
) -> float:
    """Expected squared norm E[|q|^2] of the quaternion by explicit Euler steps on eq. (25) at rest: (1 + k s^2 D / 4)^n
    for k axes, angle random walk s, period D and n steps, exactly."""
    return float(np.exp(step_count * np.log1p(axis_count * angle_random_walk**2 * sample_period / 4)))


def quaternions_by_euler_steps(turn_vectors: np.ndarray, start_attitude: np.ndarray) -> np.ndarray:
    """Quaternions (paths, 4) by explicit Euler steps on eq. (25), never normalised, after rotation vectors (n, paths,
    3) in rad."""
    q = np.broadcast_to(np.asarray(start_attitude, dtype=float), (turn_vectors.shape[1], 4))
    for turn in turn_vectors:
        q = q + 0.5 * quaternion_product(q, np.concatenate([np.zeros((len(q), 1)), turn], axis=1))
    return q


DEGREES_PER_HOUR = math.pi / 180 / 3600
"""Unit degree per hour in rad/s."""
DEGREES_PER_ROOT_HOUR = math.pi / 180 / 60
"""Unit degree per square root of an hour in rad per sqrt(s)."""


def bias_path(
    sample_count: int,
    sample_period: float,
    turn_on_deviation: float,
    bias_instability: float,
    correlation_time: float,
    seed: int,
    path_number: int,
) -> np.ndarray:
    """Bias (sample_count,) of a gyro in rad/s at samples ``sample_period`` (s) apart: a single path of the random
    process.

    turn_on_deviation, bias_instability : standard deviations (rad/s); correlation_time : tau (s). The recursion over a
    period is exact, so the process does not depend on the sampling rate. Raises InputError for a time that is not above
    0 or a deviation below it.
    """
    _check_numbers(period=sample_period, correlation_time=correlation_time)
    _check_numbers(minimum=0.0, turn_on_deviation=turn_on_deviation, bias_instability=bias_instability)
    drawn = normal_samples(seed, path_number, sample_count + 1, 1, noise_source=GYRO_BIAS)[:, 0]
    decay = math.exp(-sample_period / correlation_time)
    kicks = drawn[1:] * math.sqrt(-math.expm1(-2 * sample_period / correlation_time))
    kicks[:1] = drawn[1:2]
    return turn_on_deviation * drawn[0] + bias_instability * lfilter([1.0], [1.0, -decay], kicks)


def angle_variance(
    time: np.ndarray,
    angle_random_walk: float,
    turn_on_deviation: float,
    bias_instability: float,
    correlation_time: float,
) -> np.ndarray:
    """Variance (rad^2) of the error of an angle integrated from a gyro's rate, after ``time`` (s), any shape.

    s^2 t + turn_on^2 t^2 + 2 instability^2 tau^2 (t/tau - 1 + exp(-t/tau)); the last bracket is written as (t/tau)^2 /
    2 times 1F1(1; 3; -t/tau), which loses no digit at short times. angle_random_walk in rad per sqrt(s), the others in
    rad/s and s. Raises InputError as ``bias_path`` does, and for times below 0.
    """
    _check_numbers(correlation_time=correlation_time)
    _check_numbers(
        minimum=0.0,
        time=float(np.min(time)),
        walk=angle_random_walk,
        turn_on=turn_on_deviation,
        instability=bias_instability,
    )
    wander = bias_instability**2 * time**2 * hyp1f1(1, 3, -time / correlation_time)
    return angle_random_walk**2 * time + turn_on_deviation**2 * time**2 + wander


def _check_numbers(minimum: float = math.ulp(0.0), **named_values: float) -> None:
    """Raise InputError for the first number that is below ``minimum``."""
    for name, value in named_values.items():
        if not value >= minimum:
            raise InputError("", name, value, f"must be {'0 or more' if minimum == 0.0 else 'above 0'}")
