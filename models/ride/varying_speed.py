"""Covariance of a vehicle on a random road while its speed varies, also through standstill, with exact axle delays.

Noise lives in path, motion in time (``road_in_path``). In steps of time, E the transition of the state (y, f),

    P(end) = E P E' + integral over the path of the step of sum_j b_j b_j' + sum_(i<j) (c_ij b_j' + b_j c_ij') ds,

b_j the response, at the step's end, to a unit of noise that axle j meets at s, and c_ij to the same noise when axle i
before it met it, L_j - L_i of path earlier: at another time, at another speed, perhaps before a standstill. The
responses c wait in a queue and move with every step until axle j comes by. No distance is rounded, any number of
axles is one sum, and at v = 0 the path of a step is empty and that is all.

On the delay that varies with the speed see also J. K. Hammond and R. F. Harrison, J. Dyn. Syst. Meas. Control 108
(1986).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

from models.core.errors import InputError
from models.ride.covariance import DIFFUSING, FINITE, INFINITE, stationary_covariance
from models.ride.marginal import MATRIX_ACCURACY
from models.ride.road_in_path import DriveResponses, RoadInPath, road_in_path, system_at_speed
from models.ride.speed_profile import SpeedProfile, integration_points, step_ends_of_drive
from models.ride.sweep import variance_sweep
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle

LARGEST_RATE_TIMES_STEP = 1.0
"""Largest product of the fastest rate of vehicle or road and the step; half of it changes nothing above 1e-10."""
STEPS_PER_BLOCK = 128
"""Count of steps whose noise responses are computed at once."""


@dataclass(frozen=True)
class VaryingSpeedDeviations:
    """Standard deviations of the outputs at every instant of a drive with varying speed.

    time, path, speed (N,): s, m, m/s; deviation (N, p) of the outputs in their units, inf where an output diffuses
    and, while the road moves, where it holds white noise; height (N, w) of the road under each wheel, m, which may not
    change; status (p,) of the outputs as in ``covariance``; P (n, n): covariance of the last state of
    ``vehicle_with_road``.
    """

    names: tuple[str, ...]
    status: tuple[str, ...]
    time: np.ndarray
    path: np.ndarray
    speed: np.ndarray
    deviation: np.ndarray
    height: np.ndarray
    P: np.ndarray

    def of(self, output_name: str) -> np.ndarray:
        """Standard deviation (N,) of one output over the drive. Raises InputError for an unknown name."""
        if output_name not in self.names:
            raise InputError("", "output", output_name, "must be an output of the vehicle", self.names)
        return self.deviation[:, self.names.index(output_name)]

    def at(self, instants: Sequence[float] | np.ndarray) -> np.ndarray:
        """Standard deviations (k, p) of the outputs at instants (s), each taken at the nearest value of ``time``."""
        return self.deviation[np.abs(self.time[:, None] - np.asarray(instants)).argmin(axis=0)]


def varying_speed(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed_profile: SpeedProfile,
    *,
    weightings: Mapping[str, str] | None = None,
    instants: Sequence[float] | np.ndarray = (),
    matrix_accuracy: float = MATRIX_ACCURACY,
    largest_rate_times_step: float = LARGEST_RATE_TIMES_STEP,
) -> VaryingSpeedDeviations:
    """Standard deviations of the outputs along a drive that begins in the stationary state of its first speed, or at
    rest.

    The vehicle's matrices are those of one speed. The cost grows with the time that the last axle needs to where the
    first one is: below a crawl of about 0.3 m/s it is long.

    Parameters
    ----------
    weightings : weighted outputs to add, as in ``weighting.system_with_weightings``
    instants : times (s) within the drive that shall be among those of the result
    matrix_accuracy : of the vehicle's matrices, relative, as in ``stationary_covariance``
    largest_rate_times_step : fastest rate times step; the change at half of it tells the error

    Raises
    ------
    Unstable : a vehicle that leaves its equilibrium on its own
    InputError : a drive that never moves; a vehicle that knows no rest but is asked to begin there
    """
    first, fastest = float(speed_profile.speeds[0]), float(speed_profile.speeds.max())
    if fastest == 0.0:
        raise InputError("", "drive.speed", 0.0, "must be above 0 somewhere: at standstill nothing moves")
    form = road_in_path(linear_vehicle, road_excitation, weightings)
    status = stationary_covariance(
        system_at_speed(linear_vehicle, road_excitation, fastest, weightings), matrix_accuracy
    ).status
    if first == 0.0:
        P = _standing_covariance(form)
    else:
        P = stationary_covariance(
            system_at_speed(linear_vehicle, road_excitation, first, weightings), matrix_accuracy
        ).P
        P = np.linalg.solve(form.basis, np.linalg.solve(form.basis, P).T)
    rows_of_results = [_all_variances(form, P, first, status)]
    time = [speed_profile.times[0]]
    moments = _covariance_by_step(form, speed_profile, P, instants, largest_rate_times_step)
    for end, P in moments:
        time.append(end)
        rows_of_results.append(_all_variances(form, P, float(speed_profile.speed(np.array(end))), status))
    deviation, height = np.split(np.sqrt(rows_of_results), [len(status)], axis=1)
    end_time_array = np.array(time)
    return VaryingSpeedDeviations(
        form.names,
        status,
        end_time_array,
        speed_profile.path(end_time_array),
        speed_profile.speed(end_time_array),
        deviation,
        height,
        form.basis @ P @ form.basis.T,
    )


def quasi_stationary(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speeds: np.ndarray,
    *,
    weightings: Mapping[str, str] | None = None,
    matrix_accuracy: float = MATRIX_ACCURACY,
) -> np.ndarray:
    """Standard deviations (N, p) of the outputs as if each of the speeds (N,) had been constant for ever; for speed 0,
    those of a vehicle at rest.

    Errors are those of ``varying_speed``.
    """
    form = road_in_path(linear_vehicle, road_excitation, weightings)
    different, index_of_speed = np.unique(speeds, return_inverse=True)
    moving = different > 0.0
    deviations = np.empty((len(different), len(form.names)))
    if moving.any():
        sweep = variance_sweep(
            lambda _: linear_vehicle, {"road": road_excitation}, different[moving].tolist(), weightings, matrix_accuracy
        )
        deviations[moving] = sweep.deviation[0]
    if not moving.all():
        deviations[~moving] = np.sqrt(
            _all_variances(form, _standing_covariance(form), 0.0, [FINITE] * len(form.names))
        )[: len(form.names)]
    return deviations[index_of_speed]


def _covariance_by_step(
    path_equations: RoadInPath,
    speed_profile: SpeedProfile,
    P: np.ndarray,
    instants: Sequence[float] | np.ndarray,
    largest_rate_times_step: float,
) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the end time of each step of the drive and the covariance of (y, f) there, starting from P.

    Where the vehicle moves from the beginning, the steps begin earlier: the first axle is ahead of the last one.
    """
    road, first = path_equations.excitation, float(speed_profile.speeds[0])
    pairs = [] if road.independent else list(combinations(range(len(road.lengths)), 2))
    axle_distances = [road.lengths[j] - road.lengths[i] for i, j in pairs]
    lead = max(axle_distances, default=0.0) / first if first else 0.0
    motion, path = (float(np.abs(np.linalg.eigvals(matrix)).max()) for matrix in (path_equations.A, road.F))
    ends = step_ends_of_drive(
        speed_profile, speed_profile.times[0] - lead, instants, motion, path, largest_rate_times_step
    )
    points = integration_points(speed_profile, ends, sorted({distance for distance in axle_distances if distance}))
    responses = DriveResponses(path_equations, speed_profile)
    hits = [_NoiseResponses(responses, axle, points.time, ends) for axle in range(len(road.heights))]
    queues = [_ResponseQueue(responses, i, j, points.time, ends) for i, j in pairs]
    for step, (start, end) in enumerate(pairwise(ends)):
        E = responses.transition(start, end)
        for queue in queues:
            queue.advance(E, step)
        if end > speed_profile.times[0]:
            b, weight = [hit.of(step) for hit in hits], points.weight[hits[0].times_in_step(step)]
            half = [_sum_of_products(block, block, weight) / 2.0 for block in b]
            half += [_sum_of_products(queue.remove_first(len(weight)), b[queue.last], weight) for queue in queues]
            Q = np.sum(half, axis=0)
            P = E @ P @ E.T + Q + Q.T
            yield end, P


