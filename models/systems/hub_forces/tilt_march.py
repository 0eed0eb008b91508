"""Compiled recursion of the Kalman filter of roll and pitch, updated with each measured value in turn."""

from typing import NamedTuple

import numpy as np

from models.machine.compiled import njit


class Noise(NamedTuple):
    """Noise settings of the tilt filter. dt : step (s); process (4, 4) : covariance that is added in every step;
    variances (4,) : of measured roll, pitch and their rates.
    """

    dt: float
    process: np.ndarray
    variances: np.ndarray


@njit(cache=True, error_model="numpy")
def march(x, p, turning_acceleration, measured, noise, innovation_sums, filtered):
    """Filter samples 1, 2, ... from state ``x`` (4,) and covariance ``p`` (4, 4) at sample 0. Both arrays are
    overwritten by the values at the last sample.

    turning_acceleration (n, 2) : of roll and pitch (rad/s^2), constant from each sample to the next; measured (n, 4) :
    NaN where not measured. Adds to ``innovation_sums`` (5, 4), which hold for every measured value: number of
    normalised innovations, their sum, the sum of their squares, the sum of products of successive innovations, and the
    last innovation. Writes states (n, 4) and their standard deviations into ``filtered`` (2, n, 4). Returns the sum of
    the normalised innovations squared and their number.
    """
    gain, surprise, used, variances = np.empty(4), 0.0, 0, noise.variances
    for i in range(len(measured)):
        if i:
            _predict_step(x, p, turning_acceleration[i - 1], noise)
            for j in range(4):
                if np.isnan(measured[i, j]):
                    continue
                s, innovation = p[j, j] + variances[j], measured[i, j] - x[j]
                white = innovation / np.sqrt(s)
                innovation_sums[0, j] += 1.0
                innovation_sums[1, j] += white
                innovation_sums[2, j] += white * white
                innovation_sums[3, j] += white * innovation_sums[4, j]
                innovation_sums[4, j] = white
                surprise += innovation * innovation / s
                used += 1
                for k in range(4):
                    gain[k] = p[k, j] / s
                for k in range(4):
                    x[k] += gain[k] * innovation
                _update_with_value(p, gain, j, variances[j], variances[j] / s)
        for k in range(4):
            filtered[0, i, k], filtered[1, i, k] = x[k], np.sqrt(p[k, k])
    return surprise, used


@njit(cache=True, error_model="numpy")
def _update_with_value(p, gain, j, variance, remaining_share):
    """Update the covariance ``p`` with measured value j in Joseph's form, which no rounding makes negative.

    remaining_share : ratio of the value's variance to the innovation's variance, which is 1 - gain[j] computed without
    cancellation. The variance gain^2 variance that the value's error causes in another state is the least that remains
    there, even where rounding is larger.
    """
    for m in range(4):
        element = p[j, m]
        for k in range(4):
            p[k, m] -= gain[k] * element
        p[j, m] = remaining_share * element
    for k in range(4):
        element = p[k, j]
        for m in range(4):
            p[k, m] -= gain[m] * element
        p[k, j] = remaining_share * element
        for m in range(4):
            p[k, m] += gain[k] * variance * gain[m]
    for k in range(4):
        for m in range(k):
            p[k, m] = p[m, k] = 0.5 * (p[k, m] + p[m, k])
        p[k, k] = max(p[k, k], gain[k] * gain[k] * variance)


@njit(cache=True, error_model="numpy")
def _predict_step(x, p, turning_acceleration, noise):
    """Predict state ``x`` and covariance ``p`` one step ahead: angles change by their rates, rates by an
    acceleration.
    """
    dt = noise.dt
    for k in range(2):
        x[k] += dt * (x[2 + k] + 0.5 * dt * turning_acceleration[k])
        x[2 + k] += dt * turning_acceleration[k]
        for m in range(4):
            p[k, m] += dt * p[2 + k, m]
    for m in range(2):
        for k in range(4):
            p[k, m] += dt * p[k, 2 + m]
    for k in range(4):
        for m in range(4):
            p[k, m] += noise.process[k, m]
