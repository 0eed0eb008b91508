"""Compiled inputs of a drive: what the driver does over time, and how high the road is at a place."""

import math

from models.machine.compiled import lean


@lean
def control(numbers, first, which, count, t):
    """Value and rate of a control at a time (s): at rest at every knot, by the smoothest step of degree 5 between."""
    knots = numbers[first + 2 * which * count :]
    if t <= knots[0]:
        return knots[count], 0.0
    for i in range(1, count):
        if t < knots[i]:
            span, rise = knots[i] - knots[i - 1], knots[count + i] - knots[count + i - 1]
            u = (t - knots[i - 1]) / span
            grown = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
            return knots[count + i - 1] + rise * grown, rise * 30.0 * (u * (1.0 - u)) ** 2 / span
    return knots[2 * count - 1], 0.0


@lean
def height(waves, count, x, y):
    """Height (m) of the road at a place (m) and its slopes along x and y: a sum of plane waves."""
    z = along = across = 0.0
    for i in range(0, 4 * count, 4):
        phase = waves[i] * x + waves[i + 1] * y
        cosine, sine = math.cos(phase), math.sin(phase)
        z += waves[i + 2] * cosine + waves[i + 3] * sine
        slope = waves[i + 3] * cosine - waves[i + 2] * sine
        along += waves[i] * slope
        across += waves[i + 1] * slope
    return z, along, across