class _NoiseResponses:
    """State responses at the ends of the steps to the noise that an axle meets at given times (s) in ascending
    order."""

    def __init__(
        self, responses: DriveResponses, axle_index: int, step_times: np.ndarray, step_ends: np.ndarray
    ) -> None:
        self.responses, self.axle, self.time, self.ends = responses, axle_index, step_times, step_ends
        self.first = np.searchsorted(step_times, step_ends)
        self.made, self.block = np.zeros((0, 0, 0)), -1

    def times_in_step(self, step_index: int) -> slice:
        """Slice of the meeting times that lie in a step."""
        return slice(self.first[step_index], self.first[step_index + 1])

    def of(self, step_index: int) -> np.ndarray:
        """State responses (n, c, k) to the noise met in a step."""
        block = step_index // STEPS_PER_BLOCK
        last_step = min((block + 1) * STEPS_PER_BLOCK, len(self.ends) - 1)
        begin = self.first[block * STEPS_PER_BLOCK]
        if block != self.block:
            time = self.time[begin : self.first[last_step]]
            end = np.repeat(
                self.ends[block * STEPS_PER_BLOCK + 1 : last_step + 1],
                np.diff(self.first[block * STEPS_PER_BLOCK : last_step + 1]),
            )
            self.made, self.block = self.responses.noise_responses(self.axle, time, end), block
        return self.made[:, self.first[step_index] - begin : self.first[step_index + 1] - begin]


