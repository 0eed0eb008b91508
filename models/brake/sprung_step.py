"""Steps of a braked vehicle on its suspension: the one text of them, for engines that Python calls or compiled code.

Each step (s) the wheels are exact under the torques that they have, with loads and slip angles in the middle of the
step, to which half a step by the accelerations leads; the engine then marches the whole step by its own Runge-Kutta
method around the compiled forces, the tyres' mean ones held at their contacts and turned with their wheels.
"""

from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from models.brake.advance import AT_REST, FINE
from models.brake.plane_step import KNOWN, begin, comes_to_rest
from models.brake.sprung import PITCH, ROLL
from models.brake.sprung_forces import STEER, hold
from models.brake.surfaces import under_wheels
from models.machine.compiled import named, njit

OVER, GAVE_UP = 6, 7
"""How a sample may end besides: the vehicle turns over; the engine gives up."""
UPRIGHT = 0.5
"""Roll and pitch (rad) beyond which the vehicle turns over."""


class OnEngine(NamedTuple):
    """What steps need besides what those in the plane need.

    numbers : the table of ``sprung_forces``; rows (W, ROW) : of its wheels; rates (W,) : changes of the wheels' speeds
    along them, kept from step to step; liveliness : see ``OnSprings``; engine : its model.
    """

    numbers: np.ndarray
    rows: np.ndarray
    rates: np.ndarray
    liveliness: float
    engine: Any


def accelerate(engine: Any, q: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    """Fill ``out`` (n,) with the accelerations of a ``FreeModel``; stands here for others, too."""
    out[:] = engine.acceleration(0.0, q, v)


def march(engine: Any, q: np.ndarray, v: np.ndarray) -> bool:
    """Move positions and rates (n,) on by its step; stands here for others, too."""
    q[:], v[:] = np.split(engine.march(q, v, 1, engine.step)[-1], 2)
    return True


def advance(state, turning, torques, step, steer, slope, plane, kind, road, tables, found, report, own):
    """As ``models.brake.advance.advance``, ``state`` (2, n) having all coordinates and their rates.

    A run begins with zeros in ``found``. The engine's step is ``step``.
    """
    q, v, wheels, size = state[0], state[1], turning.size, found.size
    surface, known, rates = np.empty((wheels, 3)), np.empty((wheels, KNOWN)), np.empty(q.size)
    regular, half, time = slope * own.liveliness * step, 0.5 * step, 0.0
    if not found.any():
        own.rates[:] = 0.0
    own.rows[:, STEER] = steer
    for n in range(torques.shape[0] - 1):
        before, after = torques[n], torques[n + 1]
        under_wheels(state, step, plane, kind, road, surface)
        begin(turning, surface, plane, known)
        hold(own.numbers, q, v, before, 0.5 * (before + after), half, own.rates, regular, True, tables, known, report)
        accelerate(own.engine, q, v, rates)
        found[:] = rates[:size]
        rest = comes_to_rest(v[:size], turning, found, step, plane)
        if rest >= 0.0:
            q += rest * v + 0.5 * rest**2 * rates
            v[:size], turning[:] = 0.0, 0.0
            if rest < step:
                return AT_REST, time + rest
        else:
            hold(
                own.numbers,
                q + half * v + 0.5 * half**2 * rates,
                v + half * rates,
                before,
                after,
                step,
                own.rates,
                regular,
                False,
                tables,
                known,
                report,
            )
            if not march(own.engine, q, v):
                return GAVE_UP, time
            turning[:] = report[:, -1]
        time += step
        if not max(abs(q[ROLL]), abs(q[PITCH])) <= UPRIGHT:
            return OVER, time
    return FINE, time


def compiled(accelerate: Callable[..., Any], march: Callable[..., Any], name: str) -> Callable[..., Any]:
    """``advance`` by an engine's own compiled functions, compiled; see ``samples.moved``."""
    put = globals() | {"accelerate": accelerate, "march": march}
    return njit(cache=True, error_model="numpy")(named(FunctionType(advance.__code__, put, "advance"), name))
