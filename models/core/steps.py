"""Step counts: whether a step divides a length of time, and the nearest step that does."""

import math

MOST_STEPS = 20_000_000
"""Largest number of steps of a run: its states and its input table then take about 3 GB."""


def step_divides(time_step: float, time_length: float) -> bool:
    """Whether ``time_length`` is a whole number of steps ``time_step``, 1 or more, to the rounding of decimal input."""
    ratio = time_length / time_step
    return 0.5 <= ratio < math.inf and abs(ratio - round(ratio)) <= 1e-6 * max(1.0, ratio * 1e-3)


def dividing_step(time_step: float, time_length: float) -> str:
    """Largest short decimal up to ``time_step`` that divides ``time_length``, as text that a user would write."""
    count = max(1, math.ceil(time_length / time_step * (1.0 - 1e-9)))
    for n in range(count, 2 * count + 10_000):
        text = f"{time_length / n:.3g}"
        if math.isclose(float(text) * n, time_length, rel_tol=1e-12):
            return text
    return repr(time_length / count)
