"""Road surface under a vehicle that may leave its lane, and the driver's controls over time, in plain numpy."""

from itertools import pairwise

import numpy as np

Knots = tuple[tuple[float, float], ...]
"""Knots of a control: pairs of time (s) and value."""


def road_surface(road_waves: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights (m) and slopes along x and y, (w,) each, of the road at positions x, y (m): the real part of a sum of
    plane waves.

    road_waves (k, 4) : wave numbers along x and y (rad/m), amplitudes of cosine and sine (m).
    """
    amplitudes = road_waves[:, 2] - 1j * road_waves[:, 3]
    each = amplitudes * np.exp(1j * (np.multiply.outer(x, road_waves[:, 0]) + np.multiply.outer(y, road_waves[:, 1])))
    return each.real.sum(1), (1j * each).real @ road_waves[:, 0], (1j * each).real @ road_waves[:, 1]


def control_value(control_knots: Knots, t: float) -> tuple[float, float]:
    """Value and rate (per s) of a control at a time (s): at rest at knots; between knots it changes by the fraction 6
    u^5 - 15 u^4 + 10 u^3 of its rise."""
    for (start, low), (end, high) in pairwise(control_knots):
        if start < t < end:
            u = (t - start) / (end - start)
            part, slope = ((6.0 * u - 15.0) * u + 10.0) * u**3, 30.0 * (u - u * u) ** 2
            return low + (high - low) * part, (high - low) * slope / (end - start)
    return next((value for time, value in reversed(control_knots) if time <= t), control_knots[0][1]), 0.0
