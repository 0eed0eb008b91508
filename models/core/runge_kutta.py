"""One step of the classical Runge-Kutta method, for states of any shape.

Compiled marches write its four stages out, each in a dozen lines: they read their inputs from tables of their own, and
a wheelset reports contacts, copies of a car sum up outputs and the tangent moves error columns within a stage. A loop
for the two that differ in their rates alone would take more lines than it saves.
"""

from collections.abc import Callable

import numpy as np

STAGES = 4
"""Evaluations of the rates in a step."""


def step_on(rate: Callable[[float, np.ndarray], np.ndarray], time: float, state: np.ndarray, step: float) -> np.ndarray:
    """The state after a step (s), by its rate at a time (s) and a state, which is asked at 0, 1/2, 1/2 and 1 step."""
    half = 0.5 * step
    one = rate(time, state)
    two = rate(time + half, state + half * one)
    three = rate(time + half, state + half * two)
    four = rate(time + step, state + step * three)
    return state + step / 6.0 * (one + 2.0 * two + 2.0 * three + four)
