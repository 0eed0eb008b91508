"""Time simulation of a linear ride scene by the classical Runge-Kutta method: how the step changes standard deviations.

Copies of the vehicle meet random roads of their own; the same roads are run in steps a quarter as long, so that chance
is in both and hardly in their ratio.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from models.advice.ride_choice.march import March
from models.core.runge_kutta import RK4_STAGES, runge_kutta_step
from models.ride.covariance import noise_intensity_of_system
from models.ride.road_path import RoadPath

STEP_REFINEMENT = 4
"""Factor by which the steps of the run for comparison are shorter."""
NUMBER_OF_COPIES, LONGEST_RUN_SECONDS, LONGEST_RUN_STEPS = 48, 20.0, 1500
"""Number of copies of the vehicle, their longest duration (s), and their largest number of steps if that is shorter."""
STEPS_PER_BLOCK = 250
"""Number of steps whose states are stored before they are summed."""
SETTLING_SHARE = 0.2
"""Share of a run in which it settles, and which is left out of the mean squares."""
SEED = 1
ALLOWED_SHARE = 0.1
"""Share of the change by the step by which run and closed form may differ."""
CLOSED_FORM_ERROR = 1e-4
"""Relative error of a deviation ratio by the closed form."""
ALLOWED_STANDARD_ERRORS = 4.0
"""Number of standard errors by which a run may differ from the closed form; more does not happen by chance."""


@dataclass(frozen=True)
class StepComparison:
    """Comparison of a run with another one in shorter steps. deviation_ratio (q,) : ratio of standard deviations; error
    (q,) : standard error of the ratio; calls : right-hand side calls per second of motion.
    """

    deviation_ratio: np.ndarray
    error: np.ndarray
    calls: float


def comparison_of_steps(march: March, step: float, copy_count: int = NUMBER_OF_COPIES) -> StepComparison:
    """Ratio of standard deviations of a run with steps of ``step`` (s) to those of a run with shorter steps."""
    steps = max(int(min(LONGEST_RUN_SECONDS / step, LONGEST_RUN_STEPS)), 10)
    road = _filter_states(march, step / STEP_REFINEMENT, steps * STEP_REFINEMENT, copy_count)
    coarse, calls = _mean_squares(march, road[::STEP_REFINEMENT], step)
    fine, _ = _mean_squares(march, road, step / STEP_REFINEMENT)
    mean = fine.mean(axis=0)
    squared = coarse.mean(axis=0) / mean
    error = (coarse - squared * fine).std(axis=0, ddof=1) / (np.sqrt(copy_count) * mean * 2 * np.sqrt(squared))
    return StepComparison(np.sqrt(squared), error, calls / (steps * step))


def confirms_step(march: March, step: float) -> bool:
    """Whether a run with steps of ``step`` (s) changes standard deviations, before weightings, as much as the closed
    form predicts.
    """
    plain = replace(march, weightings=())
    run = comparison_of_steps(plain, step)
    stated_ratio = plain.deviations(step) / plain.deviations(step / STEP_REFINEMENT)
    return bool(
        (
            abs(run.deviation_ratio - stated_ratio)
            <= ALLOWED_STANDARD_ERRORS * run.error + ALLOWED_SHARE * abs(stated_ratio - 1.0) + CLOSED_FORM_ERROR
        ).all()
    )


def _filter_states(march: March, step: float, step_count: int, copy_count: int) -> np.ndarray:
    """States (2 steps + 1, a m, copies) of the road filters of all axles at half steps of ``step`` (s)."""
    road = march.reduced.excitation
    axles, m = len(road.heights), len(road.F)
    axle_selectors = tuple(np.kron(np.eye(axles)[:, [i]], np.eye(m)) for i in range(axles))
    path = RoadPath(replace(road, heights=axle_selectors), march.speed, step / 2)
    return next(path.blocks(step_count, copy_count, SEED))[:, : axles * m]


def _mean_squares(march: March, road_states: np.ndarray, step: float) -> tuple[np.ndarray, int]:
    """Mean squares (copies, q) of quantities in a run over a road that is given at half steps, and the number of
    right-hand side calls.

    A step of a linear system is a matrix; it is found by a step from the unit matrix.
    """
    n, steps, (_, m, copies) = march.vehicle_state_count, len(road_states) // 2, road_states.shape
    move, *weights = _step_matrices(march.reduced.system.A[:n, :n], step)
    by_road = [weight @ march.reduced.system.A[:n, n : n + m] for weight in weights]
    x, first, sums = (
        _initial_states(march, road_states[0]),
        int(np.ceil(SETTLING_SHARE * steps)),
        np.zeros((len(march.rows), copies)),
    )
    for begin in range(0, steps, STEPS_PER_BLOCK):
        road_of_block = road_states[2 * begin : 2 * min(begin + STEPS_PER_BLOCK, steps) + 1]
        forcing = (
            by_road[0] @ road_of_block[:-2:2] + by_road[1] @ road_of_block[1::2] + by_road[2] @ road_of_block[2::2]
        )
        forcing += sum(weights) @ _mean_noise_force(march, road_of_block, step)
        for i in range(len(forcing)):
            forcing[i] += move @ x
            x = forcing[i]
        counted = slice(max(first - begin, 0), None)
        quantities = (
            march.output_matrix[:, :n] @ forcing[counted] + march.output_matrix[:, n:] @ road_of_block[2::2][counted]
        )
        sums += (quantities**2).sum(axis=0)
    return (sums / (steps - first)).T, RK4_STAGES * steps


def _step_matrices(A: np.ndarray, step: float) -> list[np.ndarray]:
    """Transition matrices (n, n) of one Runge-Kutta step (s): from the old state, and from forces at the step's begin,
    middle and end, to the new state.
    """
    n = len(A)
    columns = np.eye(n, 4 * n)
    acting = {share * step: np.roll(columns, (i + 1) * n, axis=1) for i, share in enumerate((0.0, 0.5, 1.0))}
    return np.split(runge_kutta_step(lambda time, x: A @ x + acting[time], 0.0, columns, step), 4, axis=1)


def _initial_states(march: March, road_states: np.ndarray) -> np.ndarray:
    """Initial states (n, copies) of the vehicle, drawn from its stationary ride for given states (m, copies) of the
    road filters.

    A short run would not reach it from rest.
    """
    n, states, system = march.vehicle_state_count, march.reduced.states, march.reduced.system
    P = solve_continuous_lyapunov(system.A, -noise_intensity_of_system(system))[:states, :states]
    regression = P[:n, n:] @ np.linalg.pinv(P[n:, n:], hermitian=True)
    values, vectors = np.linalg.eigh(P[:n, :n] - regression @ P[n:, :n])
    chance = np.random.default_rng(SEED).standard_normal((n, road_states.shape[1]))
    return regression @ road_states + vectors * np.sqrt(values.clip(0.0)) @ chance


def _mean_noise_force(march: March, road_states: np.ndarray, step: float) -> np.ndarray:
    """Mean rate of the states (steps, n, copies) due to white noise over each step, 0 where no noise reaches the
    vehicle.
    """
    roads, n = march.reduced.excitation, march.vehicle_state_count
    into = np.hstack([b[:n] for b in march.reduced.system.B])
    if not into.any():
        return np.zeros((len(road_states) // 2, n, 1))
    begin, middle, end = road_states[:-2:2], road_states[1::2], road_states[2::2]
    path, back = (
        np.kron(np.eye(len(roads.heights)), filter_matrix)
        for filter_matrix in (march.speed * roads.F, np.linalg.pinv(march.speed**0.5 * roads.G))
    )
    return into @ (back @ ((end - begin) / step - path @ (begin + 4 * middle + end) / 6))
