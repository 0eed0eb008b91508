"""Copies of a nonlinear ride, compiled, held to a march of the same laws in whole arrays of numpy."""

import numpy as np
import pytest

from models.ride.copies_kernel import COPIES_SIDE_BY_SIDE, ForceCurves, ForceLaws, PushingTyres, march_copies

pytestmark = pytest.mark.grounds("plain counterpart")
N, WHEELS, SPRINGS, OUTPUTS, STEPS, STEP = 3, 2, 2, 2, 12, 2e-3
KNOTS = np.array([-0.3, 0.1, 0.4])


def curves(random):
    """Curves of every spring: offset, first slope, and bends at corners, the last spring with one less."""
    corners, bends = np.tile(KNOTS, (SPRINGS, 1)), random.normal(size=(SPRINGS, KNOTS.size))
    bends[-1, -1] = 0.0
    return ForceCurves(random.normal(size=SPRINGS), random.normal(size=SPRINGS), corners, bends)


def laws(random):
    """Random laws; the second wheel has a tyre that only pushes."""
    forces = SPRINGS + 1
    tyres = PushingTyres(np.array([1]), np.array([0.3]), np.array([2.0]), np.array([0.4]), random.normal(size=(1, N)))
    return ForceLaws(
        random.normal(size=(SPRINGS, N)),
        random.normal(size=(N, 2 * N + 2 * WHEELS + forces)),
        random.normal(size=(OUTPUTS, 3 * N + 2 * WHEELS + forces)),
        curves(random),
        curves(random),
        np.array([0.7, 0.0]),
        np.array([0.2, 1.0]),
        tyres,
    )


def on_curve(of, spring, x):
    """Force of a curve at x (copies,): its value where the first line meets the corners, and lines between them."""
    corners = of.corners[spring]
    nodes = np.concatenate(([corners[0] - 50.0], corners, [corners[-1] + 50.0]))
    slopes = of.slope[spring] + np.concatenate(([0.0], np.cumsum(of.bends[spring])))
    first = of.offset[spring] + of.slope[spring] * nodes[0]
    return np.interp(x, nodes, np.concatenate(([first], first + np.cumsum(slopes * np.diff(nodes)))))


def rates(x, road, of):
    """Rates (2 N, copies) and nonlinear forces (s + u, copies) by the laws' definitions."""
    q, v, tyre = x[:N], x[N:], of.tyres
    travel, slip = of.travel_rows @ q, of.travel_rows @ v
    bent = [on_curve(of.by_travel, s, travel[s]) + on_curve(of.by_rate, s, slip[s]) for s in range(SPRINGS)]
    dry = of.friction[:, None] * np.tanh(slip / of.friction_rate[:, None])
    off = []
    for u, wheel in enumerate(tyre.wheel):
        elastic = tyre.load[u] + tyre.stiffness[u] * (road[wheel] - tyre.heights[u] @ q)
        linear = elastic + tyre.damping[u] * (road[WHEELS + wheel] - tyre.heights[u] @ v)
        off.append(np.where(elastic > 0.0, np.clip(linear, 0.0, 2.0 * np.abs(elastic)), 0.0) - linear)
    force = np.vstack((bent + dry, off))
    return np.vstack((v, of.acceleration_rows @ np.vstack((x, road, force)))), force


def marched(x, roads, of, first, every):
    """States at the end, and the sums (4, p, copies) of powers of the outputs."""
    sums = np.zeros((4, OUTPUTS, x.shape[1]))
    for i in range(STEPS):
        begin, middle, end = roads[2 * i : 2 * i + 3]
        k1, force = rates(x, begin, of)
        if i >= first and (i - first) % every == 0:
            y = of.output_rows @ np.vstack((x, begin, k1[N:], force))
            sums += np.array([y**power for power in (1, 2, 3, 4)])
        k2 = rates(x + 0.5 * STEP * k1, middle, of)[0]
        k3 = rates(x + 0.5 * STEP * k2, middle, of)[0]
        x = x + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rates(x + STEP * k3, end, of)[0])
    return x, sums


def test_states_and_sums_of_powers_are_those_of_whole_arrays():
    """More copies than are stepped side by side; some tyres in the air, travels on both sides of every corner."""
    random = np.random.default_rng(9)
    of, copies = laws(random), COPIES_SIDE_BY_SIDE + 5
    start = random.normal(0.0, 0.5, (2 * N, copies))
    roads = random.normal(0.0, 0.3, (2 * STEPS + 1, 2 * WHEELS, copies))
    states, sums = start.copy(), np.zeros((4, OUTPUTS, copies))
    march_copies(states, roads, STEP, 3, 2, of, sums)
    end, expected = marched(start, roads, of, 3, 2)
    air = rates(start, roads[0], of)[1][SPRINGS:] != 0.0
    assert air.any() and not air.all()
    assert states == pytest.approx(end, rel=1e-11, abs=1e-12)
    assert sums == pytest.approx(expected, rel=1e-10, abs=1e-10)
