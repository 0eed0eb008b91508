"""Integrators from outside the tree that answer wrongly, and what a run of each says."""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.core.errors import RunFailed
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES, RECOMMENDED
from models.engines.outside import register
from models.systems.pitch_plane.run import run as simulate
from validation.common.scenes import road_scene


class Right:
    """An outside integrator without a fault, which keeps its tolerance."""

    order, adaptive = 8, True

    def integrate(self, rate_function: Any, times: np.ndarray, start_state: np.ndarray, tolerance: float) -> np.ndarray:
        """States (len(times), 8) of y' = f(t, y)."""

        def rate(t: float, y: np.ndarray) -> np.ndarray:
            return self.weighed(rate_function(t, y))

        solution = solve_ivp(
            rate, times[[0, -1]], start_state, "DOP853", times, rtol=tolerance, atol=tolerance, max_step=0.01
        )
        return self.told(solution.y.T)

    def weighed(self, rate: np.ndarray) -> np.ndarray:
        """Time derivatives (8,) that the integrator uses; faulty subclasses change them."""
        return rate

    def told(self, states: np.ndarray) -> np.ndarray:
        """States (n, 8) that the integrator returns; faulty subclasses change them."""
        return states


class Still(Right):
    """Faulty integrator: the vehicle stays in its initial state."""

    def told(self, states: np.ndarray) -> np.ndarray:
        """The initial state at all times."""
        return np.tile(states[0], (len(states), 1))


class Boastful:
    """Faulty integrator: explicit Euler that declares order 4."""

    order, adaptive = 4, False

    def integrate(self, rate_function: Any, times: np.ndarray, start_state: np.ndarray, tolerance: float) -> np.ndarray:
        """States by one Euler step between each two times."""
        states = [start_state]
        for begin, end in pairwise(times):
            states.append(states[-1] + (end - begin) * rate_function(begin, states[-1]))
        return np.array(states)


class Swapped(Right):
    """Faulty integrator: front and rear wheel are exchanged in the result."""

    def told(self, states: np.ndarray) -> np.ndarray:
        """States with two columns exchanged."""
        return states[:, [1, 0, 2, 3, 5, 4, 6, 7]]


class Weak(Right):
    """Faulty integrator: all forces are 1 % too small."""

    def weighed(self, rate: np.ndarray) -> np.ndarray:
        """Time derivatives with accelerations 1 % too small."""
        return np.array([1.0] * 4 + [0.99] * 4) * rate


WRONG_ENGINES = (Still, Boastful, Swapped, Weak)


def integrators_that_pass(integrator_kinds: tuple[type, ...] = WRONG_ENGINES, duration: float = 0.5) -> list[str]:
    """Names of the integrators whose run on a road ends without an error being raised."""
    tables: tuple[dict[str, Any], ...] = (CATALOGUE, RECOMMENDED, OUTSIDE_CLASSES)
    saved_tables = [dict(table) for table in tables]
    try:
        return [kind.__name__ for kind in integrator_kinds if _gives_answer(kind, duration)]
    finally:
        for table, saved_table in zip(tables, saved_tables, strict=True):
            table.clear()
            table.update(saved_table)


def _gives_answer(integrator_kind: type, duration: float) -> bool:
    name = f"{__name__}:{integrator_kind.__name__}"
    register(name)
    try:
        simulate(road_scene(duration=duration), name)
    except RunFailed:
        return False
    return True
