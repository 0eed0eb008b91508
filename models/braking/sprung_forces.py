"""Forces on a braked vehicle on its suspension, compiled: springs and loads as they are, tyres' forces as held.

The table is that of ``models.handling.forces``, then a row of each wheel: steer angle (rad), mean forces on its tyre
along and across it over the step (N), and the mean moment that speeds up its turning (N m). What the road has beside
that moment is on the chassis: brakes hold on to it, and locked wheels do.
"""

import math

import numpy as np
from numba import carray

from models.braking.plane_step import (
    ALONG,
    ANGLE,
    ASIDE,
    CELL,
    FORCE_X,
    FORCE_Y,
    PART,
    SPIN,
    START,
    TURNED,
    TURNING,
    tyre,
)
from models.braking.tyre_table import place
from models.compiled import njit
from models.contact.stack import at, beyond
from models.handling.forces import (
    CHASSIS,
    COUNT,
    HEADER,
    JOINTS,
    LEDGER,
    OF_TYRES,
    PER_TYRE,
    PRESS,
    REPORTED,
    SLIP_Y,
    TYRES,
    _creep,
    _touch,
    enter,
    leave,
    sum_of,
)

STEER, HELD_X, HELD_Y, SPUN, ROW = range(5)
"""Columns of a wheel's row."""


@njit(cache=True, error_model="numpy")
def held_forces(numbers, q, v, f, motion):
    """Add all forces to ``f`` (n,), and fill ``motion`` (W, 3): speeds of the wheels' centres along them (m/s), of
    their contacts across (m/s), loads (N)."""
    w, chassis, rows = int(numbers[TYRES]), int(numbers[CHASSIS]), numbers[int(numbers[COUNT]) :]
    contact, slide, way, found = np.empty(10), np.empty(4), np.empty((10, 3)), np.zeros(3)
    report, ledger = np.empty(REPORTED), np.empty(LEDGER)
    frame, tree, pushed, twisted = enter(numbers, q, v, f, ledger)
    for i in range(w):
        own, row = numbers[int(numbers[OF_TYRES]) + PER_TYRE * i :], rows[ROW * i :]
        _touch(numbers, own, row[STEER], 0.0, v, chassis, frame, tree, contact, slide, way, ledger, report)
        motion[i, 0], motion[i, 1], motion[i, 2] = sum_of(way[7], way[2]), report[SLIP_Y], report[PRESS]
        found[0], found[1] = row[HELD_X], row[HELD_Y]
        _creep(own, found, way, chassis, f, tree, pushed, twisted, report)
        for k in range(3):
            twisted[chassis, k] -= row[SPUN] * way[5, k]
    leave(numbers, frame, tree, pushed, twisted, f, ledger)


@njit(cache=True, error_model="numpy")
def whole(numbers):
    """The table at a pointer to doubles."""
    head = carray(numbers, (HEADER,))
    return carray(numbers, (int(head[COUNT]) + ROW * int(head[TYRES]),))


@njit(cache=True, error_model="numpy")
def held(numbers, time, q, v, f):
    """Add the forces to ``f``, for callbacks: pointers to doubles; nothing depends on the time."""
    table = whole(numbers)
    n = int(table[JOINTS])
    motion = np.empty((int(table[TYRES]), 3))
    held_forces(table, carray(q, (n,)), carray(v, (n,)), carray(f, (n,)), motion)


@njit(cache=True, error_model="numpy")
def fill(block, n, numbers):
    """``held`` in a block of doubles at an address: f, q and v (n,), of which f is cleared before."""
    f, motion = at(block), np.empty((int(numbers[TYRES]), 3))
    carray(f, (n,))[:] = 0.0
    held_forces(numbers, carray(beyond(f, n), (n,)), carray(beyond(f, 2 * n), (n,)), carray(f, (n,)), motion)


@njit(cache=True, error_model="numpy")
def hold(numbers, q, v, torque0, torque1, step, rates, regular, first, tables, known, report):
    """Put the tyres' mean forces over a step (s) into the table, by motion and loads at the state q, v (n,).

    torque0, torque1 : of the brakes (W,) at the step's ends; first : whether the state is that at its start, and not
    that in its middle; rates (W,) : changes of the wheels' speeds along them (m/s^2), taken at its start and found in
    its middle; known : see ``plane_step``, begun there; report (W, 7) is filled.
    """
    w, angles = torque0.size, tables[0]
    motion, rows = np.empty((w, 3)), numbers[int(numbers[COUNT]) :].reshape(w, ROW)
    held_forces(numbers, q, v, np.zeros(q.size), motion)
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
