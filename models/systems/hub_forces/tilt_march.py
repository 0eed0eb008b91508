"""Compiled recursion of the Kalman filter of roll and pitch, one measured value after another."""

from typing import NamedTuple

import numpy as np

from models.machine.compiled import njit


class Noise(NamedTuple):
    """Noise settings of the tilt filter: step dt (s); process noise (4, 4), which the covariance gains in a step;
    variances (4,) of the measured values.
    """

    dt: float
    process: np.ndarray
    variances: np.ndarray


@njit(cache=True, error_model="numpy")
def march(x, p, turning_acceleration, measured, noise, innovation_sums, filtered):
    """Filter samples 1, 2, ... from state ``x`` (4,) and covariance ``p`` (4, 4) at sample 0; both are overwritten by
    those at the last sample.

    turning_acceleration (n, 2) : rad/s^2, held from each sample on; measured (n, 4), NaN where nothing was. Adds to
    sums (5, 4), of every value's normalised innovations: how many, their sum, that of their squares, that of their
    products with the one before, and the last one. Writes the states (n, 4) and their deviations into ``filtered`` (2,
    n, 4). Returns the sum of the normalised innovations squared and how many there were.
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
def _update_with_value(p, gain, j, variance, kept_share):
    """Update the covariance with value j in Joseph's form, which no rounding makes negative.

    kept_share : ratio of the value's variance to the innovation's, which is 1 - gain[j] computed without cancellation.
    The variance gain^2 variance that the value's own error causes in another state is the least that remains there,
    even where rounding is larger.
    """
    for m in range(4):
        element = p[j, m]
        for k in range(4):
            p[k, m] -= gain[k] * element
        p[j, m] = kept_share * element
    for k in range(4):
        element = p[k, j]
        for m in range(4):
            p[k, m] -= gain[m] * element
        p[k, j] = kept_share * element
        for m in range(4):
            p[k, m] += gain[k] * variance * gain[m]
    for k in range(4):
        for m in range(k):
            p[k, m] = p[m, k] = 0.5 * (p[k, m] + p[m, k])
        p[k, k] = max(p[k, k], gain[k] * gain[k] * variance)


@njit(cache=True, error_model="numpy")
def _predict_step(x, p, turning_acceleration, noise):
    """Predict one step: the angles change by their rates, the rates by an acceleration, and the covariance
    accordingly.
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
