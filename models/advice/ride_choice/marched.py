"""A run of a linear scene in time, by the classical Runge-Kutta method: what it makes of deviations at a step.

Copies of the vehicle meet random roads of their own; the same roads are run in steps a quarter as long, so that chance
is in both and hardly in their ratio.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from models.advice.ride_choice.march import March
from models.core.runge_kutta import RK4_STAGES, step_on
from models.ride.covariance import noise_intensity_of_system
from models.ride.road_path import RoadPath

STEP_REFINEMENT = 4
"""Steps of the run beside it are so many times as short."""
NUMBER_OF_COPIES, LONGEST_RUN_SECONDS, LONGEST_RUN_STEPS = 48, 20.0, 1500
"""Copies; each runs for so many seconds (s), or for so many steps if that is shorter."""
STEPS_PER_BLOCK = 250
"""Steps whose states are kept before they are summed."""
SETTLING_SHARE = 0.2
"""Share of a run in which it forgets its beginning, and nothing counts."""
SEED = 1
ALLOWED_SHARE = 0.1
"""Share of what steps change by which run and closed form may differ: a few per cent of a step."""
CLOSED_FORM_ERROR = 1e-4
"""What the closed form leaves out of a ratio."""
ALLOWED_STANDARD_ERRORS = 4.0
"""Standard errors by which a run may differ from the closed form; more does not happen by chance."""


@dataclass(frozen=True)
class Marched:
    """Comparison of a run with one in shorter steps. deviation_ratio (q,) : of standard deviations; error (q,) :
    standard error of the ratio; calls : per second of motion.
    """

    deviation_ratio: np.ndarray
    error: np.ndarray
    calls: float


def comparison_of_steps(march_in_modes: March, step: float, copies: int = NUMBER_OF_COPIES) -> Marched:
    """Run a scene in steps of ``step`` (s) and in shorter ones."""
    steps = max(int(min(LONGEST_RUN_SECONDS / step, LONGEST_RUN_STEPS)), 10)
    road = _filter_states(march_in_modes, step / STEP_REFINEMENT, steps * STEP_REFINEMENT, copies)
    coarse, calls = _mean_squares(march_in_modes, road[::STEP_REFINEMENT], step)
    fine, _ = _mean_squares(march_in_modes, road, step / STEP_REFINEMENT)
    mean = fine.mean(axis=0)
    squared = coarse.mean(axis=0) / mean
    error = (coarse - squared * fine).std(axis=0, ddof=1) / (np.sqrt(copies) * mean * 2 * np.sqrt(squared))
    return Marched(np.sqrt(squared), error, calls / (steps * step))


def confirms_step(march_in_modes: March, step: float) -> bool:
    """Whether a run in steps of ``step`` (s) changes standard deviations, before weightings, as much as the closed form
    predicts.
    """
    plain = replace(march_in_modes, weightings=())
    run = comparison_of_steps(plain, step)
    stated_ratio = plain.deviations(step) / plain.deviations(step / STEP_REFINEMENT)
    return bool(
        (
            abs(run.deviation_ratio - stated_ratio)
            <= ALLOWED_STANDARD_ERRORS * run.error + ALLOWED_SHARE * abs(stated_ratio - 1.0) + CLOSED_FORM_ERROR
        ).all()
    )


def _filter_states(march_in_modes: March, step: float, steps: int, copies: int) -> np.ndarray:
    """States (2 steps + 1, a m, copies) of the road filters of all axles at half steps."""
    road = march_in_modes.reduced.excitation
    axles, m = len(road.heights), len(road.F)
    axle_selectors = tuple(np.kron(np.eye(axles)[:, [i]], np.eye(m)) for i in range(axles))
    path = RoadPath(replace(road, heights=axle_selectors), march_in_modes.speed, step / 2)
    return next(path.blocks(steps, copies, SEED))[:, : axles * m]


def _mean_squares(march_in_modes: March, road: np.ndarray, step: float) -> tuple[np.ndarray, int]:
    """Mean squares (copies, q) of quantities in a run over a road that is given at half steps, and the number of calls
    of the right-hand side.

    A step of a linear system is a matrix; it is found by a step from the unit matrix.
    """
    n, steps, (_, m, copies) = march_in_modes.vehicle, len(road) // 2, road.shape
    move, *weights = _step_matrices(march_in_modes.reduced.system.A[:n, :n], step)
    by_road = [weight @ march_in_modes.reduced.system.A[:n, n : n + m] for weight in weights]
    x, first, sums = (
        _initial_states(march_in_modes, road[0]),
        int(np.ceil(SETTLING_SHARE * steps)),
        np.zeros((len(march_in_modes.rows), copies)),
    )
    for begin in range(0, steps, STEPS_PER_BLOCK):
        road_of_block = road[2 * begin : 2 * min(begin + STEPS_PER_BLOCK, steps) + 1]
        forcing = (
            by_road[0] @ road_of_block[:-2:2] + by_road[1] @ road_of_block[1::2] + by_road[2] @ road_of_block[2::2]
        )
        forcing += sum(weights) @ _mean_noise_force(march_in_modes, road_of_block, step)
        for i in range(len(forcing)):
            forcing[i] += move @ x
            x = forcing[i]
        counted = slice(max(first - begin, 0), None)
        heard = (
            march_in_modes.read[:, :n] @ forcing[counted] + march_in_modes.read[:, n:] @ road_of_block[2::2][counted]
        )
        sums += (heard**2).sum(axis=0)
    return (sums / (steps - first)).T, RK4_STAGES * steps


def _step_matrices(A: np.ndarray, step: float) -> list[np.ndarray]:
    """Matrices (n, n) of one step (s): how the new state depends on the old one, and on forces at the step's begin,
    middle and end.
    """
    n = len(A)
    columns = np.eye(n, 4 * n)
    acting = {share * step: np.roll(columns, (i + 1) * n, axis=1) for i, share in enumerate((0.0, 0.5, 1.0))}
    return np.split(step_on(lambda time, x: A @ x + acting[time], 0.0, columns, step), 4, axis=1)


def _initial_states(march_in_modes: March, road: np.ndarray) -> np.ndarray:
    """Initial states (n, copies) of the vehicle, drawn from its stationary ride for given states (m, copies) of the
    road.

    A short run would not reach it from rest.
    """
    n, states, system = march_in_modes.vehicle, march_in_modes.reduced.states, march_in_modes.reduced.system
    P = solve_continuous_lyapunov(system.A, -noise_intensity_of_system(system))[:states, :states]
    regression = P[:n, n:] @ np.linalg.pinv(P[n:, n:], hermitian=True)
    values, vectors = np.linalg.eigh(P[:n, :n] - regression @ P[n:, :n])
    chance = np.random.default_rng(SEED).standard_normal((n, road.shape[1]))
    return regression @ road + vectors * np.sqrt(values.clip(0.0)) @ chance


def _mean_noise_force(march_in_modes: March, road: np.ndarray, step: float) -> np.ndarray:
    """Mean force (steps, n, copies) that white noise exerts over each step, 0 where no noise reaches the vehicle."""
    roads, n = march_in_modes.reduced.excitation, march_in_modes.vehicle
    into = np.hstack([b[:n] for b in march_in_modes.reduced.system.B])
    if not into.any():
        return np.zeros((len(road) // 2, n, 1))
    begin, middle, end = road[:-2:2], road[1::2], road[2::2]
    path, back = (
        np.kron(np.eye(len(roads.heights)), filter_matrix)
        for filter_matrix in (march_in_modes.speed * roads.F, np.linalg.pinv(march_in_modes.speed**0.5 * roads.G))
    )
    return into @ (back @ ((end - begin) / step - path @ (begin + 4 * middle + end) / 6))
