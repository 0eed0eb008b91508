"""Mean force and best linear gain of a nonlinear force law whose argument is a Gaussian process (statistical
linearisation).

Of all lines through the mean, F = E[f(x)] + g (x - E[x]) misses f(x) least in the mean square if

    g = E[f(x) (x - E[x])] / var x = E[f'(x)],

the second by Gauss's own integral by parts. For a law straight between its corners both are sums over the corners of
the normal density and distribution; for dry friction, which has no corners, an integral.
"""

import numpy as np
from scipy.special import ndtr

from models.vehicles.spatial import Curve, SpringDamper

TRAPEZOID_NODES = np.linspace(-1.0, 1.0, 801)
"""Nodes of the trapezoidal rule, which converges geometrically for smooth integrands that vanish at both ends."""
SECH_LIMIT, NORMAL_LIMIT = 20.0, 9.0
"""Ends of the integration range: sech^2 is 4 e^-40 there, the normal density e^-40."""


def mean_force_and_slope(force_curve: Curve | None, mean: float, standard_deviation: float) -> tuple[float, float]:
    """Expected values E[f(x)] (N) and E[f'(x)] (N per unit of x) of a force curve f for normally distributed x; zeros
    without a curve."""
    if force_curve is None:
        return 0.0, 0.0
    if standard_deviation == 0.0:
        return force_curve(mean), force_curve.slope_at_rest() if mean == 0.0 else _slope_of_curve(force_curve, mean)
    offset, slope, corners, bends = force_curve.hinges()
    bent, corner_distance = np.array(bends), (mean - np.array(corners)) / standard_deviation
    density = np.exp(-(corner_distance**2) / 2.0) / np.sqrt(2.0 * np.pi)
    beyond = standard_deviation * (density + corner_distance * ndtr(corner_distance))  # mean of max(x - corner, 0)
    return offset + slope * mean + float(bent @ beyond), slope + float(bent @ ndtr(corner_distance))


def _slope_of_curve(force_curve: Curve, x: float) -> float:
    """Slope of a curve at x; at a corner, the slope on the side away from rest."""
    _, slope, corners, bends = force_curve.hinges()
    return slope + sum(bend for corner, bend in zip(corners, bends, strict=True) if x >= corner)


def mean_friction_slope(friction_force: float, friction_rate: float, standard_deviation: float) -> float:
    """Expected slope E[f'(v)] (N s/m) of the friction force f(v) = friction tanh(v / friction_rate), for v normal with
    mean 0 and a standard deviation (m/s).

    With t = v / friction_rate the integrand sech^2(t) times the density of t is smooth at any ratio of the two.
    """
    ratio = standard_deviation / friction_rate
    if ratio == 0.0:
        return friction_force / friction_rate
    t = min(SECH_LIMIT, NORMAL_LIMIT * ratio) * TRAPEZOID_NODES
    density = np.exp(-((t / ratio) ** 2) / 2.0) / (np.sqrt(2.0 * np.pi) * ratio)
    return friction_force / friction_rate * float((density / np.cosh(t) ** 2).sum() * (t[1] - t[0]))


def linearised_travel_law(spring: SpringDamper, mean: float, standard_deviation: float) -> tuple[float, float, float]:
    """Statistical linearisation of a spring's force curve over travel (m): mean force (N), gain (N/m), and variance
    (N^2) of the remaining force."""
    force, gain = mean_force_and_slope(spring.travel_force, mean, standard_deviation)
    x = standard_deviation * EXPECTATION_POINTS
    law = _curve_at(spring.travel_force, mean + x)
    return force, gain, float(EXPECTATION_WEIGHTS @ (law - force - gain * x) ** 2)


def linearised_rate_law(spring: SpringDamper, standard_deviation: float) -> tuple[float, float, float]:
    """Statistical linearisation of a spring's force curve and friction over the rate (m/s): mean force (N), gain (N
    s/m), and variance (N^2) of the remaining force."""
    force, gain = mean_force_and_slope(spring.rate_force, 0.0, standard_deviation)
    gain += mean_friction_slope(spring.friction, spring.friction_rate, standard_deviation)
    x = standard_deviation * EXPECTATION_POINTS
    law = _curve_at(spring.rate_force, x) + spring.friction * np.tanh(x / spring.friction_rate)
    return force, gain, float(EXPECTATION_WEIGHTS @ (law - force - gain * x) ** 2)


EXPECTATION_POINTS = np.linspace(-8.0, 8.0, 2001)
EXPECTATION_WEIGHTS = np.exp(-(EXPECTATION_POINTS**2) / 2.0) / np.exp(-(EXPECTATION_POINTS**2) / 2.0).sum()
"""Weights of expectations over the normal distribution: good to 1e-4 for force laws with corners, enough for the
remaining force."""


def _curve_at(force_curve: Curve | None, x: np.ndarray) -> np.ndarray:
    """Forces (N) of a spring's curve at many arguments."""
    if force_curve is None:
        return np.zeros_like(x)
    offset, slope, corners, bends = force_curve.hinges()
    return offset + slope * x + np.maximum(x[:, None] - np.array(corners), 0.0) @ np.array(bends)
