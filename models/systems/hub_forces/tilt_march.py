"""Compiled recursion of the Kalman filter of roll and pitch, updated with each measured value in turn."""

from typing import NamedTuple

import numpy as np

from models.machine.compiled import njit


class TiltNoise(NamedTuple):
    """Noise settings of the tilt filter. dt : step (s); process (4, 4) : covariance that is added in every step;
    variances (4,) : of measured roll, pitch and their rates.
    """

    dt: float
    process: np.ndarray
    variances: np.ndarray


@njit(cache=True, error_model="numpy")
def march(state, covariance, turning_acceleration, measured_values, filter_noise, innovation_sums, filtered_states):
    """Filter samples 1, 2, ... from state ``state`` (4,) and covariance ``covariance`` (4, 4) at sample 0. Both arrays
    are overwritten by the values at the last sample.

    turning_acceleration (n, 2) : of roll and pitch (rad/s^2), constant from each sample to the next; measured (n, 4) :
    NaN where not measured. Adds to ``innovation_sums`` (5, 4), which hold for every measured value: number of
    normalised innovations, their sum, the sum of their squares, the sum of products of successive innovations, and the
    last innovation. Writes states (n, 4) and their standard deviations into ``filtered_states`` (2, n, 4). Returns the
    sum of the normalised innovations squared and their number.
    """
    gain, surprise, used, variances = np.empty(4), 0.0, 0, filter_noise.variances
    for i in range(len(measured_values)):
        if i:
            _predict_step(state, covariance, turning_acceleration[i - 1], filter_noise)
            for j in range(4):
                if np.isnan(measured_values[i, j]):
                    continue
                s, innovation = covariance[j, j] + variances[j], measured_values[i, j] - state[j]
                white = innovation / np.sqrt(s)
                innovation_sums[0, j] += 1.0
                innovation_sums[1, j] += white
                innovation_sums[2, j] += white * white
                innovation_sums[3, j] += white * innovation_sums[4, j]
                innovation_sums[4, j] = white
                surprise += innovation * innovation / s
                used += 1
                for k in range(4):
                    gain[k] = covariance[k, j] / s
                for k in range(4):
                    state[k] += gain[k] * innovation
                _update_with_value(covariance, gain, j, variances[j], variances[j] / s)
        for k in range(4):
            filtered_states[0, i, k], filtered_states[1, i, k] = state[k], np.sqrt(covariance[k, k])
    return surprise, used


@njit(cache=True, error_model="numpy")
def _update_with_value(covariance, kalman_gain, value_index, noise_variance, remaining_share):
    """Update the covariance ``covariance`` with measured value j in Joseph's form, which no rounding makes negative.

    remaining_share : ratio of the value's variance to the innovation's variance, which is 1 - gain[j] computed without
    cancellation. The variance gain^2 variance that the value's error causes in another state is the least that remains
    there, even where rounding is larger.
    """
    for m in range(4):
        element = covariance[value_index, m]
        for k in range(4):
            covariance[k, m] -= kalman_gain[k] * element
        covariance[value_index, m] = remaining_share * element
    for k in range(4):
        element = covariance[k, value_index]
        for m in range(4):
            covariance[k, m] -= kalman_gain[m] * element
        covariance[k, value_index] = remaining_share * element
        for m in range(4):
            covariance[k, m] += kalman_gain[k] * noise_variance * kalman_gain[m]
    for k in range(4):
        for m in range(k):
            covariance[k, m] = covariance[m, k] = 0.5 * (covariance[k, m] + covariance[m, k])
        covariance[k, k] = max(covariance[k, k], kalman_gain[k] * kalman_gain[k] * noise_variance)


@njit(cache=True, error_model="numpy")
def _predict_step(state, covariance, turning_acceleration, filter_noise):
    """Predict state ``state`` and covariance ``covariance`` one step ahead: angles change by their rates, rates by an
    acceleration.
    """
    dt = filter_noise.dt
    for k in range(2):
        state[k] += dt * (state[2 + k] + 0.5 * dt * turning_acceleration[k])
        state[2 + k] += dt * turning_acceleration[k]
        for m in range(4):
            covariance[k, m] += dt * covariance[2 + k, m]
    for m in range(2):
        for k in range(4):
            covariance[k, m] += dt * covariance[k, 2 + m]
    for k in range(4):
        for m in range(4):
            covariance[k, m] += filter_noise.process[k, m]
