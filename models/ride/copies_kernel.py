"""Compiled time integration of many copies of a vehicle with nonlinear springs, or with tyres that may lift off."""

import math
from typing import NamedTuple

import numpy as np

from models.machine.compiled import lean, njit

POWERS_SUMMED = 4
"""Count of powers of the outputs, from the first on, that are summed."""
COPIES_SIDE_BY_SIDE = 64
"""Count of copies that are integrated side by side in vector registers: one after the other they take four times as
long."""


class Curves(NamedTuple):
    """Piecewise linear force curves of s springs: forces (N) over travel (m) or rate (m/s), as offset and first slope
    (s,), and changes of slope, bends (s, k), at k corners (s, k); unused bends are 0."""

    offset: np.ndarray
    slope: np.ndarray
    corners: np.ndarray
    bends: np.ndarray


class PushingTyres(NamedTuple):
    """Tyres that cannot pull: index (u,) of the wheel of each, static load (u,) in N, stiffness (u,) in N/m, damping
    (u,) in N s/m, heights (u, n): rise of the wheel per coordinate."""

    wheel: np.ndarray
    load: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    heights: np.ndarray


class Laws(NamedTuple):
    """Force laws and linear equations of motion of n coordinates over w wheels, with s nonlinear springs, u tyres that
    cannot pull, and p outputs.

    rows (s, n): travel of each spring; motion (n, 2 n + 2 w + s + u): accelerations by positions, rates, road, bent
    forces and what tyres that only push have beside linear ones; read (p, 3 n + 2 w + s + u): outputs by positions,
    rates, road, accelerations and the same forces; by_travel, by_rate: curves of the springs; friction (s,): N;
    turning (s,): rate (m/s) over which friction turns; tyres: the u that only push.
    """

    rows: np.ndarray
    motion: np.ndarray
    read: np.ndarray
    by_travel: Curves
    by_rate: Curves
    friction: np.ndarray
    turning: np.ndarray
    tyres: PushingTyres


@lean
def add(total, factor, values):
    """Add ``factor`` times a row (copies,) to another row ``total``; nothing is done where the factor is 0."""
    if factor != 0.0:
        for c in range(total.size):
            total[c] += factor * values[c]


@lean
def on_curve(curves, spring, argument, force):
    """Add to ``force`` (copies,) in N the force of a spring's curve at its travel (m) or rate (m/s), ``argument``
    (copies,)."""
    offset, slope = curves.offset[spring], curves.slope[spring]
    for c in range(force.size):
        force[c] += offset + slope * argument[c]
    for k in range(curves.corners.shape[1]):
        corner, bend = curves.corners[spring, k], curves.bends[spring, k]
        if bend != 0.0:
            for c in range(force.size):
                force[c] += bend * max(argument[c] - corner, 0.0)


@lean
def off_road(u, x, road, tyres, pressed, rate, missing_force):
    """Fill ``missing_force`` (copies,) in N: the force of a tyre that cannot pull, minus that of a linear tyre. It is 0
    on the road, and cancels the pull of a lifted tyre.

    pressed, rate (copies,) are overwritten.
    """
    n, wheels, wheel = x.shape[0] // 2, road.shape[0] // 2, tyres.wheel[u]
    load, stiffness, damping = tyres.load[u], tyres.stiffness[u], tyres.damping[u]
    pressed[:], rate[:] = 0.0, 0.0
    add(pressed, 1.0, road[wheel])
    add(rate, 1.0, road[wheels + wheel])
    for j in range(n):
        add(pressed, -tyres.heights[u, j], x[j])
        add(rate, -tyres.heights[u, j], x[n + j])
    for c in range(missing_force.size):
        elastic = load + stiffness * pressed[c]
        total_force = elastic + damping * rate[c]
        missing_force[c] = max(min(total_force, 2.0 * elastic), 0.0) - total_force


