"""Integrators from outside the tree that answer wrongly, and what a run of each says."""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.core.errors import RunFailed
from models.engines.catalogue import CATALOGUE, OUTSIDE, RECOMMENDED
from models.engines.outside import register
from models.systems.pitch_plane.run import run as simulate
from validation.common.scenes import road_scene


class Right:
    """An integrator that keeps its tolerance."""

    order, adaptive = 8, True

    def integrate(self, f: Any, times: np.ndarray, start: np.ndarray, tolerance: float) -> np.ndarray:
        """States (len(times), 8) of y' = f(t, y)."""

        def rate(t: float, y: np.ndarray) -> np.ndarray:
            return self.weighed(f(t, y))

        solution = solve_ivp(
            rate, times[[0, -1]], start, "DOP853", times, rtol=tolerance, atol=tolerance, max_step=0.01
        )
        return self.told(solution.y.T)

    def weighed(self, rate: np.ndarray) -> np.ndarray:
        """Rates (8,) as they are integrated."""
        return rate

    def told(self, states: np.ndarray) -> np.ndarray:
        """States (n, 8) that the engine reports."""
        return states


class Still(Right):
    """A wrong engine whose vehicle stays where it begins."""

    def told(self, states: np.ndarray) -> np.ndarray:
        """The start, at all times."""
        return np.tile(states[0], (len(states), 1))


class Boastful:
    """Explicit Euler that states order 4."""

    order, adaptive = 4, False

    def integrate(self, f: Any, times: np.ndarray, start: np.ndarray, tolerance: float) -> np.ndarray:
        """A step of Euler between each two times."""
        states = [start]
        for begin, end in pairwise(times):
            states.append(states[-1] + (end - begin) * f(begin, states[-1]))
        return np.array(states)


class Swapped(Right):
    """Front and rear wheel exchanged in the answer."""

    def told(self, states: np.ndarray) -> np.ndarray:
        """The states, two columns of which are exchanged."""
        return states[:, [1, 0, 2, 3, 5, 4, 6, 7]]


class Weak(Right):
    """Every force 1 % too small."""

    def weighed(self, rate: np.ndarray) -> np.ndarray:
        """Accelerations that are 1 % smaller."""
        return np.array([1.0] * 4 + [0.99] * 4) * rate


WRONG_ENGINES = (Still, Boastful, Swapped, Weak)


def passed(kinds: tuple[type, ...] = WRONG_ENGINES, duration: float = 0.5) -> list[str]:
    """Names of the integrators whose run on a road ends without a word against it."""
    tables: tuple[dict[str, Any], ...] = (CATALOGUE, RECOMMENDED, OUTSIDE)
    before = [dict(table) for table in tables]
    try:
        return [kind.__name__ for kind in kinds if _answers(kind, duration)]
    finally:
        for table, kept in zip(tables, before, strict=True):
            table.clear()
            table.update(kept)


def _answers(kind: type, duration: float) -> bool:
    name = f"{__name__}:{kind.__name__}"
    register(name)
    try:
        simulate(road_scene(duration=duration), name)
    except RunFailed:
        return False
    return True
