"""A free vehicle marched by an integrator that chooses its own steps: Exudyn's, or scipy's with plain equations.

Rows are even. Each is the end of a march of its own in Exudyn, which would write rows where its steps fall; scipy's
methods interpolate by polynomials of their own order. No step is longer than the time between two rows.
"""

from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.free_vehicle import FreeModel
from models.engines.protocol import check_trajectory

ABSOLUTE_TOLERANCE_RATIO = 1e-2
"""Ratio of the absolute tolerance (m, rad, per s) to the relative tolerance."""
FINEST_TOLERANCE = 3e-14
"""Relative tolerance below which scipy's methods would work on rounding."""


def march_adaptively(free_model: FreeModel, q: np.ndarray, v: np.ndarray, run_settings: Settings) -> Trajectory:
    """Trajectory from positions and rates (n,), with rows every ``settings.step`` (s); RunFailed unless all values are
    finite and sane.

    free_model : of an engine that ``models.engines.catalogue.ADAPTIVE`` names, with one of its integrators there.
    """
    march, initial_state = (_in_exudyn if free_model.ENGINE == "exudyn" else _by_scipy), np.concatenate((q, v))
    states, counts = march(free_model, initial_state, run_settings)
    times = run_settings.step * np.arange(run_settings.steps + 1)
    check_trajectory(free_model.ENGINE, times, states, run_settings.steps * run_settings.step)
    return Trajectory(times, states, counts=counts)


def _in_exudyn(free_model: Any, initial_state: np.ndarray, run_settings: Settings) -> tuple[np.ndarray, dict[str, int]]:
    """States (steps + 1, 2 n), marched in Exudyn one row at a time, and counts of steps and force calls."""
    from models.engines.exudyn_system import set_start, solver_counts, solver_failure

    mbs, states = free_model.mbs, np.empty((run_settings.steps + 1, initial_state.size))
    states[0], counts = initial_state, {"steps": 0, "force calls": 0}
    for i in range(run_settings.steps):
        set_start(mbs, *np.split(states[i], 2))
        if solver_failure(mbs, run_settings.integrator, _options(i * run_settings.step, run_settings)):
            raise RunFailed("exudyn", "no step is short enough for its tolerance", i * run_settings.step, states[i])
        data, took = mbs.systemData, solver_counts(mbs)
        states[i + 1] = np.concatenate((data.GetODE2Coordinates(), data.GetODE2Coordinates_t()))
        counts = {name: count + took[name] for name, count in counts.items()}
    return states, counts


def _options(start_time: float, run_settings: Settings) -> Any:
    """Exudyn's settings for the march from a time (s) to the next row."""
    from models.engines.exudyn_system import quiet_settings

    options = quiet_settings()
    ti = options.timeIntegration
    ti.startTime, ti.endTime, ti.numberOfSteps, ti.verboseMode = start_time, start_time + run_settings.step, 1, 0
    ti.automaticStepSize, ti.explicit.computeEndOfStepAccelerations = True, False
    ti.relativeTolerance, ti.absoluteTolerance = (
        run_settings.tolerance,
        ABSOLUTE_TOLERANCE_RATIO * run_settings.tolerance,
    )
    return options


def _by_scipy(
    free_model: FreeModel, initial_state: np.ndarray, run_settings: Settings
) -> tuple[np.ndarray, dict[str, int]]:
    """States (steps + 1, 2 n) of plain equations, integrated by an adaptive scipy solver, and its counts."""
    from scipy.integrate import solve_ivp

    tolerance = max(run_settings.tolerance, FINEST_TOLERANCE)

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        q, v = np.split(state, 2)
        rates = np.concatenate((v, free_model.acceleration(time, q, v)))
        if not np.isfinite(rates).all():  # an explicit method would halve its step for ever
            raise RunFailed(free_model.ENGINE, "the accelerations became infinite or not a number", time, state)
        return rates

    rows = run_settings.step * np.arange(run_settings.steps + 1)
    solution = solve_ivp(
        rate,
        (0.0, rows[-1]),
        initial_state,
        method=run_settings.integrator,
        t_eval=rows,
        rtol=tolerance,
        atol=ABSOLUTE_TOLERANCE_RATIO * tolerance,
        max_step=run_settings.step,
    )
    if not solution.success:
        raise RunFailed(free_model.ENGINE, solution.message, float(solution.t[-1]), solution.y[:, -1])
    return solution.y.T, {"force calls": int(solution.nfev)}
