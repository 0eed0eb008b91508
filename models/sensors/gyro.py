"""A gyro of one axis: white noise on each sample, and a bias that wanders.

What its angle error becomes: the white noise is a random walk of the angle, as sqrt(t) (models/sensors/inertial_unit);
the bias has two parts, the usual error model of inertial units. A turn-on part is drawn once and stays: its angle
grows as t. An instability, a first-order Gauss-Markov process b' = -b / tau + white noise that begins in its
stationary state, grows as t at first and as sqrt(t) past tau.
"""

import math

import numpy as np
from scipy.signal import lfilter
from scipy.special import hyp1f1

from models.core.errors import InputError
from models.core.noise import GYRO_BIAS, normal

DEGREES_PER_HOUR = math.pi / 180 / 3600
"""In rad/s."""
DEGREES_PER_ROOT_HOUR = math.pi / 180 / 60
"""In rad per sqrt(s)."""


def bias(
    count: int, period: float, turn_on: float, instability: float, correlation_time: float, seed: int, path: int
) -> np.ndarray:
    """Bias (count,) in rad/s at samples ``period`` (s) apart, one path of the process.

    turn_on, instability : standard deviations (rad/s); correlation_time : tau (s). The recursion over a period is
    exact, so the process does not depend on the sampling rate. Raises InputError for a time that is not above 0 or a
    deviation below it.
    """
    _check(period=period, correlation_time=correlation_time)
    _check(least=0.0, turn_on=turn_on, instability=instability)
    drawn = normal(seed, path, count + 1, 1, source=GYRO_BIAS)[:, 0]
    kept = math.exp(-period / correlation_time)
    kicks = drawn[1:] * math.sqrt(-math.expm1(-2 * period / correlation_time))
    kicks[:1] = drawn[1:2]
    return turn_on * drawn[0] + instability * lfilter([1.0], [1.0, -kept], kicks)


def angle_variance(
    time: np.ndarray, walk: float, turn_on: float, instability: float, correlation_time: float
) -> np.ndarray:
    """Variance (rad^2) of the integrated angle's error after ``time`` (s), any shape.

    s^2 t + turn_on^2 t^2 + 2 instability^2 tau^2 (t/tau - 1 + exp(-t/tau)); the last bracket is written as
    (t/tau)^2 / 2 times 1F1(1; 3; -t/tau), which loses no digit at short times. walk in rad per sqrt(s), the others
    in rad/s and s. Raises InputError as ``bias`` does, and for times below 0.
    """
    _check(correlation_time=correlation_time)
    _check(least=0.0, time=float(np.min(time)), walk=walk, turn_on=turn_on, instability=instability)
    wander = instability**2 * time**2 * hyp1f1(1, 3, -time / correlation_time)
    return walk**2 * time + turn_on**2 * time**2 + wander


def _check(least: float = math.ulp(0.0), **given: float) -> None:
    """Refuse the first number that is below the least one."""
    for name, value in given.items():
        if not value >= least:
            raise InputError("", name, value, f"must be {'0 or more' if least == 0.0 else 'above 0'}")
