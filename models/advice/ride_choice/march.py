"""Standard deviations that a run by the classical Runge-Kutta method has at a given step, in closed form, and the cost
of the run.

A run reads the road's filters at the begin, the middle and the end of a step (f0, fm, f1). In a motion of rate s, with
z = h s, a step is x1 = R x0 + h (c0 g0 + cm gm + c1 g1), g the force of the road on it and

    R = 1 + z + z^2/2 + z^3/6 + z^4/24,  c0 = (1 + z + z^2/2 + z^3/4)/6,  cm = (4 + 2 z + z^2/2)/6,  c1 = 1/6.

White noise, which reaches wheels through damped tyres, is read as its mean over the step, from the same three values.
A wave e^(i w t) of the road moves x by e^(i w h) - R, and what a run samples is the sum of all waves that look alike at
its steps, w + 2 pi m / h: the variance is an integral from 0 to pi / h, and no run and no chance is in it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from models.advice.ride_choice.reduced import Reduced, ReducedVehicle
from models.advice.ride_choice.waves import Filters, frequency_panels, pair_factors, weighting_factors
from models.core.runge_kutta import RK4_STAGES
from models.road.excitation import RoadExcitation

LEAST_ALIASES, ALIAS_RANGE_FACTOR = 6, 6.0
"""Least number of aliased waves to either side, and the ratio of their range to the road's highest corner frequency;
the last two stand for all beyond, which fall with their square.
"""
LOWEST_FREQUENCY_SHARE = 1e-4
"""Ratio of the lowest frequency of integration to the highest one, which has two steps per period."""
SHORTEST_STEP_SHARE, STEPS_TRIED, PARTS_BETWEEN_STEPS = 1 / 32, 8, 64
"""Ratio of the shortest step that is tried to the longest stable one; the number of steps from there on, and the number
of parts between two of them.
"""
NEGLIGIBLE_SHARE = 1e-12
"""Ratio of an error to the tolerance below which it counts as zero."""


@dataclass(frozen=True)
class March:
    """Time integration of a reduced linear system by its eigenmodes, with its road at a speed (m/s). rows (q,) : of the
    quantities; weightings : the names of their weighting filters, by row.
    """

    reduced: Reduced
    speed: float
    rows: tuple[int, ...]
    weightings: tuple[tuple[int, str], ...]

    @cached_property
    def vehicle_state_count(self) -> int:
        """Number of states of the vehicle, which are the first ones of the system."""
        road = self.reduced.excitation
        return self.reduced.states - len(road.heights) * len(road.F)

    @cached_property
    def motions(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Eigenvalues (n,) in 1/s of the vehicle, the matrix (q, n) from its modes to quantities, and the matrix (n, m
        + k) from the road's filters and noise to its modes.
        """
        n, system, modes = self.vehicle_state_count, self.reduced.system, self.reduced.reduced_vehicle.modes
        rates, V = (modes.rates, modes.V) if modes else np.linalg.eig(system.A[:n, :n])
        back = modes.W if modes else np.linalg.inv(V)
        forced = np.hstack([system.A[:n, n : self.reduced.states], *(b[:n] for b in system.B)])
        return rates, self.output_matrix[:, :n] @ V, back @ forced

    @cached_property
    def output_matrix(self) -> np.ndarray:
        """Output matrix (q, n + m) from the states of vehicle and road to the quantities, before their weightings."""
        weighted, names = dict(self.weightings), self.reduced.system.names
        plain = [
            names.index(names[row].removesuffix(f" {weighted[row]}")) if row in weighted else row for row in self.rows
        ]
        return self.reduced.system.C[plain, : self.reduced.states]

    @cached_property
    def longest_stable_step(self) -> float:
        """Longest step (s) with which the Runge-Kutta integration of the vehicle is stable."""
        return self.reduced.reduced_vehicle.stable_step

    def deviations(self, step: float) -> np.ndarray:
        """Standard deviations (q,) of the quantities, as sampled by a run with steps of ``step`` (s)."""
        omega, weights, is_independent = self._frequencies(step)
        alias_limit, half = self._count_of_aliases(step), np.exp(0.5j * step * omega)
        aliases = np.arange(-alias_limit, alias_limit + 1)[:, None]
        count = np.where(abs(aliases) < alias_limit - 1, 1.0, 1.0 + aliases**2 / (2.0 * (abs(aliases) + 1.0)))
        total = np.zeros((len(omega), len(self.rows)))
        for odd, gains in enumerate(self._gains(half, step)):
            same_parity = aliases[:, 0] % 2 == odd
            waves = omega + 2 * np.pi * aliases[same_parity] / step
            total += self._spectral_densities(gains, waves, count[same_parity], is_independent)
        return np.sqrt(weights @ (total * abs(self._weighting_factors(omega).T) ** 2) / np.pi)

    def _gains(self, half_step_phases: np.ndarray, step: float) -> Iterator[list[np.ndarray]]:
        """Gains (w, q, m) from the states of each axle's road filter to the quantities, for waves whose phase turns by
        ``half_step_phases`` in half a step, and for waves that turn by the opposite and look the same at the steps.

        White noise enters as its mean over a step, computed from the filters' states at the step's begin, middle and
        end.
        """
        rates, read_modes, forced = self.motions
        road, z, end = self.reduced.excitation, step * rates, half_step_phases**2
        axles, (m, k) = len(road.heights), road.G.shape
        begin, middle = 1 + z + z**2 / 2 + z**3 / 4, 4 + 2 * z + z**2 / 2
        motions = step / 6 / (end[:, None] - (1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))))
        by_road, by_noise = (
            (read_modes.T[:, :, None] * forcing[:, None, :]).reshape(len(rates), -1)
            for forcing in np.split(forced, [axles * m], axis=1)
        )
        shape = len(half_step_phases), len(read_modes), axles, m
        outer = motions @ (begin[:, None] * by_road) + end[:, None] * (motions @ by_road)
        outer += self.output_matrix[:, self.vehicle_state_count :].reshape(-1)
        inner = motions @ (middle[:, None] * by_road)
        noisy = by_noise.any()
        noise = (
            (motions @ ((begin + middle + 1)[:, None] * by_noise)).reshape(len(half_step_phases), -1, k)
            if noisy
            else None
        )
        for phase_factor in (half_step_phases, -half_step_phases):
            gain = (outer + phase_factor[:, None] * inner).reshape(shape)
            if noise is not None:
                gain += (noise @ self._mean_noise(phase_factor, step)).reshape(shape)
            yield [gain[:, :, i] for i in range(axles)]

    def _mean_noise(self, half_step_phases: np.ndarray, step: float) -> np.ndarray:
        """Gains (w, k, m) from a filter's states at the begin of a step to the mean noise over this step."""
        road, phase_factor = self.reduced.excitation, half_step_phases[:, None, None]
        slope = (phase_factor**2 - 1) / step * np.eye(len(road.F)) - self.speed * road.F * (
            (1 + 4 * phase_factor + phase_factor**2) / 6
        )
        return np.asarray(np.linalg.pinv(self.speed**0.5 * road.G) @ slope)

    def _spectral_densities(
        self, gains: list[np.ndarray], aliased_waves: np.ndarray, alias_weights: np.ndarray, is_independent: np.ndarray
    ) -> np.ndarray:
        """Spectral densities (w, q) of the quantities, summed over all ``aliased_waves`` (a, w) that are aliased to the
        same frequency, each weighted with its ``alias_weights`` (a, 1).
        """
        road, speeds, total = self.reduced.excitation, np.array([self.speed]), 0.0
        late, by_noises = {}, self.filters.by_noises(gains)
        for pair in self.filters.pairs:
            density = alias_weights * pair.density(speeds, aliased_waves.ravel()).reshape(aliased_waves.shape)
            axle_factor, shared = pair_factors(by_noises, pair, road.independent)
            total = total + (density.sum(axis=0)[:, None] * axle_factor).real
            for (i, j), met in shared.items():
                length = road.lengths[i] - road.lengths[j]
                if length not in late:
                    late[length] = np.exp(-1j * aliased_waves * (length / self.speed)) * ~is_independent
                total = total + ((density * late[length]).sum(axis=0)[:, None] * met).real
        return np.asarray(total)

    @cached_property
    def filters(self) -> Filters:
        """Road filters of one axle, in terms of their poles."""
        return Filters(self.reduced.excitation)

    def _count_of_aliases(self, step: float) -> int:
        """Number of aliased waves to either side that are summed; beyond it, contributions fall with the square of the
        distance.
        """
        corner = self.speed * abs(np.linalg.eigvals(self.reduced.excitation.F)).max()
        return max(LEAST_ALIASES, int(np.ceil(ALIAS_RANGE_FACTOR * corner * step / (2 * np.pi))))

    def _frequencies(self, step: float) -> tuple[np.ndarray, ...]:
        """Angular frequencies (rad/s) of integration up to two steps per period, with their weights."""
        highest = np.pi / step
        delay = max(self.reduced.excitation.lengths) / self.speed
        return frequency_panels(self.motions[0], delay, (LOWEST_FREQUENCY_SHARE * highest, highest))

    def _weighting_factors(self, omega: np.ndarray) -> np.ndarray:
        """Complex gains (q, w) of the weighting filters at angular frequencies ``omega`` (rad/s)."""
        names = dict(self.weightings)
        return weighting_factors([names.get(row, "") for row in self.rows], omega)


