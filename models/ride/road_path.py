"""Random road under all wheels over time, at equal half steps, for time integration at a constant speed.

From one half step to the next a shape filter moves by its exact transition and by noise of its exact covariance: the
heights at the half steps are those of the road itself, whatever the step. An axle behind the first meets what that
one met a whole number of half steps before.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, log2

import numpy as np
from scipy.linalg import block_diag, expm, solve_continuous_lyapunov

from models.core.errors import InputError
from models.core.noise import ROAD, normal_samples
from models.ride.monte_carlo import path_cell
from models.road.excitation import RoadExcitation
from models.vehicles.spatial import SpatialVehicle


@dataclass(frozen=True)
class RoadPath:
    """Random road travelled at a constant ``speed`` (m/s) and sampled every ``half_step`` (s)."""

    excitation: RoadExcitation
    speed: float
    half_step: float

    @property
    def step(self) -> float:
        """Time step (s) of a simulation on this road path."""
        return 2.0 * self.half_step

    @property
    def has_rates(self) -> bool:
        """Whether the heights have finite rates, as with filters of second order, where white noise does not act on
        heights directly."""
        return not any((H @ self.excitation.G).any() for H in self.excitation.heights)

    def wheel_heights_and_rates(self, step_count: int, seed: int, first_path_index: int = 0) -> np.ndarray:
        """Heights (m) under the wheels, then their rates (m/s), at every half step: (2 steps + 1, 2 w).

        Rates that are white noise are left 0, which is right for tyres without damping only.
        """
        return next(self.blocks(step_count, 1, seed, first_path_index))[:, :, 0]

    def blocks(self, step_count: int, copy_count: int, seed: int, first_path_index: int = 0) -> Iterator[np.ndarray]:
        """Yield, without end, roads (2 steps + 1, 2 w, copies) under all copies; each begins where the last one ended.

        The first begins in the road's stationary state, or at 0 where it has none; they draw the noise paths
        ``first_path_index``, ``first_path_index`` + 1 and so on."""
        F, G, heights = _axles(self.excitation)
        move, root = _transition_over(F, G, self.speed * self.half_step)
        lags = np.rint(np.array(self.excitation.lengths) / (self.speed * self.half_step)).astype(int)
        lags = 0 * lags if self.excitation.independent else lags
        met, buffer = np.empty((0, len(F), copy_count)), np.empty((len(F), copy_count))
        while True:
            fresh = 2 * step_count + (0 if len(met) else 1 + max(lags))
            drawn = normal_samples(seed, first_path_index, fresh * copy_count, len(F), noise_source=ROAD).reshape(
                fresh, copy_count, -1
            )
            drawn = np.concatenate(
                [met[-1:] if len(met) else _stationary_root(F, G) @ drawn[:1].mT, root @ drawn[len(met) == 0 :].mT]
            )
            for last_states, next_states in pairwise(drawn):
                np.add(
                    next_states, np.dot(move, last_states, buffer), next_states
                )  # two thirds of the time of after += move @ before
            met = np.concatenate([met[:-1], drawn])
            yield self._road_under_wheels(F, heights, met, lags, 2 * step_count + 1)
            met, first_path_index = met[2 * step_count :], first_path_index + 1

    def _road_under_wheels(
        self,
        F: np.ndarray,
        height_rows: Sequence[np.ndarray],
        filter_states: np.ndarray,
        lags_of_axles: np.ndarray,
        row_count: int,
    ) -> np.ndarray:
        """Heights and rates (row_count, 2 w, copies) under all wheels, from the filter states ``filter_states`` with
        each axle's delay.
        """
        roads = np.zeros((row_count, 2 * len(height_rows[0]), filter_states.shape[2]))
        for lag, H in zip(lags_of_axles, height_rows, strict=True):
            rates = self.speed * H @ F if self.has_rates else 0.0 * H
            first = max(lags_of_axles) - lag
            roads += np.vstack([H, rates]) @ filter_states[first : first + row_count]
        return roads


def check_rates(vehicle: SpatialVehicle, road_excitation: RoadExcitation, scene_path: str = "") -> None:
    """Raise InputError for damped tyres on a road whose heights have no rates: time integration cannot read them."""
    if any(tyre.damping for tyre in vehicle.tyres) and not RoadPath(road_excitation, 1.0, 1.0).has_rates:
        raise InputError(
            scene_path,
            "road.cutoff",
            None,
            "is missing: damped tyres see the road's rate, which without "
            "a second corner is white noise and has no values in time",
        )


def road_path(road_excitation: RoadExcitation, speed: float, longest_step: float) -> RoadPath:
    """Road path for time integration with steps (s) of at most ``longest_step``; its half steps divide the axle
    distances."""
    return RoadPath(road_excitation, speed, path_cell(road_excitation.lengths, speed * longest_step / 2.0)[0] / speed)


def _axles(road_excitation: RoadExcitation) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
    """Filter matrices F, G and heights of the independent noise sources: one filter, or one per axle if the axles are
    independent."""
    F, G, heights = road_excitation.F, road_excitation.G, road_excitation.heights
    if not road_excitation.independent:
        return F, G, heights
    rows = [np.hstack([H if i == j else 0.0 * H for j in range(len(heights))]) for i, H in enumerate(heights)]
    return block_diag(*[F] * len(heights)), block_diag(*[G] * len(heights)), tuple(rows)


def _transition_over(F: np.ndarray, G: np.ndarray, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition matrix of the road filter over a length (m), and a square root of the covariance of the noise in it
    (van Loan).

    The result is built by doubling short lengths, because rounding would grow exponentially over many decay lengths at
    once.
    """
    m, halved = len(F), max(0, ceil(log2(max(distance * float(np.linalg.norm(F)), 1.0))))
    block = expm(distance / 2**halved * np.block([[-F, G @ G.T], [np.zeros((m, m)), F.T]]))
    move = block[m:, m:].T
    covariance = move @ block[:m, m:]
    for _ in range(halved):
        covariance, move = covariance + move @ covariance @ move.T, move @ move
    return move, _covariance_root(covariance)


def _stationary_root(F: np.ndarray, G: np.ndarray) -> np.ndarray:
    """Square root of the stationary covariance of the road filter's state; zeros if the road is a random walk."""
    if np.linalg.eigvals(F).real.max() >= 0.0:
        return np.zeros_like(F)
    return _covariance_root(solve_continuous_lyapunov(F, -G @ G.T))


def _covariance_root(P: np.ndarray) -> np.ndarray:
    """Square root S, with S S' = P, of a symmetric P that is positive semidefinite except for rounding."""
    values, vectors = np.linalg.eigh((P + P.T) / 2.0)
    return vectors * np.sqrt(values.clip(0.0))
