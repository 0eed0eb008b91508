"""A run of a linear scene in time, by the classical Runge-Kutta method: what it makes of deviations at a step.

Copies of the vehicle meet random roads of their own; the same roads are run in steps a quarter as long, so that chance
is in both and hardly in their ratio.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from models.advice.ride_choice.march import March
from models.core.runge_kutta import STAGES, step_on
from models.ride.covariance import noise_of
from models.ride.road_path import RoadPath

FINER = 4
"""Steps of the run beside it are so many times as short."""
COPIES, LONGEST, STEPS = 48, 20.0, 1500
"""Copies; each runs for so many seconds (s), or for so many steps if that is shorter."""
BEGIN = 0.2
"""Share of a run in which it forgets its beginning, and nothing counts."""
SEED = 1
ALIKE = 0.1
"""Share of what steps change by which run and closed form may differ: a few per cent of a step."""
LEAST = 1e-4
"""What the closed form leaves out of a ratio."""
SURE = 4.0
"""Standard errors by which a run may differ from the closed form; more does not happen by chance."""


@dataclass(frozen=True)
class Marched:
    """ratio (q,) of deviations of a run to those of one in shorter steps, its standard error (q,), calls per second."""

    ratio: np.ndarray
    error: np.ndarray
    calls: float


def marched(march: March, step: float, copies: int = COPIES) -> Marched:
    """Run a scene in steps (s)."""
    steps = max(int(min(LONGEST / step, STEPS)), 10)
    road = _states(march, step / FINER, steps * FINER, copies)
    coarse, calls = _squares(march, road[::FINER], step)
    fine, _ = _squares(march, road, step / FINER)
    mean = fine.mean(axis=0)
    squared = coarse.mean(axis=0) / mean
    error = (coarse - squared * fine).std(axis=0, ddof=1) / (np.sqrt(copies) * mean * 2 * np.sqrt(squared))
    return Marched(np.sqrt(squared), error, calls / (steps * step))


def confirms(march: March, step: float) -> bool:
    """Whether a run in steps (s) finds what the closed form says that they do to deviations, before weightings."""
    plain = replace(march, weightings=())
    run = marched(plain, step)
    said = plain.deviations(step) / plain.deviations(step / FINER)
    return bool((abs(run.ratio - said) <= SURE * run.error + ALIKE * abs(said - 1.0) + LEAST).all())


def _states(march: March, step: float, steps: int, copies: int) -> np.ndarray:
    """States (2 steps + 1, a m, copies) of all axles' filters at half steps."""
    road = march.reduced.excitation
    axles, m = len(road.heights), len(road.F)
    each = tuple(np.kron(np.eye(axles)[:, [i]], np.eye(m)) for i in range(axles))
    path = RoadPath(replace(road, heights=each), march.speed, step / 2)
    return next(path.blocks(steps, copies, SEED))[:, : axles * m]


def _squares(march: March, road: np.ndarray, step: float) -> tuple[np.ndarray, int]:
    """Mean squares (copies, q) of a run over a road at its half steps, and calls of the right-hand side."""
    n, m, system = march.vehicle, road.shape[1], march.reduced.system
    A, force = system.A[:n, :n], system.A[:n, n : n + m] @ road
    noise = _noise(march, road, step)
    copies = road.shape[2]
    x, count, sums, calls = _begin(march, road[0]), 0, np.zeros((len(march.rows), copies)), 0

    def rate(time: float, x: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        return A @ x + acting[time]

    for i in range(len(road) // 2):
        acting = dict(zip((0.0, 0.5 * step, step), force[2 * i : 2 * i + 3] + noise[i], strict=True))
        x = step_on(rate, 0.0, x, step)
        if i >= BEGIN * (len(road) // 2):
            count += 1
            sums += march.heard(np.concatenate([x, road[2 * i + 2]])) ** 2
    assert calls == STAGES * (len(road) // 2)
    return (sums / count).T, calls


def _begin(march: March, road: np.ndarray) -> np.ndarray:
    """States (n, copies) of the vehicle in its stationary ride, given those (m, copies) of the road.

    A short run would not reach it from rest."""
    n, states, system = march.vehicle, march.reduced.states, march.reduced.system
    P = solve_continuous_lyapunov(system.A, -noise_of(system))[:states, :states]
    told = P[:n, n:] @ np.linalg.pinv(P[n:, n:], hermitian=True)
    values, vectors = np.linalg.eigh(P[:n, :n] - told @ P[n:, :n])
    chance = np.random.default_rng(SEED).standard_normal((n, road.shape[1]))
    return told @ road + vectors * np.sqrt(values.clip(0.0)) @ chance


def _noise(march: March, road: np.ndarray, step: float) -> np.ndarray:
    """Mean force (steps, n, copies) of white noise over each step, 0 where none reaches the vehicle."""
    roads, n = march.reduced.excitation, march.vehicle
    into = np.hstack([b[:n] for b in march.reduced.system.B])
    if not into.any():
        return np.zeros((len(road) // 2, 1, 1))
    begin, middle, end = road[:-2:2], road[1::2], road[2::2]
    path, back = (
        np.kron(np.eye(len(roads.heights)), each)
        for each in (march.speed * roads.F, np.linalg.pinv(march.speed**0.5 * roads.G))
    )
    return into @ (back @ ((end - begin) / step - path @ (begin + 4 * middle + end) / 6))
