"""Compiled loops over copies of a vehicle whose springs are bent: its laws, and steps of the Runge-Kutta method."""

import math
from typing import NamedTuple

import numpy as np

from models.compiled import lean, njit

TRAVEL, RATE = 0, 1
"""What a curve is over: the first index of its hinges."""
POWERS = 4
"""Of the outputs, from the first on, that are summed."""


class Laws(NamedTuple):
    """Small motion of n coordinates over w wheels with s bent springs and p outputs.

    rows (s, n): travel of each spring; motion (n, 2 n + 2 w + s): accelerations by positions, rates, road and bent
    forces; read (p, 3 n + 2 w + s): outputs by positions, rates, road, accelerations and bent forces; lines (2, s, 2):
    offset and first slope of the curves over travel and over rate; corners, bends (2, s, k): what they have at k
    corners, a bend of 0 where they have fewer; friction (s, 2): N, and the rate (m/s) over which it turns.
    """

    rows: np.ndarray
    motion: np.ndarray
    read: np.ndarray
    lines: np.ndarray
    corners: np.ndarray
    bends: np.ndarray
    friction: np.ndarray


@lean
def on_curve(kind, spring, argument, laws):
    """Force (N) of a spring's curve over its travel or rate."""
    total = laws.lines[kind, spring, 0] + laws.lines[kind, spring, 1] * argument
    for k in range(laws.corners.shape[2]):
        total += laws.bends[kind, spring, k] * max(argument - laws.corners[kind, spring, k], 0.0)
    return total


@lean
def rates(x, road, laws, force, out):
    """Fill the rates (2 n,) of a state, positions, then rates, on a road (2 w,), and the bent forces (s,) in N."""
    n, w = x.size // 2, road.size
    for s in range(force.size):
        travel, slip = 0.0, 0.0
        for j in range(n):
            travel += laws.rows[s, j] * x[j]
            slip += laws.rows[s, j] * x[n + j]
        force[s] = on_curve(TRAVEL, s, travel, laws) + on_curve(RATE, s, slip, laws)
        if laws.friction[s, 0] != 0.0:
            force[s] += laws.friction[s, 0] * math.tanh(slip / laws.friction[s, 1])
    for i in range(n):
        total = 0.0
        for j in range(2 * n):
            total += laws.motion[i, j] * x[j]
        for j in range(w):
            total += laws.motion[i, 2 * n + j] * road[j]
        for s in range(force.size):
            total += laws.motion[i, 2 * n + w + s] * force[s]
        out[i], out[n + i] = x[n + i], total


@lean
def output(p, x, road, rate, force, laws):
    """One output of a state with its rates."""
    n, w, total = x.size // 2, road.size, 0.0
    for j in range(2 * n):
        total += laws.read[p, j] * x[j]
    for j in range(w):
        total += laws.read[p, 2 * n + j] * road[j]
    for j in range(n):
        total += laws.read[p, 2 * n + w + j] * rate[n + j]
    for s in range(force.size):
        total += laws.read[p, 3 * n + w + s] * force[s]
    return total


@lean
def ahead(x, time, rate, moved):
    """Fill the state (2 n,) that a rate leads to in a time (s)."""
    for j in range(x.size):
        moved[j] = x[j] + time * rate[j]


@njit(cache=True, error_model="numpy", nogil=True)
def march(states, roads, step, first, every, laws, sums):
    """Step copies (s) by the classical Runge-Kutta method, and add up powers of their outputs on the way.

    states (2 n, copies) are moved over roads (2 steps + 1, 2 w, copies), read every half step; sums (4, p, copies) gain
    the outputs, their squares, cubes and fourth powers before step ``first`` and each ``every``-th after it.
    """
    size, force = states.shape[0], np.empty(laws.rows.shape[0])
    k1, k2, k3, k4, moved = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    for copy in range(states.shape[1]):
        x, road = states[:, copy].copy(), roads[:, :, copy].copy()
        for i in range(road.shape[0] // 2):
            rates(x, road[2 * i], laws, force, k1)
            if i >= first and (i - first) % every == 0:
                for p in range(laws.read.shape[0]):
                    value = output(p, x, road[2 * i], k1, force, laws)
                    for power in range(POWERS):
                        sums[power, p, copy] += value ** (power + 1)
            ahead(x, 0.5 * step, k1, moved)
            rates(moved, road[2 * i + 1], laws, force, k2)
            ahead(x, 0.5 * step, k2, moved)
            rates(moved, road[2 * i + 1], laws, force, k3)
            ahead(x, step, k3, moved)
            rates(moved, road[2 * i + 2], laws, force, k4)
            for j in range(size):
                x[j] += step / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j])
        states[:, copy] = x
