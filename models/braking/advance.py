"""One sample of the laboratory method: from what the controller commands to the state at the next sample."""

import math
from typing import NamedTuple

import numpy as np

from models.braking.brake import torque
from models.braking.plane_step import step_on
from models.braking.surfaces import under_wheels
from models.compiled import njit

RELEASE, HOLD, APPLY = -1, 0, 1
"""States of a valve."""
FINE, AT_REST, NOT_FOUND, LIFTED = range(4)
"""How a sample ended: still moving; standing; loads not found; a wheel without load, which the plane cannot have."""


class Chambers(NamedTuple):
    """How chambers (W,) fill and empty: time constants (s) of their first-order pressure; supply pressure (bar)."""

    fill: np.ndarray
    empty: np.ndarray
    supply: float


@njit(cache=True, error_model="numpy")
def chamber(pressure, valve, time, fill, empty, supply):
    """Pressure (bar) of a chamber after a time (s) with its valve in a state."""
    if valve == APPLY:
        return supply + (pressure - supply) * math.exp(-time / fill)
    return pressure * math.exp(-time / empty) if valve == RELEASE else pressure


@njit(cache=True, error_model="numpy")
def advance(state, turning, pressure, torques, valves, chambers, brakes, steps, step, steer, slope, plane, kind, road,
            tables, found, report):  # fmt: skip
    """Go on by ``steps`` steps (s) with the valves (W,) as they are; all of the state is moved in place.

    state (2, 2 + U), turning (W,): of ``step_on``; pressure (W,): bar; torques (W,): N m, with which the hysteresis
    remembers; steer (W,): rad; slope: largest cornering coefficient of the tables (1/rad); found (2 + U,), report
    (W, 7): of ``step_on``. Returns how it ended and the time (s) that passed.
    """
    surface, after, time = np.empty((turning.size, 3)), np.empty(turning.size), 0.0
    for _ in range(steps):
        for i in range(turning.size):
            pressure[i] = chamber(pressure[i], valves[i], step, chambers.fill[i], chambers.empty[i], chambers.supply)
            after[i] = torque(i, pressure[i], torques[i], brakes)
        under_wheels(state, step, plane, kind, road, surface)
        used = step_on(state, turning, torques, after, step, steer, surface, slope * 9.81 * step, plane, tables, found,
                       report)  # fmt: skip
        torques[:] = after
        if used < 0.0:
            return NOT_FOUND, time
        time += used
        if used < step:
            return AT_REST, time
        for i in range(turning.size):
            if report[i, 2] <= 0.0:
                return LIFTED, time
    return FINE, time
