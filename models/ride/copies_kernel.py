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


class ForceCurves(NamedTuple):
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
    by_travel: ForceCurves
    by_rate: ForceCurves
    friction: np.ndarray
    friction_rate: np.ndarray
    tyres: PushingTyres


@lean
def add_scaled(total_row, factor, added_row):
    """Add ``factor`` times a row (copies,) to another row ``total_row``; nothing is done where the factor is 0."""
    if factor != 0.0:
        for c in range(total_row.size):
            total_row[c] += factor * added_row[c]


@lean
def add_curve_force(curves, spring_index, travel_or_rate, force):
    """Add to ``force`` (copies,) in N the force of a spring's curve at its travel (m) or rate (m/s), ``travel_or_rate``
    (copies,)."""
    offset, slope = curves.offset[spring_index], curves.slope[spring_index]
    for c in range(force.size):
        force[c] += offset + slope * travel_or_rate[c]
    for k in range(curves.corners.shape[1]):
        corner, bend = curves.corners[spring_index, k], curves.bends[spring_index, k]
        if bend != 0.0:
            for c in range(force.size):
                force[c] += bend * max(travel_or_rate[c] - corner, 0.0)


@lean
def fill_missing_tyre_force(
    tyre_index, vehicle_states, road_heights, pushing_tyres, tyre_compression, compression_rate, missing_force
):
    """Fill ``missing_force`` (copies,) in N: the force of a tyre that cannot pull, minus that of a linear tyre. It is 0
    on the road, and cancels the pull of a lifted tyre.

    pressed, rate (copies,) are overwritten.
    """
    n, wheels, wheel = vehicle_states.shape[0] // 2, road_heights.shape[0] // 2, pushing_tyres.wheel[tyre_index]
    load, stiffness, damping = (
        pushing_tyres.load[tyre_index],
        pushing_tyres.stiffness[tyre_index],
        pushing_tyres.damping[tyre_index],
    )
    tyre_compression[:], compression_rate[:] = 0.0, 0.0
    add_scaled(tyre_compression, 1.0, road_heights[wheel])
    add_scaled(compression_rate, 1.0, road_heights[wheels + wheel])
    for j in range(n):
        add_scaled(tyre_compression, -pushing_tyres.heights[tyre_index, j], vehicle_states[j])
        add_scaled(compression_rate, -pushing_tyres.heights[tyre_index, j], vehicle_states[n + j])
    for c in range(missing_force.size):
        elastic = load + stiffness * tyre_compression[c]
        total_force = elastic + damping * compression_rate[c]
        missing_force[c] = max(min(total_force, 2.0 * elastic), 0.0) - total_force


@lean
def fill_state_rates(vehicle_states, road_heights, force_laws, nonlinear_forces, state_rate, workspace):
    """Fill the time derivatives (2 n, copies) of the states (positions, then rates) on roads (2 w, copies), and the
    nonlinear forces (s + u, copies) in N; workspace (2, copies) is overwritten."""
    n, w, springs = vehicle_states.shape[0] // 2, road_heights.shape[0], force_laws.travel_rows.shape[0]
    for s in range(springs):
        travel, slip, bent = workspace[0], workspace[1], nonlinear_forces[s]
        travel[:], slip[:], bent[:] = 0.0, 0.0, 0.0
        for j in range(n):
            add_scaled(travel, force_laws.travel_rows[s, j], vehicle_states[j])
            add_scaled(slip, force_laws.travel_rows[s, j], vehicle_states[n + j])
        add_curve_force(force_laws.by_travel, s, travel, bent)
        add_curve_force(force_laws.by_rate, s, slip, bent)
        if force_laws.friction[s] != 0.0:
            for c in range(bent.size):
                bent[c] += force_laws.friction[s] * math.tanh(slip[c] / force_laws.friction_rate[s])
    for u in range(force_laws.tyres.wheel.size):
        fill_missing_tyre_force(
            u, vehicle_states, road_heights, force_laws.tyres, workspace[0], workspace[1], nonlinear_forces[springs + u]
        )
    for i in range(n):
        state_rate[i], state_rate[n + i] = 0.0, 0.0
        add_scaled(state_rate[i], 1.0, vehicle_states[n + i])
        for j in range(2 * n):
            add_scaled(state_rate[n + i], force_laws.acceleration_rows[i, j], vehicle_states[j])
        for j in range(w):
            add_scaled(state_rate[n + i], force_laws.acceleration_rows[i, 2 * n + j], road_heights[j])
        for s in range(nonlinear_forces.shape[0]):
            add_scaled(state_rate[n + i], force_laws.acceleration_rows[i, 2 * n + w + s], nonlinear_forces[s])


