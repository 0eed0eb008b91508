"""Variances of all outputs over correlation cases and speeds, by fast modal sums where these are accurate enough.

The fast route is the covariance in closed form from eigenvectors. A vehicle behind road filters, with weightings behind
it, has a block triangular matrix. Each block is diagonalised on its own (the vehicle's and the weightings' once for all
roads and speeds, a road's in path), and divisions by differences of eigenvalues join them. Every covariance then is a
sum over pairs, -Q_mn / (s_m + s_n*).

Digits are lost where eigenvectors are nearly parallel, where two eigenvalues of different blocks nearly meet and
where terms of a sum cancel. ``relative_error`` estimates how many; beyond LARGEST_FAST_ERROR the direct way is taken
instead.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import matrix_balance
from scipy.sparse.csgraph import connected_components

from models.ride.covariance import FINITE, noise_arrivals, rounding_thresholds, stationary_covariance, variance_verdicts
from models.ride.excited import DelayedSystem, vehicle_with_road
from models.ride.marginal import MATRIX_ACCURACY, UnstableVehicle, VarianceGrowth
from models.ride.weighting import system_with_weightings
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle

LARGEST_FAST_ERROR = 1e-9
"""Largest estimated relative error of the fast modal sums; the estimate is ten to a thousand times too high."""


@dataclass(frozen=True)
class VarianceSweep:
    """Stationary variances over correlation cases and speeds. variance (cases, speeds, outputs), inf where infinite,
    with status and reason for each; units (outputs,).

    ``direct_counts``: number of points computed by the direct method, by the reason for not using the fast one.
    """

    cases: tuple[str, ...]
    speeds: np.ndarray
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    variance: np.ndarray
    status: np.ndarray
    reason: np.ndarray
    direct_counts: Mapping[str, int]

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations (cases, speeds, outputs) in the outputs' units."""
        return np.sqrt(self.variance)

    def of(self, correlation_case: str, output_name: str) -> np.ndarray:
        """Standard deviations (speeds,) of one output in one correlation case."""
        return self.deviation[self.cases.index(correlation_case), :, self.outputs.index(output_name)]


def variance_sweep(
    linear_vehicle: Callable[[float], LinearVehicle],
    excitation_by_case: Mapping[str, RoadExcitation],
    speeds: Sequence[float] | np.ndarray,
    weighting_filters: Mapping[str, str] | None = None,
    matrix_accuracy: float = MATRIX_ACCURACY,
    by_modes: bool = True,
) -> VarianceSweep:
    """Stationary variances of a vehicle, given as a function of the speed (m/s), on each road at each speed.

    weighting_filters : weightings by output, as ``system_with_weightings`` takes them. by_modes : False sends every
    point the direct way. Raises Unstable.
    """
    shared, direct, points = SharedModes(), Counter[str](), []
    for speed in speeds:
        linear = linear_vehicle(speed)
        for excitation in excitation_by_case.values():
            plain = vehicle_with_road(linear, excitation, speed)
            system = system_with_weightings(plain, weighting_filters or {})
            states = len(plain.A) - len(plain.B) * len(excitation.F)
            point = (
                _fast_variances(system, states, excitation, speed, shared, matrix_accuracy)
                if by_modes
                else DIRECT_BY_REQUEST
            )
            if isinstance(point, str):
                direct[point] += 1
                point = _direct_variances(system, speed, matrix_accuracy)
            points.append(point)
    shape = (len(speeds), len(excitation_by_case), -1)
    variance, status, reason = (
        np.array(per_speed).reshape(shape).swapaxes(0, 1).copy() for per_speed in zip(*points, strict=True)
    )
    units = *(output.unit for output in linear.outputs), *["m/s^2"] * len(weighting_filters or {})
    return VarianceSweep(
        tuple(excitation_by_case), np.array(speeds), system.names, units, variance, status, reason, direct
    )


DIRECT_BY_REQUEST = "asked for"
"""Reason of a variance by the direct method that the caller wanted."""
OutputVariances = tuple[np.ndarray, tuple[str, ...], tuple[str, ...]]
"""Variances, statuses and reasons of all outputs."""


def _direct_variances(delayed_system: DelayedSystem, speed: float, matrix_accuracy: float) -> OutputVariances:
    """Variances from solving the Lyapunov equation; the error for an unstable vehicle states its speed."""
    try:
        exact = stationary_covariance(delayed_system, matrix_accuracy)
    except UnstableVehicle as error:
        raise UnstableVehicle(error.growth, error.frequency, speed) from None
    return exact.variance, exact.status, exact.reason