class RunInSteps(Protocol):
    """Protocol of time simulations of a scene at one speed, with steps (s) of any length."""

    @property
    def longest_stable_step(self) -> float:
        """Longest step (s) with which the simulation is stable."""

    def deviations(self, step: float) -> np.ndarray:
        """Standard deviations (q,) of the quantities, as sampled by a run with steps of ``step`` (s)."""


def longest_step(marches: Sequence[RunInSteps], exact_deviations: list[np.ndarray], tolerance: float) -> float:
    """Longest step (s) with which runs at every speed keep all quantities within a relative tolerance of their
    ``exact_deviations`` standard deviations.

    exact_deviations : standard deviations of the full scene, (q,) for each march. The result is 0 where the shortest
    step that is tried breaks the tolerance.
    """
    runs = list(zip(marches, exact_deviations, strict=True))

    def share(step: float) -> float:
        """Logarithm of the ratio of the largest error to the tolerance, or that of the first march which breaks it."""
        worst = -np.inf
        for i, (march, deviations) in enumerate(runs):
            error = float(abs(march.deviations(step) / deviations - 1.0).max()) / tolerance
            if not error <= 1.0:
                runs.insert(0, runs.pop(i))  # what broke it here is likely to break it elsewhere
                return float(np.log(error)) if error < np.inf else np.inf
            worst = max(worst, float(np.log(max(error, NEGLIGIBLE_SHARE))))
        return worst

    high = 0.999 * min(march.longest_stable_step for march in marches)
    steps = np.geomspace(SHORTEST_STEP_SHARE * high / 0.999, high, STEPS_TRIED)
    shares, low, broken = dict[int, float](), -1, STEPS_TRIED
    while broken - low > 1:
        middle = (low + broken) // 2
        shares[middle] = share(steps[middle])
        low, broken = (middle, broken) if shares[middle] <= 0.0 else (low, middle)
    if low < 0 or broken == STEPS_TRIED:
        return float(steps[low]) if low >= 0 else 0.0
    return _longest_step_below((steps[low], steps[broken]), (shares[low], shares[broken]), share)


