"""Monte Carlo simulation of a linear vehicle: many copies on independent random roads, integrated exactly from cell to
cell of the road.

Within a cell the road's white noise is what its Legendre series says: coefficients of unit variance, independent, the
same for every axle that crosses the cell, however much later and at whatever speed. The response to each coefficient
is a sum of powers of the cell's matrix, and products of these responses are the joint covariance of all axles'
responses to the cell, down to ``LEGENDRE_MODES``: no step error, at any length of cell that the series converges for.

A cell of length d crossed in time h has the matrix h A0 + d A1 of x' = (A0 + v A1) x: exact at constant speed; where
the speed varies, it is taken as even within one cell.
"""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from models.core.errors import InputError
from models.core.noise import ROAD, SAMPLES_PER_BLOCK, normal_samples
from models.ride.covariance import FINITE, stationary_covariance
from models.ride.excited import DelayedSystem
from models.ride.road_in_path import system_at_speed, taylor_terms
from models.ride.speed_profile import SpeedProfile
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle

LEGENDRE_MODES = 8
"""Count of Legendre coefficients of the noise in a cell: a further coefficient adds 1e-9 of a cell's variance where
LARGEST_RATE_TIMES_CELL is reached."""
LARGEST_RATE_TIMES_CELL = 2.0
"""Largest product of the fastest rate of vehicle or road (1/m) and the cell's length (m)."""
SERIES_TERMS = 30
"""Count of terms of the series in powers of a cell's matrix: 2^30 / 30! = 4e-24."""
SLOWEST_DECAY = 1e-6
"""Decay rate (1/s) below which a motion does not die out in any run."""
FORGETTING_EXPONENT = 9.0
"""Product of the slowest decay rate and the time that copies, begun at zero, run before they count: e^-18 of a variance
is missing."""
AXLE_SHIFT_TOLERANCE = 1e-3
"""Distance (m) by which an axle may be moved so that all axle distances are whole numbers of cells: 0.1 ms at 10
m/s."""


@dataclass(frozen=True)
class VarianceEstimate:
    """Variances of the outputs estimated from the copies: time (N,), s; variance, error (N, p), unit^2, inf where a
    variance is infinite.

    ``error`` is the standard error. The mean is known to be zero.
    """

    names: tuple[str, ...]
    time: np.ndarray
    variance: np.ndarray
    error: np.ndarray
    copies: int

    def z(self, expected_deviation: np.ndarray) -> np.ndarray:
        """Standard scores (N, p): estimated variance minus the square of the given standard deviations (N, p), divided
        by the standard errors."""
        known = np.isfinite(self.variance)
        variance_error = np.subtract(
            self.variance, expected_deviation**2, out=np.zeros_like(self.variance), where=known
        )
        return np.divide(variance_error, self.error, out=np.full_like(variance_error, np.nan), where=known)


def variances_along_drive(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed_profile: SpeedProfile,
    instants: Sequence[float] | np.ndarray,
    *,
    copy_count: int = 4000,
    seed: int = 0,
    weightings: Mapping[str, str] | None = None,
) -> VarianceEstimate:
    """Variances of the outputs over the copies along a drive with varying speed, at the ends of cells next to each of
    the instants (s).

    The drive begins in the stationary state of its first speed. weightings : weighted outputs to add, as in
    ``weighting.system_with_weightings``. Raises InputError for a standstill: a cell would take for ever.
    """
    slowest = float(speed_profile.speeds.min())
    if slowest == 0.0:
        raise InputError("", "drive.speed", 0.0, "must be above 0 for Monte Carlo, which steps along the road")
    cells = _PathCells(linear_vehicle, road_excitation, weightings, slowest)
    ends = speed_profile.time(cells.length * np.arange(1, int(speed_profile.paths[-1] / cells.length) + 1))
    wanted = np.unique(np.abs(ends[:, None] - np.asarray(instants)).argmin(axis=0))
    first = float(speed_profile.speeds[0])
    lead = np.full(cells.cells_to_forget(first), cells.length / first)
    rows = []
    durations = np.append(lead, np.diff(ends[: wanted[-1] + 1], prepend=speed_profile.times[0]))
    for number, x in enumerate(cells.states(durations, copy_count, seed)):
        if number - len(lead) in wanted:
            y = cells.outputs(x, float(speed_profile.speed(ends[number - len(lead)])))
            rows.append(((y**2).mean(axis=1), (y**2).std(axis=1) / copy_count**0.5))
    return cells.estimate(ends[wanted], np.array(rows), copy_count)


def variances_at_constant_speed(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    duration: float,
    *,
    copy_count: int = 4000,
    seed: int = 0,
    weightings: Mapping[str, str] | None = None,
) -> VarianceEstimate:
    """Stationary variances (1, p) of the outputs at a constant speed (m/s), averaged over the copies and, in each of
    them, over ``duration`` (s)."""
    cells = _PathCells(linear_vehicle, road_excitation, weightings, speed)
    skipped, counted = cells.cells_to_forget(speed), max(1, round(duration * speed / cells.length))
    total = np.zeros(())
    for number, x in enumerate(cells.states(np.full(skipped + counted, cells.length / speed), copy_count, seed)):
        if number >= skipped:
            total = total + cells.outputs(x, speed) ** 2
    mean = total / counted
    rows = np.array([[mean.mean(axis=1), mean.std(axis=1) / copy_count**0.5]])
    return cells.estimate(np.array([duration]), rows, copy_count)


