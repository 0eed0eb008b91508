"""One step of the classical Runge-Kutta method, for states of any shape.

Compiled marches write its four stages out, each in a dozen lines: they read their inputs from tables of their own, and
a wheelset reports contacts, copies of a car sum up outputs and the tangent moves error columns within a stage. A loop
for the two that differ in their rates alone would take more lines than it saves.
"""

from collections.abc import Callable

import numpy as np

RK4_STAGES = 4
"""Evaluations of the right-hand side per step of the classical Runge-Kutta method."""


def runge_kutta_step(
    state_rate: Callable[[float, np.ndarray], np.ndarray], time: float, state: np.ndarray, time_step: float
) -> np.ndarray:
    """State after one classical Runge-Kutta step (s). ``state_rate`` gives the derivative at a time (s) and state; it
    is evaluated at 0, 1/2, 1/2 and 1 step."""
    half = 0.5 * time_step
    first = state_rate(time, state)
    second = state_rate(time + half, state + half * first)
    third = state_rate(time + half, state + half * second)
    fourth = state_rate(time + time_step, state + time_step * third)
    return state + time_step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