def _longest_step_below(
    step_limits: tuple[float, float], error_ratios: tuple[float, float], error_ratio: Callable[[float], float]
) -> float:
    """Longest of ``PARTS_BETWEEN_STEPS`` logarithmically spaced steps (s) between two that keeps the tolerance.

    An error grows as a power of the step, so that linear interpolation of logarithms predicts where to look next.
    """
    (low, high), (share_below, share_above) = (0, PARTS_BETWEEN_STEPS), error_ratios
    while high - low > 1:
        guess = (
            low + (high - low) * -share_below / (share_above - share_below)
            if np.isfinite(share_above)
            else (low + high) / 2
        )
        middle = int(np.clip(np.round(guess), low + 1, high - 1))
        value = error_ratio(step_limits[0] * (step_limits[1] / step_limits[0]) ** (middle / PARTS_BETWEEN_STEPS))
        (low, share_below), (high, share_above) = (
            ((middle, value), (high, share_above)) if value <= 0.0 else ((low, share_below), (middle, value))
        )
    return float(step_limits[0] * (step_limits[1] / step_limits[0]) ** (low / PARTS_BETWEEN_STEPS))


@dataclass(frozen=True)
class Cost:
    """Cost of a run. states : of vehicle and road filters, without weightings; step (s) : the largest at which the
    classical Runge-Kutta method is stable for the vehicle; calls : of its right-hand side per second of motion with
    this step.

    The road's own poles do not bound the step: a time run reads heights from a table made beforehand. How fine a step
    must be to resolve the road or a quantity is another question, the same with and without an effect.
    """

    states: int
    step: float
    calls: float

    @property
    def work(self) -> float:
        """Work per second of motion: right-hand side calls times states."""
        return self.calls * self.states


def cost(vehicle: ReducedVehicle, excitation: RoadExcitation) -> Cost:
    """Cost of a run of a stable vehicle on its road with the largest stable step; infinite for an unstable vehicle,
    which has none.
    """
    states, step = len(vehicle.states.A) + len(excitation.heights) * len(excitation.F), vehicle.stable_step
    return Cost(states, step, RK4_STAGES / step if step else np.inf)