def path_cell(
    axle_distances: Sequence[float], longest_cell: float, tolerance: float = AXLE_SHIFT_TOLERANCE
) -> tuple[float, np.ndarray]:
    """Length (m) of a path cell, at most ``longest_cell``, and by how many cells each axle is behind the first.

    All distances are whole numbers of cells up to ``tolerance`` (m), the last axle's exactly.
    """
    behind = np.asarray(axle_distances)
    if behind[-1] == 0.0:
        return longest_cell, np.zeros(len(behind), int)
    count = int(np.ceil(behind[-1] / longest_cell))
    while True:
        cell = behind[-1] / count
        if np.abs(np.rint(behind / cell) * cell - behind).max() <= tolerance:
            return cell, np.rint(behind / cell).astype(int)
        count += 1


class _PathCells:
    """Vehicle on a path that is divided into cells, which fit its axle distances and its slowest speed (m/s)."""

    def __init__(
        self,
        linear_vehicle: LinearVehicle,
        road_excitation: RoadExcitation,
        weightings: Mapping[str, str] | None,
        slowest_speed: float,
    ) -> None:
        def system(speed: float) -> DelayedSystem:
            return system_at_speed(linear_vehicle, road_excitation, speed, weightings)

        self.at_unit_speed, self.at_double_speed = system(1.0), system(2.0)
        self.finite = np.array([status == FINITE for status in stationary_covariance(system(slowest_speed)).status])
        fastest = np.abs(np.linalg.eigvals(system(slowest_speed).A)).max() / slowest_speed
        self.length, self.shifts = path_cell(road_excitation.lengths, LARGEST_RATE_TIMES_CELL / fastest)
        self.at_rest, self.per_speed = (
            2.0 * self.at_unit_speed.A - self.at_double_speed.A,
            self.at_double_speed.A - self.at_unit_speed.A,
        )

    def cells_to_forget(self, speed: float) -> int:
        """Number of cells at a constant speed after which a copy no longer depends on its initial state."""
        slowest = -np.linalg.eigvals(self.at_rest + speed * self.per_speed).real.max()
        if slowest < SLOWEST_DECAY:
            refusal = "has a motion that does not die out: a copy never forgets its beginning"
            raise InputError("", "vehicle", None, refusal)
        return int(np.ceil(FORGETTING_EXPONENT / slowest * speed / self.length))

    def states(self, crossing_times: np.ndarray, copy_count: int, seed: int) -> Iterator[np.ndarray]:
        """States (n, copies) at the end of each cell; ``crossing_times`` : times (s) in which the first axle crosses
        the cells.
        """
        k, axles = self.at_unit_speed.B[0].shape[1], len(self.at_unit_speed.B)
        independent = self.at_unit_speed.independent
        draws = _draw_coefficients(seed, copy_count, k * LEGENDRE_MODES * (axles if independent else 1))
        last_shift = int(self.shifts[-1])
        met = deque((next(draws) for _ in range(last_shift)), maxlen=last_shift + 1)
        x, last_duration = np.zeros((len(self.at_rest), copy_count)), None
        for duration in crossing_times:
            met.append(next(draws))
            if duration != last_duration:
                E, R = self._cell_transition(duration)
                last_duration = duration
            noise = [met[-1]] if independent else [met[-1 - shift] for shift in self.shifts]
            x = E @ x + R @ np.concatenate(noise)
            yield x

    def _cell_transition(self, crossing_time: float) -> tuple[np.ndarray, np.ndarray]:
        """Transition matrix (n, n) of the state over a cell, and responses (n, a k LEGENDRE_MODES) to the noise in it,
        axle by axle."""
        matrix = crossing_time * self.at_rest + self.length * self.per_speed
        rows = [np.stack(self.at_unit_speed.B, axis=1) * self.length**0.5]
        for _ in range(SERIES_TERMS - 1):
            rows.append(np.tensordot(matrix, rows[-1], 1))
        responses = np.einsum("jnak,jl->nakl", np.stack(rows), _legendre_integrals())
        return expm(matrix), responses.reshape(len(matrix), -1)

    def outputs(self, vehicle_states: np.ndarray, speed: float) -> np.ndarray:
        """Outputs (p, copies) at states x (n, copies), without their white-noise part."""
        return (self.at_unit_speed.C + (speed - 1.0) * (self.at_double_speed.C - self.at_unit_speed.C)) @ vehicle_states

    def estimate(self, time: np.ndarray, variances_and_errors: np.ndarray, copy_count: int) -> VarianceEstimate:
        """``VarianceEstimate`` from variances and their errors (N, 2, p), inf where an output has no finite
        variance."""
        moments = np.where(self.finite, variances_and_errors, np.inf)
        return VarianceEstimate(self.at_unit_speed.names, time, moments[:, 0], moments[:, 1], copy_count)


def _legendre_integrals() -> np.ndarray:
    """Integrals (SERIES_TERMS, LEGENDRE_MODES) of (1 - u)^j / j! times the orthonormal Legendre polynomials over u from
    0 to 1."""
    points, weights = np.polynomial.legendre.leggauss(SERIES_TERMS)
    degree = np.sqrt(2.0 * np.arange(LEGENDRE_MODES) + 1.0)
    basis = np.polynomial.legendre.legvander(points, LEGENDRE_MODES - 1) * degree
    return np.einsum("u,uj,ul->jl", weights / 2.0, taylor_terms((1.0 - points) / 2.0, SERIES_TERMS), basis)


def _draw_coefficients(seed: int, copy_count: int, channel_count: int) -> Iterator[np.ndarray]:
    """Yield the random coefficients (channels, copies) of each cell in turn.

    Several cells are drawn from the same block of noise if there are few copies.
    """
    together, path = max(1, SAMPLES_PER_BLOCK // copy_count), 0
    while True:
        yield from (
            normal_samples(seed, path, together * copy_count, channel_count, noise_source=ROAD)
            .reshape(together, copy_count, -1)
            .mT
        )
        path += 1
