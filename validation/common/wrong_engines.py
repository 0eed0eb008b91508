"""Faulty integrators registered from outside, and a check that a run with each of them fails."""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.core.errors import RunFailed
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES, RECOMMENDED
from models.engines.outside import register
from models.systems.pitch_plane.run import run as simulate
from validation.common.scenes import road_scene


class FaultlessIntegrator:
    """An outside integrator without a fault, accurate to its tolerance."""

    order, adaptive = 8, True

    def integrate(self, rate_function: Any, times: np.ndarray, start_state: np.ndarray, tolerance: float) -> np.ndarray:
        """States (len(times), 8) of y' = f(t, y), with f = ``rate_function``, by an adaptive Runge-Kutta method."""

        def rate(time: float, state: np.ndarray) -> np.ndarray:
            return self.rates_used(rate_function(time, state))

        solution = solve_ivp(
            rate, times[[0, -1]], start_state, "DOP853", times, rtol=tolerance, atol=tolerance, max_step=0.01
        )
        return self.states_returned(solution.y.T)

    def rates_used(self, state_rates: np.ndarray) -> np.ndarray:
        """Time derivatives (8,) that the integrator uses; faulty subclasses change them."""
        return state_rates

    def states_returned(self, computed_states: np.ndarray) -> np.ndarray:
        """States (n, 8) that the integrator returns; faulty subclasses change them."""
        return computed_states


class StandingIntegrator(FaultlessIntegrator):
    """Faulty integrator: the vehicle stays in its initial state."""

    def states_returned(self, computed_states: np.ndarray) -> np.ndarray:
        """The initial state at all times."""
        return np.tile(computed_states[0], (len(computed_states), 1))


class OverstatedOrderIntegrator:
    """Faulty integrator: explicit Euler that declares order 4."""

    order, adaptive = 4, False

    def integrate(self, rate_function: Any, times: np.ndarray, start_state: np.ndarray, tolerance: float) -> np.ndarray:
        """States (len(times), 8) by one explicit Euler step between successive times."""
        states = [start_state]
        for begin, end in pairwise(times):
            states.append(states[-1] + (end - begin) * rate_function(begin, states[-1]))
        return np.array(states)


class SwappedWheelsIntegrator(FaultlessIntegrator):
    """Faulty integrator: front and rear wheel are exchanged in the states that it returns."""

    def states_returned(self, computed_states: np.ndarray) -> np.ndarray:
        """States with the columns of front and rear wheel exchanged."""
        return computed_states[:, [1, 0, 2, 3, 5, 4, 6, 7]]


class WeakForcesIntegrator(FaultlessIntegrator):
    """Faulty integrator: all forces are 1 % too small."""

    def rates_used(self, state_rates: np.ndarray) -> np.ndarray:
        """Time derivatives with accelerations 1 % too small."""
        return np.array([1.0] * 4 + [0.99] * 4) * state_rates


WRONG_ENGINES = (StandingIntegrator, OverstatedOrderIntegrator, SwappedWheelsIntegrator, WeakForcesIntegrator)


def integrators_that_pass(integrator_kinds: tuple[type, ...] = WRONG_ENGINES, duration: float = 0.5) -> list[str]:
    """Names of the integrators whose run on a road ends without an error being raised."""
    tables: tuple[dict[str, Any], ...] = (CATALOGUE, RECOMMENDED, OUTSIDE_CLASSES)
    saved_tables = [dict(table) for table in tables]
    try:
        return [kind.__name__ for kind in integrator_kinds if _passes_all_checks(kind, duration)]
    finally:
        for table, saved_table in zip(tables, saved_tables, strict=True):
            table.clear()
            table.update(saved_table)


def _passes_all_checks(integrator_kind: type, duration: float) -> bool:
    name = f"{__name__}:{integrator_kind.__name__}"
    register(name)
    try:
        simulate(road_scene(duration=duration), name)
    except RunFailed:
        return False
    return True
