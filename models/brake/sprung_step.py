"""Steps of a braked vehicle on its suspension: the one text of them, for engines that Python calls or compiled code.

Each step (s) the wheels are exact under the torques that they have, with loads and slip angles in the middle of the
step, to which half a step by the accelerations leads; the engine then marches the whole step by its own Runge-Kutta
method around the compiled forces, the tyres' mean ones held at their contacts and turned with their wheels.

Springs and loads are as they are, tyres' forces as held. The table of numbers is that of ``models.multibody.forces``,
then a row of each wheel: steer angle (rad), mean forces on its tyre along and across it over the step (N), and the mean
moment that speeds up its turning (N m). What the road has beside that moment is on the chassis: brakes hold on to it,
and locked wheels do.
"""

import math
from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from models.brake.advance import AT_REST, FINE
from models.brake.plane_step import (
    ALONG,
    ANGLE,
    ASIDE,
    CELL,
    FORCE_X,
    FORCE_Y,
    KNOWN,
    PART,
    SPIN,
    START,
    TURNED,
    TURNING,
    begin,
    comes_to_rest,
    tyre,
)
from models.brake.sprung import PITCH, ROLL
from models.brake.surfaces import under_wheels
from models.machine.compiled import lean, named, njit
from models.machine.stack import array, at, beyond, doubles, row, start
from models.multibody.forces import (
    AXLE,
    CHASSIS,
    COUNT,
    HEADER,
    JOINTS,
    LEDGER,
    OF_TYRES,
    OF_WAVES,
    PASSING,
    PER_TYRE,
    PRESS,
    REPORTED,
    ROLLING,
    SLIP_Y,
    TYRES,
    WAVES,
    WAY,
    creep,
    enter,
    leave,
    room,
    touch,
)
from models.multibody.tree import PER_LINK, dot, three, times, twist
from models.tyre.tyre_table import place

STEER, HELD_X, HELD_Y, SPUN, ROW = range(5)
"""Columns of a wheel's row."""


@lean
def held_forces(numbers, q, v, f, motion):
    """Add all forces to ``f`` (n,), and fill ``motion`` (W, 3): speeds of the wheels' centres along them (m/s), of
    their contacts across (m/s), loads (N)."""
    chassis, table = int(numbers[CHASSIS]), start(numbers)
    contact, slide, way, found = (
        array(doubles(10), (10,)),
        array(doubles(4), (4,)),
        array(doubles(WAY), (WAY,)),
        array(doubles(3), (3,)),
    )
    report, ledger = array(doubles(REPORTED), (REPORTED,)), array(doubles(LEDGER), (LEDGER,))
    frame, tree = enter(numbers, q, v, f, doubles(room(numbers)), ledger)
    waves, rows = numbers[int(numbers[OF_WAVES]) :], numbers[int(numbers[COUNT]) :]
    found[2], tyres, carrying = 0.0, beyond(table, int(numbers[OF_TYRES])), row(tree[0], PER_LINK, chassis)
    for i in range(int(numbers[TYRES])):
        own, held = row(tyres, PER_TYRE, i), rows[ROW * i :]
        touch(
            own,
            waves,
            int(numbers[WAVES]),
            held[STEER],
            0.0,
            v,
            chassis,
            frame,
            tree,
            contact,
            slide,
            way,
            ledger,
            report,
        )
        motion[i, 0] = dot(three(way, PASSING), three(way, ROLLING))
        motion[i, 1], motion[i, 2] = report[SLIP_Y], report[PRESS]
        found[0], found[1] = held[HELD_X], held[HELD_Y]
        creep(own, found, way, chassis, f, tree, report)
        twist(carrying, tree[2], times(three(way, AXLE), -held[SPUN]))
    leave(numbers, frame, tree, f, ledger)


@lean
def held(numbers, time, q, v, f):
    """Add the forces to ``f``, for callbacks: pointers to doubles; nothing depends on the time."""
    head = array(numbers, (HEADER,))
    n, w = int(head[JOINTS]), int(head[TYRES])
    motion, table = array(doubles(3 * w), (w, 3)), array(numbers, (int(head[COUNT]) + ROW * w,))
    held_forces(table, array(q, (n,)), array(v, (n,)), array(f, (n,)), motion)


@lean
def fill(block, n, numbers):
    """``held`` in a block of doubles at an address: f, q and v (n,), of which f is cleared before."""
    f, w = at(block), int(numbers[TYRES])
    array(f, (n,))[:] = 0.0
    motion = array(doubles(3 * w), (w, 3))
    held_forces(numbers, array(beyond(f, n), (n,)), array(beyond(f, 2 * n), (n,)), array(f, (n,)), motion)


@lean
def hold(numbers, q, v, torque0, torque1, step, rates, regular, first, tables, known, report):
    """Put the tyres' mean forces over a step (s) into the table, by motion and loads at the state q, v (n,).

    torque0, torque1 : of the brakes (W,) at the step's ends; first : whether the state is that at its start, and not
    that in its middle; rates (W,) : changes of the wheels' speeds along them (m/s^2), taken at its start and found in
    its middle; known : see ``plane_step``, begun there; report (W, 7) is filled.
    """
    w, n, angles = torque0.size, q.size, tables[0]
    motion, f = array(doubles(3 * w), (w, 3)), array(doubles(n), (n,))
    rows = array(beyond(start(numbers), int(numbers[COUNT])), (w, ROW))
    f[:] = 0.0
    held_forces(numbers, q, v, f, motion)
    for i in range(w):
        own, u, across = known[i], motion[i, 0], motion[i, 1]
        if first:
            own[START] = u
        else:
            rates[i] = (u - own[START]) / (0.5 * step)
        forwards = u if own[START] >= 0.0 else -u
        own[ALONG], own[ASIDE] = max(forwards, 0.0), across
        own[ANGLE] = math.atan2(abs(across), max(forwards, regular))
        own[CELL], own[PART] = place(angles, own[ANGLE])
        tyre(own, rates[i], motion[i, 2], torque0[i], torque1[i], step, tables, report[i])
        rows[i, HELD_X], rows[i, HELD_Y] = report[i, FORCE_X], report[i, FORCE_Y]
        rows[i, SPUN] = own[SPIN] * (report[i, TURNING] - own[TURNED]) / step


OVER, GAVE_UP = 6, 7
"""How a sample may end besides: the vehicle turns over; the engine gives up."""
UPRIGHT = 0.5
"""Roll and pitch (rad) beyond which the vehicle turns over."""


class OnEngine(NamedTuple):
    """What steps need besides what those in the plane need.

    numbers : the table; rows (W, ROW) : of its wheels; rates (W,) : changes of the wheels' speeds
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
