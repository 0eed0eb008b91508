"""Standard deviations that a run in time has, by the classical Runge-Kutta method at a step in closed form, and its
cost.

A run reads the road's filters at the begin, the middle and the end of a step (f0, fm, f1). In a motion of rate s, with
z = h s, a step is x1 = R x0 + h (c0 g0 + cm gm + c1 g1), g the force of the road on it and

    R = 1 + z + z^2/2 + z^3/6 + z^4/24,  c0 = (1 + z + z^2/2 + z^3/4)/6,  cm = (4 + 2 z + z^2/2)/6,  c1 = 1/6.

White noise, which reaches wheels through damped tyres, is read as its mean over the step, from the same three values.
A wave e^(i w t) of the road moves x by e^(i w h) - R, and what a run samples is the sum of all waves that look alike at
its steps, w + 2 pi m / h: the variance is an integral from 0 to pi / h, and no run and no chance is in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from models.advice.ride_choice.reduced import Reduced
from models.advice.ride_choice.waves import at_axles, filtered, frequencies, weighting_factors
from models.core.runge_kutta import STAGES

REACH = np.linspace(0.0, 3.0, 601)[1:]
"""Sizes of step times eigenvalue at which its stability is looked at; on the real axis it ends at 2.785."""
ALIKE, BEYOND = 6, 6.0
"""Waves to either side that look alike at the steps, at least, and so many times the road's last corner; the last two
stand for all beyond, which fall with their square."""
LOWEST = 1e-4
"""Where panels of frequencies begin, by the highest frequency that steps can tell."""
SHORTEST, STEPS, FINER = 1 / 32, 8, 6
"""Shortest step that is tried, by the longest stable one; steps from there on, and halvings of what lies between."""


@dataclass(frozen=True)
class March:
    """A system in its motions, its road at a speed (m/s): rows (q,) are the quantities, of weightings their names."""

    reduced: Reduced
    speed: float
    rows: tuple[int, ...]
    weightings: tuple[tuple[int, str], ...]

    @cached_property
    def vehicle(self) -> int:
        """States of the vehicle, which stand first."""
        road = self.reduced.excitation
        return self.reduced.states - len(road.heights) * len(road.F)

    @cached_property
    def motions(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rates (n,) in 1/s, quantities by motions (q, n), motions by the road's filters and noise (n, m + k)."""
        n, system = self.vehicle, self.reduced.system
        rates, V = np.linalg.eig(system.A[:n, :n])
        back = np.linalg.inv(V)
        forced = np.hstack([system.A[:n, n : self.reduced.states], *(b[:n] for b in system.B)])
        return rates, self._read[:, :n] @ V, back @ forced

    @cached_property
    def _read(self) -> np.ndarray:
        """Quantities by states (q, n + m), before their weightings."""
        weighted, names = dict(self.weightings), self.reduced.system.names
        plain = [
            names.index(names[row].removesuffix(f" {weighted[row]}")) if row in weighted else row for row in self.rows
        ]
        return self.reduced.system.C[plain, : self.reduced.states]

    def heard(self, states: np.ndarray) -> np.ndarray:
        """Quantities (q, ...), before their weightings, of states of vehicle and road (n + m, ...)."""
        return self._read @ states

    @cached_property
    def longest(self) -> float:
        """Longest stable step (s)."""
        return stable_step(self.motions[0])

    def deviations(self, step: float) -> np.ndarray:
        """Standard deviations (q,) of what a run in steps (s) samples."""
        rates, seen, forced = self.motions
        omega, weights, apart = self._frequencies(step)
        last = self._alike(step)
        alike = np.arange(-last, last + 1)[:, None]
        road, noise = self._road((omega + 2 * np.pi * alike / step).ravel(), np.tile(apart, len(alike)), step)
        half = (np.exp(0.5j * step * omega) * (-1.0) ** alike).ravel()[:, None]
        z = (step * rates)[:, None, None]
        begin, middle = 1 + z + z**2 / 2 + z**3 / 4, 4 + 2 * z + z**2 / 2
        grown = 1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))
        m = self.reduced.states - self.vehicle
        moved = (begin + middle * half + half**2) * np.tensordot(forced[:, :m], road, 1)
        if forced[:, m:].any():
            moved += (begin + middle + 1) * np.tensordot(forced[:, m:], noise, 1)
        moved *= step / 6 / (half**2 - grown)
        heard = np.tensordot(seen, moved, 1) + np.tensordot(self._read[:, self.vehicle :], road, 1)
        count = np.where(abs(alike) < last - 1, 1.0, 1.0 + alike**2 / (2.0 * (abs(alike) + 1.0)))
        total = ((abs(heard) ** 2).sum(axis=2).reshape(len(seen), len(alike), -1) * count).sum(axis=1)
        return np.sqrt(total * abs(self._heard(omega)) ** 2 @ weights / np.pi)

    def _alike(self, step: float) -> int:
        """Waves to either side up to which not all of them fall with their square."""
        corner = self.speed * abs(np.linalg.eigvals(self.reduced.excitation.F)).max()
        return max(ALIKE, int(np.ceil(BEYOND * corner * step / (2 * np.pi))))

    def _frequencies(self, step: float) -> tuple[np.ndarray, ...]:
        """Frequencies up to those with two steps per period."""
        highest = np.pi / step
        delay = max(self.reduced.excitation.lengths) / self.speed
        return frequencies(self.motions[0], delay, (LOWEST * highest, highest))

    def _heard(self, omega: np.ndarray) -> np.ndarray:
        """Factors (q, w) of the weightings."""
        names = dict(self.weightings)
        return weighting_factors([names.get(row, "") for row in self.rows], omega)

    def _road(self, omega: np.ndarray, apart: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
        """States of all axles' filters by each noise (a m, w, a k), and the mean noise (a k, w, a k) of a run."""
        road, speeds, s = self.reduced.excitation, np.array([self.speed]), 1j * omega[:, None, None]
        states = filtered(road, speeds, omega)
        end, half = np.exp(step * s), np.exp(step / 2 * s)
        slope = (end - 1) / step * states - self.speed * road.F @ ((1 + 4 * half + end) / 6 * states)
        mean = np.linalg.pinv(self.speed**0.5 * road.G) @ slope
        met, noise = (at_axles(each, road, speeds, omega, apart)[0] for each in (states, mean))
        return met.transpose(1, 0, 2), noise.transpose(1, 0, 2)


class RunInSteps(Protocol):
    """Runs in time of a scene at a speed, in steps (s)."""

    @property
    def longest(self) -> float:
        """Longest stable step (s)."""

    def deviations(self, step: float) -> np.ndarray:
        """Standard deviations (q,) of what a run in steps (s) samples."""


def longest_step(marches: Sequence[RunInSteps], exact: list[np.ndarray], tolerance: float) -> float:
    """Longest step (s) up to which runs at every speed keep quantities within a tolerance of ``exact`` deviations.

    exact : of the whole scene, (q,) for each march. 0 where the shortest step that is looked at breaks it.
    """
    stable, runs = min(march.longest for march in marches), list(zip(marches, exact, strict=True))

    def kept(step: float) -> bool:
        for i, (march, deviations) in enumerate(runs):
            if not (abs(march.deviations(step) / deviations - 1.0) <= tolerance).all():
                runs.insert(0, runs.pop(i))  # what broke it here is likely to break it elsewhere
                return False
        return True

    low, high = 0.0, 0.999 * stable
    for step in np.geomspace(SHORTEST * stable, high, STEPS):
        if not kept(step):
            high = step
            break
        low = step
    if not low or low == high:
        return float(low)
    for _ in range(FINER):
        middle = (low * high) ** 0.5
        low, high = (middle, high) if kept(middle) else (low, middle)
    return float(low)


@dataclass(frozen=True)
class Cost:
    """``states`` of vehicle and road filters, without weightings; ``step`` (s), the largest at which the classical
    Runge-Kutta method is stable for the vehicle; ``calls`` of its right-hand side per second of motion at that step.

    The road's own poles do not bound the step: a time run reads heights from a table made beforehand. How fine a step
    must be to resolve the road or a quantity is another question, the same with and without an effect.
    """

    states: int
    step: float
    calls: float

    @property
    def work(self) -> float:
        """Calls times states, per second of motion."""
        return self.calls * self.states


def cost(reduced: Reduced) -> Cost:
    """Cost of a system whose every motion dies out; a motion that grows has no stable step and costs without end."""
    n = reduced.states - len(reduced.excitation.heights) * len(reduced.excitation.F)
    step = stable_step(np.linalg.eigvals(reduced.system.A[:n, :n]))
    return Cost(reduced.states, step, STAGES / step if step else np.inf)


def stable_step(values: np.ndarray) -> float:
    """Largest step (s) with |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1 for z = step times every eigenvalue (1/s)."""
    values = values[abs(values) > 0]
    z = values[:, None] / abs(values)[:, None] * REACH
    grown = abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) > 1 + 1e-12
    first = np.where(grown.any(axis=1), grown.argmax(axis=1), len(REACH))
    reach = np.where(first > 0, REACH[np.maximum(first, 1) - 1], 0.0)
    return float((reach / abs(values)).min(initial=np.inf))