@lean
def fill_rates(x, road, laws, force, state_rate, workspace):
    """Fill the time derivatives (2 n, copies) of the states (positions, then rates) on roads (2 w, copies), and the
    nonlinear forces (s + u, copies) in N."""
    n, w, springs = x.shape[0] // 2, road.shape[0], laws.rows.shape[0]
    for s in range(springs):
        travel, slip, bent = workspace[0], workspace[1], force[s]
        travel[:], slip[:], bent[:] = 0.0, 0.0, 0.0
        for j in range(n):
            add(travel, laws.rows[s, j], x[j])
            add(slip, laws.rows[s, j], x[n + j])
        on_curve(laws.by_travel, s, travel, bent)
        on_curve(laws.by_rate, s, slip, bent)
        if laws.friction[s] != 0.0:
            for c in range(bent.size):
                bent[c] += laws.friction[s] * math.tanh(slip[c] / laws.turning[s])
    for u in range(laws.tyres.wheel.size):
        off_road(u, x, road, laws.tyres, workspace[0], workspace[1], force[springs + u])
    for i in range(n):
        state_rate[i], state_rate[n + i] = 0.0, 0.0
        add(state_rate[i], 1.0, x[n + i])
        for j in range(2 * n):
            add(state_rate[n + i], laws.motion[i, j], x[j])
        for j in range(w):
            add(state_rate[n + i], laws.motion[i, 2 * n + j], road[j])
        for s in range(force.shape[0]):
            add(state_rate[n + i], laws.motion[i, 2 * n + w + s], force[s])


@lean
def fill_output(p, x, road, rate, force, laws, output):
    """Fill output p (copies,) from the states and their time derivatives."""
    n, w = x.shape[0] // 2, road.shape[0]
    output[:] = 0.0
    for j in range(2 * n):
        add(output, laws.read[p, j], x[j])
    for j in range(w):
        add(output, laws.read[p, 2 * n + j], road[j])
    for j in range(n):
        add(output, laws.read[p, 2 * n + w + j], rate[n + j])
    for s in range(force.shape[0]):
        add(output, laws.read[p, 3 * n + w + s], force[s])


@lean
def sum_up(output_values, power_sums, p, first):
    """Add the first four powers of output p (copies,) to their sums, in columns from copy ``first`` on."""
    for c in range(output_values.size):
        square = output_values[c] * output_values[c]
        power_sums[0, p, first + c] += output_values[c]
        power_sums[1, p, first + c] += square
        power_sums[2, p, first + c] += square * output_values[c]
        power_sums[3, p, first + c] += square * square


@lean
def states_ahead(x, time, rate, next_states):
    """Fill ``next_states`` with the states (2 n, copies) after a time (s) at constant rates."""
    for j in range(x.shape[0]):
        for c in range(x.shape[1]):
            next_states[j, c] = x[j, c] + time * rate[j, c]


@njit(cache=True, error_model="numpy", nogil=True)
def march(states, roads, step, first, every, laws, power_sums):
    """Integrate all copies by the classical Runge-Kutta method with a fixed step (s), and sum up powers of their
    outputs.

    states (2 n, copies) are moved over roads (2 steps + 1, 2 w, copies), read every half step; sums (4, p, copies) gain
    the outputs, their squares, cubes and fourth powers before step ``first`` and each ``every``-th after it.
    """
    for copy in range(0, states.shape[1], COPIES_SIDE_BY_SIDE):
        columns = slice(copy, min(copy + COPIES_SIDE_BY_SIDE, states.shape[1]))
        x, road = states[:, columns].copy(), roads[:, :, columns].copy()
        k1, k2, k3, k4, moved_states = (
            np.empty_like(x),
            np.empty_like(x),
            np.empty_like(x),
            np.empty_like(x),
            np.empty_like(x),
        )
        forces = laws.rows.shape[0] + laws.tyres.wheel.size
        force, room = np.empty((forces, x.shape[1])), np.empty((2, x.shape[1]))
        for i in range(road.shape[0] // 2):
            fill_rates(x, road[2 * i], laws, force, k1, room)
            if i >= first and (i - first) % every == 0:
                for p in range(laws.read.shape[0]):
                    fill_output(p, x, road[2 * i], k1, force, laws, room[0])
                    sum_up(room[0], power_sums, p, copy)
            states_ahead(x, 0.5 * step, k1, moved_states)
            fill_rates(moved_states, road[2 * i + 1], laws, force, k2, room)
            states_ahead(x, 0.5 * step, k2, moved_states)
            fill_rates(moved_states, road[2 * i + 1], laws, force, k3, room)
            states_ahead(x, step, k3, moved_states)
            fill_rates(moved_states, road[2 * i + 2], laws, force, k4, room)
            for j in range(x.shape[0]):
                for c in range(x.shape[1]):
                    x[j, c] += step / 6.0 * (k1[j, c] + 2.0 * (k2[j, c] + k3[j, c]) + k4[j, c])
        states[:, columns] = x