def _fast_variances(
    delayed_system: DelayedSystem,
    vehicle_state_count: int,
    road_excitation: RoadExcitation,
    speed: float,
    shared_modes: "SharedModes",
    matrix_accuracy: float,
) -> OutputVariances | str:
    """Variances by modal sums, or a text that says why these are unreliable here."""
    quick = modal_variances(delayed_system, vehicle_state_count, road_excitation.F, speed, shared_modes)
    if isinstance(quick, str):
        return quick
    no_growth = VarianceGrowth(np.zeros(len(delayed_system.C)), np.zeros(len(delayed_system.C), int))
    status, reason = variance_verdicts(
        noise_arrivals(delayed_system).D,
        quick.variance,
        quick.rounding_floor,
        no_growth,
        quick.fastest_rate,
        matrix_accuracy,
    )
    finite = np.array(status) == FINITE
    if (quick.relative_error[finite] > LARGEST_FAST_ERROR).any():
        return "terms cancel"
    return np.where(finite, quick.variance, np.inf), status, reason


@dataclass(frozen=True)
class SystemModes:
    """Eigen-decomposition A = V diag(values) V^-1, and the condition number of V after balancing."""

    A: np.ndarray
    values: np.ndarray
    V: np.ndarray
    inverse: np.ndarray
    condition: float

    @property
    def rate_rounding(self) -> float:
        """Relative rounding error of the slowest decay rate: that of the fastest motion, times the condition number."""
        return (
            MACHINE_EPSILON
            * self.condition
            * float(abs(self.values).max(initial=0.0) / abs(self.values.real).min(initial=1.0))
        )


def modes_of_matrix(A: np.ndarray) -> SystemModes:
    """Eigenvalues and eigenvectors of A (n, n), block by block for uncoupled blocks, so that equal blocks give exactly
    equal results."""
    count, label = connected_components(A != 0, directed=False)
    values, V, inverse = (np.zeros(shape, complex) for shape in (len(A), A.shape, A.shape))
    worst = 1.0
    for block in range(count):
        block_indices = np.flatnonzero(label == block)
        balanced, (scale, _) = matrix_balance(A[np.ix_(block_indices, block_indices)], permute=False, separate=True)
        values[block_indices], vectors = np.linalg.eig(balanced)
        worst = max(worst, np.linalg.cond(vectors))
        if not np.isfinite(worst) or worst * MACHINE_EPSILON > 1:
            return SystemModes(A, values, V, inverse, np.inf)
        V[np.ix_(block_indices, block_indices)], inverse[np.ix_(block_indices, block_indices)] = (
            scale[:, None] * vectors,
            np.linalg.inv(vectors) / scale,
        )
    return SystemModes(A, values, V, inverse, worst)


MACHINE_EPSILON = float(np.finfo(float).eps)
LARGEST_RATE_ROUNDING = 1e-11
"""Largest relative rounding of the slowest decay rate at which modal sums are used."""


class SharedModes:
    """Cache of eigen-decompositions, so that roads and speeds with the same block share its modes."""

    def __init__(self) -> None:
        self.known: dict[bytes, SystemModes] = {}

    def of(self, A: np.ndarray) -> SystemModes:
        """Modes of a matrix block, computed once."""
        if (key := A.tobytes()) not in self.known:
            self.known[key] = modes_of_matrix(A)
        return self.known[key]


@dataclass(frozen=True)
class ModalVariances:
    """Variances by modal sums for each output (p,): variance, ``rounding_floor`` that rounding makes of a zero
    variance, and bound ``relative_error``.

    fastest_rate : rate of the system in 1/s
    """

    variance: np.ndarray
    rounding_floor: np.ndarray
    relative_error: np.ndarray
    fastest_rate: float