class _ResponseQueue:
    """State responses (n, q, k) to noise that an axle has already met and the ``last`` axle will meet at given times
    (s)."""

    def __init__(
        self,
        responses: DriveResponses,
        axle_index: int,
        last_axle_index: int,
        step_times: np.ndarray,
        step_ends: np.ndarray,
    ) -> None:
        profile, form, self.last = responses.profile, responses.form, last_axle_index
        distance = form.excitation.lengths[last_axle_index] - form.excitation.lengths[axle_index]
        position = profile.path(step_times) - distance
        met = profile.time(position) if distance else step_times
        is_before_start = np.isneginf(met)
        self.waiting = _delayed_responses(form, axle_index, -position[is_before_start])
        self.met = _NoiseResponses(responses, axle_index, met[~is_before_start], step_ends)

    def advance(self, transition_matrix: np.ndarray, step_index: int) -> None:
        """Advance all responses by one step, and add those to noise that is met within the step."""
        n, _, k = self.waiting.shape
        moved_responses = (transition_matrix @ self.waiting.reshape(n, -1)).reshape(n, -1, k)
        self.waiting = np.concatenate([moved_responses, self.met.of(step_index)], axis=1)

    def remove_first(self, response_count: int) -> np.ndarray:
        """Remove the first ``response_count`` entries from the queue and return them."""
        removed, self.waiting = self.waiting[:, :response_count], self.waiting[:, response_count:]
        return removed


def _sum_of_products(first_responses: np.ndarray, second_responses: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Sum over points and channels of the products of two responses, both (n, c, k), weighted with the points' weights
    (c,)."""
    n = len(first_responses)
    return (first_responses * weights[:, None]).reshape(n, -1) @ second_responses.reshape(n, -1).T


def _delayed_responses(path_equations: RoadInPath, axle_index: int, distance_behind: np.ndarray) -> np.ndarray:
    """State responses (n, q, k) of a vehicle at rest to noise that an axle met long ago, at a distance
    ``distance_behind`` (m) its position.
    """
    F, G = path_equations.excitation.F, path_equations.excitation.G
    road = np.array([expm(F * distance) @ G for distance in distance_behind]).reshape(-1, *G.shape)
    n, axles, m = path_equations.noise_inputs.shape
    if not len(distance_behind):
        return np.zeros((n + axles * m, 0, G.shape[1]))  # of a vehicle that may know no rest
    initial_states = np.zeros((axles * m, len(distance_behind), G.shape[1]))
    initial_states[axle_index * m : (axle_index + 1) * m] = road.transpose(1, 0, 2)
    return np.tensordot(_state_at_rest(path_equations), initial_states, 1)


def _state_at_rest(path_equations: RoadInPath) -> np.ndarray:
    """Matrix (n + a m, a m) from the road's filter states f to the state (y, f) of a vehicle at rest."""
    if np.linalg.cond(path_equations.A) > 1.0 / (1e3 * np.finfo(float).eps):
        raise InputError(
            "",
            "drive.speed.0",
            0.0,
            "must be above 0: this vehicle has a motion that nothing pulls "
            "back, so it knows no state of rest to begin in",
        )
    inputs = path_equations.noise_inputs.reshape(len(path_equations.A), -1)
    return np.vstack([-np.linalg.solve(path_equations.A, inputs), np.eye(inputs.shape[1])])


def _standing_covariance(path_equations: RoadInPath) -> np.ndarray:
    """Covariance of the state (y, f) of a vehicle that stands still, at rest."""
    road = path_equations.excitation
    stationary, m = solve_continuous_lyapunov(road.F, -road.G @ road.G.T), len(road.F)
    axles = range(len(road.heights))
    P = np.zeros((len(axles), m, len(axles), m))
    for i in axles:
        for j in axles[i:]:
            if i == j or not road.independent:
                P[i, :, j] = expm(road.F * (road.lengths[j] - road.lengths[i])) @ stationary
                P[j, :, i] = P[i, :, j].T
    rest_response = _state_at_rest(path_equations)
    return rest_response @ P.reshape(rest_response.shape[1], -1) @ rest_response.T


def _all_variances(path_equations: RoadInPath, P: np.ndarray, speed: float, status: Sequence[str]) -> np.ndarray:
    """Variances of all outputs and of the road's height under each wheel."""
    n, C = len(path_equations.A), path_equations.C + speed * path_equations.C_per_speed
    H = np.hstack(path_equations.excitation.heights)
    variance = ((C @ P) * C).sum(axis=1)
    lost = [state == DIFFUSING or (state == INFINITE and speed > 0.0) for state in status]
    height = ((H @ P[n:, n:]) * H).sum(axis=1)
    return np.concatenate([np.where(lost, np.inf, np.maximum(variance, 0.0)), np.maximum(height, 0.0)])