@lean
def fill_output(output_index, vehicle_states, road_heights, state_rates, nonlinear_forces, force_laws, output):
    """Fill an output (copies,) from the states and their time derivatives."""
    n, w = vehicle_states.shape[0] // 2, road_heights.shape[0]
    output[:] = 0.0
    for j in range(2 * n):
        add_scaled(output, force_laws.output_rows[output_index, j], vehicle_states[j])
    for j in range(w):
        add_scaled(output, force_laws.output_rows[output_index, 2 * n + j], road_heights[j])
    for j in range(n):
        add_scaled(output, force_laws.output_rows[output_index, 2 * n + w + j], state_rates[n + j])
    for s in range(nonlinear_forces.shape[0]):
        add_scaled(output, force_laws.output_rows[output_index, 3 * n + w + s], nonlinear_forces[s])


@lean
def add_output_powers(output_values, power_sums, output_index, first_copy):
    """Add the first four powers of an output (copies,) to their sums, in columns from copy ``first_copy`` on."""
    for c in range(output_values.size):
        square = output_values[c] * output_values[c]
        power_sums[0, output_index, first_copy + c] += output_values[c]
        power_sums[1, output_index, first_copy + c] += square
        power_sums[2, output_index, first_copy + c] += square * output_values[c]
        power_sums[3, output_index, first_copy + c] += square * square


@lean
def advance_states(vehicle_states, duration, state_rates, next_states):
    """Fill ``next_states`` with the states (2 n, copies) after a time (s) at constant rates."""
    for j in range(vehicle_states.shape[0]):
        for c in range(vehicle_states.shape[1]):
            next_states[j, c] = vehicle_states[j, c] + duration * state_rates[j, c]


@njit(cache=True, error_model="numpy", nogil=True)
def march_copies(vehicle_states, road_paths, time_step, first_counted_step, counting_stride, force_laws, power_sums):
    """Integrate all copies by the classical Runge-Kutta method with a fixed step (s), and sum up powers of their
    outputs.

    states (2 n, copies) are moved over roads (2 steps + 1, 2 w, copies), read every half step; power_sums (4, p,
    copies) gain the outputs, their squares, cubes and fourth powers before step ``first_counted_step`` and each
    ``counting_stride``-th after it."""
    for copy in range(0, vehicle_states.shape[1], COPIES_SIDE_BY_SIDE):
        columns = slice(copy, min(copy + COPIES_SIDE_BY_SIDE, vehicle_states.shape[1]))
        x, road = vehicle_states[:, columns].copy(), road_paths[:, :, columns].copy()
        k1, k2, k3, k4, moved_states = (
            np.empty_like(x),
            np.empty_like(x),
            np.empty_like(x),
            np.empty_like(x),
            np.empty_like(x),
        )
        forces = force_laws.travel_rows.shape[0] + force_laws.tyres.wheel.size
        force, room = np.empty((forces, x.shape[1])), np.empty((2, x.shape[1]))
        for i in range(road.shape[0] // 2):
            fill_state_rates(x, road[2 * i], force_laws, force, k1, room)
            if i >= first_counted_step and (i - first_counted_step) % counting_stride == 0:
                for p in range(force_laws.output_rows.shape[0]):
                    fill_output(p, x, road[2 * i], k1, force, force_laws, room[0])
                    add_output_powers(room[0], power_sums, p, copy)
            advance_states(x, 0.5 * time_step, k1, moved_states)
            fill_state_rates(moved_states, road[2 * i + 1], force_laws, force, k2, room)
            advance_states(x, 0.5 * time_step, k2, moved_states)
            fill_state_rates(moved_states, road[2 * i + 1], force_laws, force, k3, room)
            advance_states(x, time_step, k3, moved_states)
            fill_state_rates(moved_states, road[2 * i + 2], force_laws, force, k4, room)
            for j in range(x.shape[0]):
                for c in range(x.shape[1]):
                    x[j, c] += time_step / 6.0 * (k1[j, c] + 2.0 * (k2[j, c] + k3[j, c]) + k4[j, c])
        vehicle_states[:, columns] = x