def modal_variances(
    delayed_system: DelayedSystem,
    vehicle_state_count: int,
    road_filter: np.ndarray,
    speed: float,
    shared_modes: SharedModes,
) -> ModalVariances | str:
    """Variances of the outputs by modal sums, for a system as built by ``vehicle_with_road`` and
    ``system_with_weightings``; or a text that says why they cannot be computed here.

    vehicle_state_count : number of its states, which stand first; road_filter : the filter F (m, m) in path, one per
    axle behind them; the states of weightings stand last."""
    axles = len(delayed_system.B)
    first_weighting_state = vehicle_state_count + axles * len(road_filter)
    A = delayed_system.A
    vehicle_modes = shared_modes.of(A[:vehicle_state_count, :vehicle_state_count])
    path = shared_modes.of(road_filter)
    behind = shared_modes.of(A[first_weighting_state:, first_weighting_state:])
    if max(mode_set.condition for mode_set in (vehicle_modes, path, behind)) * MACHINE_EPSILON > 1e-6:
        return "eigenvectors are nearly parallel"
    values = [vehicle_modes.values, np.tile(speed * path.values, axles), behind.values]
    if max(mode_set.real.max(initial=-np.inf) for mode_set in values) > -1e-6:
        return "a motion does not die out"
    if max(mode_set.rate_rounding for mode_set in (vehicle_modes, path, behind)) > LARGEST_RATE_ROUNDING:
        return "rates lie too far apart"
    V, back = np.kron(np.eye(axles), path.V), np.kron(np.eye(axles), path.inverse)
    with np.errstate(divide="ignore", invalid="ignore"):
        met = _coupling_solution(
            vehicle_modes, A[:vehicle_state_count, vehicle_state_count:first_weighting_state] @ V, values[1]
        )
        felt = _coupling_solution(behind, A[first_weighting_state:, :vehicle_state_count] @ vehicle_modes.V, values[0])
        heard = _coupling_solution(
            behind,
            A[first_weighting_state:, :vehicle_state_count] @ met
            + A[first_weighting_state:, vehicle_state_count:first_weighting_state] @ V,
            values[1],
        )
    C0, C1, C2 = (
        delayed_system.C[:, :vehicle_state_count],
        delayed_system.C[:, vehicle_state_count:first_weighting_state],
        delayed_system.C[:, first_weighting_state:],
    )
    C = np.hstack([C0 @ vehicle_modes.V + C2 @ felt, C0 @ met + C1 @ V + C2 @ heard, C2 @ behind.V])
    arrivals, inputs = noise_arrivals(delayed_system), []
    for b in arrivals.B:
        of_road = back @ b[vehicle_state_count:first_weighting_state]
        of_vehicle = vehicle_modes.inverse @ (b[:vehicle_state_count] - met @ of_road)
        of_weighting = behind.inverse @ (b[first_weighting_state:] - felt @ of_vehicle - heard @ of_road)
        inputs.append(np.vstack([of_vehicle, of_road, of_weighting]))
    condition = vehicle_modes.condition * path.condition * behind.condition
    return _variance_sum(np.concatenate(values), C, inputs, arrivals.delays, arrivals.independent, condition)


def _coupling_solution(filter_block: SystemModes, coupling: np.ndarray, mode_values: np.ndarray) -> np.ndarray:
    """Solution X of A X + coupling = X diag(values), for a diagonalised A."""
    return filter_block.V @ ((filter_block.inverse @ coupling) / (mode_values - filter_block.values[:, None]))


def _variance_sum(
    mode_values: np.ndarray,
    C: np.ndarray,
    noise_inputs: list[np.ndarray],
    delays: list[float],
    has_independent_axles: bool,
    condition_number: float,
) -> ModalVariances | str:
    """Variances of the outputs y = C x for modes x_m' = s_m x_m + noise through the inputs, summed over the arrivals of
    noise at the axles."""
    earlier_responses = np.zeros_like(noise_inputs[0])
    Q = np.zeros((len(mode_values), len(mode_values)), complex)
    for j, b in enumerate(noise_inputs):
        if j and not has_independent_axles:
            earlier_responses = np.exp(mode_values * (delays[j] - delays[j - 1]))[:, None] * (
                earlier_responses + noise_inputs[j - 1]
            )
        Q += b @ b.conj().T + earlier_responses @ b.conj().T + b @ earlier_responses.conj().T
    P = -Q / (mode_values[:, None] + mode_values.conj())
    variance = ((C @ P) * C.conj()).sum(axis=1).real
    size = ((abs(C) @ abs(P)) * abs(C)).sum(axis=1)
    if not np.isfinite(size).all():
        return "two eigenvalues of vehicle, road and weighting meet"
    floor = rounding_thresholds(C, P)
    relative_error = (
        MACHINE_EPSILON
        * condition_number
        * np.divide(size, abs(variance), out=np.full(len(C), np.inf), where=variance != 0)
    )
    return ModalVariances(
        variance.clip(0.0), floor, np.where(size > floor, relative_error, 0.0), float(abs(mode_values).max())
    )
