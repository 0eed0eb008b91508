"""The classical Runge-Kutta method in plain numpy."""

from collections.abc import Callable

import numpy as np

from models.core.runge_kutta import runge_kutta_step

Acceleration = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
"""Accelerations (n,) at a time (s), positions and rates (n,)."""


def march(acceleration: Acceleration, q: np.ndarray, v: np.ndarray, step_count: int, time_step: float) -> np.ndarray:
    """Positions and rates (steps + 1, 2 n), integrated from the start values (n,) each, by steps (s); NaN where the
    motion diverges."""
    states = np.empty((step_count + 1, 2 * len(q)))
    states[0] = np.concatenate((q, v))

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        position, speed = np.split(state, 2)
        return np.concatenate((speed, acceleration(t, position, speed)))

    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for i in range(step_count):
            states[i + 1] = runge_kutta_step(rate, i * time_step, states[i], time_step)
            if not np.isfinite(states[i + 1]).all():
                states[i + 1 :] = np.nan
                break
    return states
