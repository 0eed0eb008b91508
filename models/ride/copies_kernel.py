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


class ForceLaws(NamedTuple):
    """Force laws and linear equations of motion of n coordinates over w wheels, with s nonlinear springs, u tyres that
    cannot pull, and p outputs.

    travel_rows (s, n): travel of each spring; acceleration_rows (n, 2 n + 2 w + s + u): accelerations by positions,
    rates, road, bent forces and the missing forces of tyres that cannot pull; output_rows (p, 3 n + 2 w + s + u):
    outputs by positions, rates, road, accelerations and the same forces; by_travel, by_rate: curves of the springs;
    friction (s,): N; friction_rate (s,): rate (m/s) over which friction changes its sign; tyres: the u that cannot
    pull."""

    travel_rows: np.ndarray
    acceleration_rows: np.ndarray
    output_rows: np.ndarray
    by_travel: Curves
    by_rate: Curves
    friction: np.ndarray
    friction_rate: np.ndarray
    tyres: PushingTyres


@lean
def add_scaled(total, factor, row):
    """Add ``factor`` times a row (copies,) to another row ``total``; nothing is done where the factor is 0."""
    if factor != 0.0:
        for c in range(total.size):
            total[c] += factor * row[c]


@lean
def add_curve_force(curves, spring, argument, force):
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
def fill_missing_tyre_force(tyre_index, x, road, tyres, pressed, rate, missing_force):
    """Fill ``missing_force`` (copies,) in N: the force of a tyre that cannot pull, minus that of a linear tyre. It is 0
    on the road, and cancels the pull of a lifted tyre.

    pressed, rate (copies,) are overwritten.
    """
    n, wheels, wheel = x.shape[0] // 2, road.shape[0] // 2, tyres.wheel[tyre_index]
    load, stiffness, damping = tyres.load[tyre_index], tyres.stiffness[tyre_index], tyres.damping[tyre_index]
    pressed[:], rate[:] = 0.0, 0.0
    add_scaled(pressed, 1.0, road[wheel])
    add_scaled(rate, 1.0, road[wheels + wheel])
    for j in range(n):
        add_scaled(pressed, -tyres.heights[tyre_index, j], x[j])
        add_scaled(rate, -tyres.heights[tyre_index, j], x[n + j])
    for c in range(missing_force.size):
        elastic = load + stiffness * pressed[c]
        total_force = elastic + damping * rate[c]
        missing_force[c] = max(min(total_force, 2.0 * elastic), 0.0) - total_force


@lean
def fill_rates(x, road, laws, force, state_rate, workspace):
    """Fill the time derivatives (2 n, copies) of the states (positions, then rates) on roads (2 w, copies), and the
    nonlinear forces (s + u, copies) in N; workspace (2, copies) is overwritten."""
    n, w, springs = x.shape[0] // 2, road.shape[0], laws.travel_rows.shape[0]
    for s in range(springs):
        travel, slip, bent = workspace[0], workspace[1], force[s]
        travel[:], slip[:], bent[:] = 0.0, 0.0, 0.0
        for j in range(n):
            add_scaled(travel, laws.travel_rows[s, j], x[j])
            add_scaled(slip, laws.travel_rows[s, j], x[n + j])
        add_curve_force(laws.by_travel, s, travel, bent)
        add_curve_force(laws.by_rate, s, slip, bent)
        if laws.friction[s] != 0.0:
            for c in range(bent.size):
                bent[c] += laws.friction[s] * math.tanh(slip[c] / laws.friction_rate[s])
    for u in range(laws.tyres.wheel.size):
        fill_missing_tyre_force(u, x, road, laws.tyres, workspace[0], workspace[1], force[springs + u])
    for i in range(n):
        state_rate[i], state_rate[n + i] = 0.0, 0.0
        add_scaled(state_rate[i], 1.0, x[n + i])
        for j in range(2 * n):
            add_scaled(state_rate[n + i], laws.acceleration_rows[i, j], x[j])
        for j in range(w):
            add_scaled(state_rate[n + i], laws.acceleration_rows[i, 2 * n + j], road[j])
        for s in range(force.shape[0]):
            add_scaled(state_rate[n + i], laws.acceleration_rows[i, 2 * n + w + s], force[s])


@lean
def fill_output(output_index, x, road, rate, force, laws, output):
    """Fill an output (copies,) from the states and their time derivatives."""
    n, w = x.shape[0] // 2, road.shape[0]
    output[:] = 0.0
    for j in range(2 * n):
        add_scaled(output, laws.output_rows[output_index, j], x[j])
    for j in range(w):
        add_scaled(output, laws.output_rows[output_index, 2 * n + j], road[j])
    for j in range(n):
        add_scaled(output, laws.output_rows[output_index, 2 * n + w + j], rate[n + j])
    for s in range(force.shape[0]):
        add_scaled(output, laws.output_rows[output_index, 3 * n + w + s], force[s])


@lean
def add_powers(output_values, power_sums, output_index, first_copy):
    """Add the first four powers of an output (copies,) to their sums, in columns from copy ``first_copy`` on."""
    for c in range(output_values.size):
        square = output_values[c] * output_values[c]
        power_sums[0, output_index, first_copy + c] += output_values[c]
        power_sums[1, output_index, first_copy + c] += square
        power_sums[2, output_index, first_copy + c] += square * output_values[c]
        power_sums[3, output_index, first_copy + c] += square * square


@lean
def advance_states(x, time, rate, next_states):
    """Fill ``next_states`` with the states (2 n, copies) after a time (s) at constant rates."""
    for j in range(x.shape[0]):
        for c in range(x.shape[1]):
            next_states[j, c] = x[j, c] + time * rate[j, c]


@njit(cache=True, error_model="numpy", nogil=True)
def march(states, roads, step, first_counted, stride, laws, power_sums):
    """Integrate all copies by the classical Runge-Kutta method with a fixed step (s), and sum up powers of their
    outputs.

    states (2 n, copies) are moved over roads (2 steps + 1, 2 w, copies), read every half step; power_sums (4, p,
    copies) gain the outputs, their squares, cubes and fourth powers before step ``first_counted`` and each
    ``stride``-th after it."""
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
        forces = laws.travel_rows.shape[0] + laws.tyres.wheel.size
        force, room = np.empty((forces, x.shape[1])), np.empty((2, x.shape[1]))
        for i in range(road.shape[0] // 2):
            fill_rates(x, road[2 * i], laws, force, k1, room)
            if i >= first_counted and (i - first_counted) % stride == 0:
                for p in range(laws.output_rows.shape[0]):
                    fill_output(p, x, road[2 * i], k1, force, laws, room[0])
                    add_powers(room[0], power_sums, p, copy)
            advance_states(x, 0.5 * step, k1, moved_states)
            fill_rates(moved_states, road[2 * i + 1], laws, force, k2, room)
            advance_states(x, 0.5 * step, k2, moved_states)
            fill_rates(moved_states, road[2 * i + 1], laws, force, k3, room)
            advance_states(x, step, k3, moved_states)
            fill_rates(moved_states, road[2 * i + 2], laws, force, k4, room)
            for j in range(x.shape[0]):
                for c in range(x.shape[1]):
                    x[j, c] += step / 6.0 * (k1[j, c] + 2.0 * (k2[j, c] + k3[j, c]) + k4[j, c])
        states[:, columns] = x
