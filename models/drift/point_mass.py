"""Drift of a point mass driven by a noisy measured force, in closed form (Section 2 of the paper).

m x'' = -eta m x' + f, with an error on each sample of f of standard deviation ``deviation`` (N), held over the
sampling period ``step`` (s). Two results, each the covariance (2, 2) of the errors of position (m) and velocity
(m/s): of the stochastic differential equation (4) with the intensity deviation^2 step (eqs 8, 11 to 13), and of
the explicit Euler scheme (3) itself. They differ by O(1/n) after n steps.

The printed variances of position subtract numbers of size t that leave one of size eta^2 t^3; below
SERIES_ARGUMENT_LIMIT the same functions are summed as their power series, so that every digit is good at any damping.
"""

import math

import numpy as np
from scipy.signal import lfilter

from models.core.errors import InputError
from models.core.noise import normal_samples

SERIES_ARGUMENT_LIMIT = 1.0
"""Product of damping (1/s) and time (s) below which a power series of 20 terms is used; above it the closed form loses
no digit."""


def continuous_covariance(
    time: float, force_deviation: float, time_step: float, mass: float = 1.0, damping_rate: float = 0.0
) -> np.ndarray:
    """Covariance (2, 2) of the errors of position (m) and velocity (m/s) after ``time`` (s), by the stochastic
    differential equation (4); ``damping_rate`` eta in 1/s, zero or more.

    Raises InputError where the closed form does not hold (see ``_check_inputs``).
    """
    _check_inputs(force_deviation, time_step, mass, damping_rate, time)
    intensity, decayed = force_deviation**2 * time_step / mass**2, damping_rate * time
    position = intensity * time**3 * _position_variance_ratio(decayed)
    mixed = intensity * time**2 / 2 * _relative_decay(decayed) ** 2
    velocity = intensity * time * _relative_decay(2 * decayed)
    return np.array([[position, mixed], [mixed, velocity]])


def _relative_decay(x: float) -> float:
    """The function (1 - exp(-x)) / x; 1 at x = 0."""
    return -math.expm1(-x) / x if x else 1.0


def _position_variance_ratio(x: float) -> float:
    """Ratio of the bracket of eq. (11) to t^3 eta^2: (x + (1 - exp(-2x))/2 - 2 (1 - exp(-x))) / x^3, 1/3 at x = 0."""
    if x > SERIES_ARGUMENT_LIMIT:
        return (x - math.expm1(-2 * x) / 2 + 2 * math.expm1(-x)) / x**3
    return math.fsum((2 ** (k - 1) - 2) / math.factorial(k) * (-1) ** (k + 1) * x ** (k - 3) for k in range(3, 26))


def euler_covariance(
    step_count: int, force_deviation: float, time_step: float, mass: float = 1.0, damping_rate: float = 0.0
) -> np.ndarray:
    """Covariance (2, 2) of the errors of position (m) and velocity (m/s) after ``step_count`` steps of the explicit
    Euler scheme (3), exactly.

    With h = eta step, r = 1 - h and the sums S1, S2 of r^i and r^(2i): Var v = q S2, Cov = q step (S1 - S2) / h,
    Var x = q step^2 (n - 2 S1 + S2) / h^2, where q = (deviation step / mass)^2. Raises InputError where the
    scheme is unstable, h >= 2.
    """
    _check_inputs(force_deviation, time_step, mass, damping_rate, step_count)
    h = _damping_times_step(damping_rate * time_step)
    kick = (force_deviation * time_step / mass) ** 2
    last_sum, sum_before = _geometric_sum(h, step_count), _geometric_sum(h, step_count - 1)
    mixed = (1 - h) * last_sum * sum_before / (2 - h) if h else step_count * (step_count - 1) / 2
    velocity = _geometric_sum(h * (2 - h), step_count)
    return kick * np.array(
        [[time_step**2 * _sum_of_squares(h, step_count), time_step * mixed], [time_step * mixed, velocity]]
    )


def _damping_times_step(damping_step: float) -> float:
    """Product of damping and step, unchanged; raises InputError unless it is below 2, where the explicit Euler scheme
    is stable."""
    if damping_step >= 2:
        raise InputError(
            "", "damping", None, f"times step is {damping_step:g}: the explicit Euler scheme is unstable from 2 on"
        )
    return damping_step


def _geometric_sum(damping_step: float, step_count: int) -> float:
    """Sum of (1 - h)^i over i < n, that is (1 - (1 - h)^n) / h, with h = ``damping_step``."""
    if damping_step == 0 or step_count <= 0:
        return float(max(step_count, 0))
    return (
        -math.expm1(step_count * math.log1p(-damping_step)) / damping_step
        if damping_step < 0.5
        else (1 - (1 - damping_step) ** step_count) / damping_step
    )


def _sum_of_squares(damping_step: float, step_count: int) -> float:
    """Sum over i < n of ((1 - (1 - h)^i) / h)^2, that is (n - 2 S1 + S2) / h^2, with h = ``damping_step`` and the sums
    S1, S2 of (1 - h)^i and (1 - h)^(2i).

    For small h the binomial expansion of (2 - h) (n - 2 S1 + S2): its terms up to h^1 vanish, and the exact
    integers of the others are divided by powers of n before they become floating-point numbers.
    """
    if step_count == 0:
        return 0.0
    if step_count * damping_step > SERIES_ARGUMENT_LIMIT:
        return (
            step_count
            - 2 * _geometric_sum(damping_step, step_count)
            + _geometric_sum(damping_step * (2 - damping_step), step_count)
        ) / damping_step**2
    terms = range(2, 40)
    coefficients = (
        (
            math.comb(2 * step_count, k + 1) - 4 * math.comb(step_count, k + 1) - 2 * math.comb(step_count, k),
            step_count ** (k + 1),
        )
        for k in terms
    )
    return (
        step_count**3
        / (2 - damping_step)
        * math.fsum(
            c / d * (-step_count * damping_step) ** (k - 2) for k, (c, d) in zip(terms, coefficients, strict=True)
        )
    )


def _check_inputs(force_deviation: float, time_step: float, mass: float, damping_rate: float, duration: float) -> None:
    """Raise InputError unless deviation, damping and length are zero or more, step and mass above zero, and all
    finite."""
    finite = all(map(math.isfinite, (force_deviation, time_step, mass, damping_rate, duration)))
    if not finite or min(force_deviation, damping_rate, duration) < 0 or min(time_step, mass) <= 0:
        numbers = (
            f"deviation {force_deviation:g}, step {time_step:g}, mass {mass:g}, damping {damping_rate:g} over "
            f"{duration:g} s or steps"
        )
        raise InputError("", "point mass", None, f"none has {numbers}")


def monte_carlo_errors(
    path_count: int,
    step_count: int,
    force_deviation: float,
    time_step: float,
    mass: float = 1.0,
    damping_rate: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """Random errors (path_count, 2) of position (m) and velocity (m/s) after ``step_count`` steps of the explicit Euler
    scheme.

    Raises InputError as ``euler_covariance`` does.
    """
    _check_inputs(force_deviation, time_step, mass, damping_rate, step_count)
    _damping_times_step(damping_rate * time_step)
    kicks = (
        force_deviation
        * time_step
        / mass
        * normal_samples(seed, 0, path_count * step_count, 1).reshape(path_count, step_count)
    )
    velocity = lfilter([1.0], [1.0, damping_rate * time_step - 1.0], kicks, axis=1)
    return np.column_stack([time_step * velocity[:, :-1].sum(axis=1), velocity[:, -1]])
