"""Equations of a vehicle in time on a road described over the path: the form of a ride system in which nothing depends
on the speed.

At speed v a road filter reads f' = v F f + sqrt(v) G w, and tyre damping lets the vehicle x see its rate as well:

    x' = A x + sum_i (R_i f_i + T_i f_i').

With y = x - sum_i T_i f_i the rate is gone, and with it the white noise and the speed:

    y' = A y + sum_i (R_i + A T_i) f_i,    f_i(t) = f(s(t) - L_i).

Only s(t) still knows how fast the vehicle drives. At standstill s stays, f stays, and y goes on to its rest.
``DriveResponses`` say how this state moves within a step of a drive, and what it has of noise met within the step.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import expm

from models.ride.excited import DelayedSystem, vehicle_with_road
from models.ride.speed_profile import UNIT_POINTS, UNIT_WEIGHTS, SpeedProfile
from models.ride.weighting import system_with_weightings
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle


@dataclass(frozen=True)
class RoadInPath:
    """Equations of a vehicle on a road, with vehicle states y and road filter states f of each axle: y' = A y + sum_i
    N_i f_i, and outputs (C + v C_per_speed) (y, f) at speed v, plus possibly white noise from the road.

    A (n, n); noise_inputs (n, a, m) : N_i over axles and filter states; ``basis`` turns (y, f) into the states of
    ``vehicle_with_road``, weightings included; C, C_per_speed (p, n + a m).
    """

    A: np.ndarray
    noise_inputs: np.ndarray
    basis: np.ndarray
    C: np.ndarray
    C_per_speed: np.ndarray
    names: tuple[str, ...]
    excitation: RoadExcitation


def road_in_path(
    linear_vehicle: LinearVehicle, road_excitation: RoadExcitation, weightings: Mapping[str, str] | None = None
) -> RoadInPath:
    """``RoadInPath`` of a vehicle on a road, with weighted outputs as in ``system_with_weightings``; raises the errors
    of that function.

    A system is linear in v (its noise in sqrt(v)), so two speeds tell all.
    """
    at_1, at_2 = (system_at_speed(linear_vehicle, road_excitation, v, weightings) for v in (1.0, 2.0))
    first, (m, axles) = 2 * len(linear_vehicle.mass), (len(road_excitation.F), len(road_excitation.heights))
    road = np.arange(first, first + axles * m)
    other_states = np.setdiff1d(np.arange(len(at_1.A)), road)
    steady, by_speed = 2.0 * at_1.A - at_2.A, at_2.A - at_1.A
    A = steady[np.ix_(other_states, other_states)]
    known = np.linalg.pinv(np.hstack([road_excitation.F, road_excitation.G]))
    T = np.hstack(
        [
            np.hstack([by_speed[np.ix_(other_states, filter_states)], B[other_states]]) @ known
            for filter_states, B in zip(road.reshape(axles, m), at_1.B, strict=True)
        ]
    )
    basis = np.zeros_like(at_1.A)
    basis[other_states, : len(other_states)], basis[road, len(other_states) :] = (
        np.eye(len(other_states)),
        np.eye(len(road)),
    )
    basis[np.ix_(other_states, np.arange(len(other_states), len(basis)))] = T
    inputs = steady[np.ix_(other_states, road)] + A @ T
    return RoadInPath(
        A,
        inputs.reshape(-1, axles, m),
        basis,
        (2.0 * at_1.C - at_2.C) @ basis,
        (at_2.C - at_1.C) @ basis,
        at_1.names,
        road_excitation,
    )


def system_at_speed(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    weightings: Mapping[str, str] | None = None,
) -> DelayedSystem:
    """State-space model of the vehicle on its road at a constant speed (m/s, above 0), with weighted outputs."""
    return system_with_weightings(vehicle_with_road(linear_vehicle, road_excitation, speed), weightings or {})


SERIES_TERMS = 24
"""Count of terms of exponential series within a step, where rate times time is about 1: 1.5^24 / 24! = 3e-20."""


class DriveResponses:
    """Transition matrices of the state (y, f) along a drive with varying speed, exact in time and in path.

    Between the points of the profile only: on a step the path must be a polynomial of time.
    """

    def __init__(self, path_equations: RoadInPath, speed_profile: SpeedProfile) -> None:
        F, G = path_equations.excitation.F, path_equations.excitation.G
        self.form, self.profile, self.path = path_equations, speed_profile, speed_profile.path
        self.n, self.axles, self.m = path_equations.noise_inputs.shape
        self.decay, self.noise = exponential_series(F, np.eye(self.m)), exponential_series(F, G)
        self.motion = [
            exponential_series(path_equations.A, path_equations.noise_inputs[:, axle]) for axle in range(self.axles)
        ]
        self.of_length = lru_cache(maxsize=64)(self._step_matrices)

    def transition(self, start_time: float, end_time: float) -> np.ndarray:
        """Transition matrix E (n + a m, n + a m) of the state (y, f) over a step from start to end time (s)."""
        motion, inputs = self.of_length(round(end_time - start_time, 14))
        driven = self.path(start_time + (end_time - start_time) * np.append(UNIT_POINTS, 1.0)) - self.path(start_time)
        decay = (taylor_terms(driven, SERIES_TERMS) @ self.decay).reshape(-1, self.m)
        E = np.zeros((self.n + self.axles * self.m,) * 2)
        E[: self.n, : self.n] = motion
        E[: self.n, self.n :] = (inputs @ decay[: -self.m]).reshape(self.n, -1)
        for first in range(self.n, len(E), self.m):
            E[first : first + self.m, first : first + self.m] = decay[-self.m :]
        return E

    def _step_matrices(self, step_duration: float) -> tuple[np.ndarray, np.ndarray]:
        """Matrix exponential e^(A h) over a step of length h (s), and the effect of inputs at the points of the step
        through e^(A (h - u)): (n a, g m)."""
        left = np.stack([expm(self.form.A * step_duration * (1.0 - point)) for point in UNIT_POINTS])
        inputs = np.einsum("g,gij,jam->iagm", UNIT_WEIGHTS * step_duration, left, self.form.noise_inputs, optimize=True)
        return expm(self.form.A * step_duration), inputs.reshape(self.n * self.axles, -1)

    def noise_responses(self, axle_index: int, meeting_times: np.ndarray, end_time: np.ndarray) -> np.ndarray:
        """States (n + a m, L, k) at ``end_time`` (L,) after a unit of noise that the axle has met at ``meeting_times``
        (L,), in s.

        Each pair of times lies in one step.
        """
        left = (end_time - meeting_times)[:, None]
        driven = self.path(meeting_times[:, None] + left * UNIT_POINTS) - self.path(meeting_times)[:, None]
        k = self.noise.shape[1] // self.m
        road = (taylor_terms(driven, SERIES_TERMS) @ self.noise) * (left * UNIT_WEIGHTS)[..., None]
        weighted = np.swapaxes(taylor_terms(left * (1.0 - UNIT_POINTS), SERIES_TERMS), 1, 2) @ road
        responses = np.zeros((self.n + self.axles * self.m, len(meeting_times), k))
        columns = weighted.reshape(-1, SERIES_TERMS, self.m, k).transpose(1, 2, 0, 3).reshape(SERIES_TERMS * self.m, -1)
        motion = self.motion[axle_index].reshape(SERIES_TERMS, self.n, self.m).transpose(1, 0, 2).reshape(self.n, -1)
        responses[: self.n] = (motion @ columns).reshape(self.n, -1, k)
        filter_states = taylor_terms(self.path(end_time) - self.path(meeting_times), SERIES_TERMS) @ self.noise
        rows = slice(self.n + axle_index * self.m, self.n + (axle_index + 1) * self.m)
        responses[rows] = filter_states.reshape(-1, self.m, k).transpose(1, 0, 2)
        return responses


def exponential_series(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Matrices A^j B, flattened, in row j, such that e^(A t) B = powers(t) @ series."""
    rows = [B]
    for _ in range(SERIES_TERMS - 1):
        rows.append(A @ rows[-1])
    return np.stack([row.ravel() for row in rows])


def taylor_terms(t: np.ndarray, term_count: int) -> np.ndarray:
    """Terms t^j / j! along a new last axis, for j = 0 to ``term_count`` - 1."""
    terms = np.ones((*np.shape(t), term_count))
    terms[..., 1:] = np.asarray(t)[..., None] / np.arange(1, term_count)
    return np.cumprod(terms, axis=-1, out=terms)
