"""State-space model of a linear vehicle behind its road filters at a constant speed: x' = A x + sum_i B_i w(t - tau_i),
excited by delayed white noise w.

The axles meet the same white noise w one after the other. Some of the bodies may have no mass: with r the coordinates,
a combinations of them that are inert, b that only dampers hold back (a state each) and e that only springs hold (no
state),

    M a'' + (D q' + K q)_a = (R z + S z')_a,   (D q' + K q)_b = (R z + S z')_b,   (K q)_e = (R z)_e.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle, OutputRows


@dataclass(frozen=True)
class DelayedSystem:
    """Linear system excited by delayed white noise w of unit intensity with k channels; its outputs are y = C x + sum_i
    D_i w(t - tau_i).

    A (n, n); B, one (n, k) per axle; delays tau_i in s, the first 0, none falling; C (p, n); D, one (p, k) per axle.
    ``independent`` axles meet noises that know nothing of one another; the delays then have no meaning.
    """

    A: np.ndarray
    B: tuple[np.ndarray, ...]
    delays: tuple[float, ...]
    C: np.ndarray
    D: tuple[np.ndarray, ...]
    names: tuple[str, ...]
    independent: bool = False


def vehicle_with_road(linear_vehicle: LinearVehicle, road_excitation: RoadExcitation, speed: float) -> DelayedSystem:
    """State-space model of a vehicle with its road filters, at a constant speed (m/s, above 0).

    State (q, q', f of each axle). In time a filter reads f' = v F f + sqrt(v) G w; the height's rate is
    z' = H f', white noise in part where the filter is of first order: it reaches the wheels through tyre damping.
    Of bodies without mass fewer states are left. Raises InputError for a speed that is none.
    """
    if not 0.0 < speed < math.inf:
        raise InputError("", "speed", speed, "must be above 0, in m/s: at standstill no noise arrives")
    if has_singular_mass(linear_vehicle.mass):
        return first_order_system(linear_vehicle, vehicle_states(linear_vehicle), road_excitation, speed)[0]
    n, (m, k), axles = len(linear_vehicle.mass), road_excitation.G.shape, len(road_excitation.heights)
    by_motion = np.linalg.solve(linear_vehicle.mass, np.hstack([-linear_vehicle.stiffness, -linear_vehicle.damping]))
    by_road = np.linalg.solve(
        linear_vehicle.mass, np.hstack([linear_vehicle.road_stiffness, linear_vehicle.road_damping])
    )
    by_height, by_rate = np.split(by_road, 2, axis=1)
    read, root = linear_vehicle.read, speed**0.5
    A = np.zeros((2 * n + axles * m,) * 2)
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, : 2 * n] = by_motion
    filters = [slice(first, first + m) for first in range(2 * n, len(A), m)]
    B = [np.zeros((len(A), k)) for _ in range(axles)]
    for filter_slice, H, noise in zip(filters, road_excitation.heights, B, strict=True):
        A[n : 2 * n, filter_slice] = by_height @ H + by_rate @ H @ road_excitation.F * speed
        A[filter_slice, filter_slice] = speed * road_excitation.F
        noise[n : 2 * n] = root * by_rate @ H @ road_excitation.G
        noise[filter_slice] = root * road_excitation.G
    C = read.acceleration_factors @ A[n : 2 * n]
    C[:, :n] += read.displacement_factors
    C[:, n : 2 * n] += read.rate_factors
    D = []
    for filter_slice, H, noise in zip(filters, road_excitation.heights, B, strict=True):
        C[:, filter_slice] += read.road_factors @ H + speed * read.road_rate_factors @ H @ road_excitation.F
        D.append(read.acceleration_factors @ noise[n : 2 * n] + root * read.road_rate_factors @ H @ road_excitation.G)
    return _delayed_system_at_speed(linear_vehicle, road_excitation, speed, A, B, C, D)


def _delayed_system_at_speed(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    A: np.ndarray,
    B: Iterable[np.ndarray],
    C: np.ndarray,
    D: Iterable[np.ndarray],
) -> DelayedSystem:
    delays = tuple(length / speed for length in road_excitation.lengths)
    return DelayedSystem(A, tuple(B), delays, C, tuple(D), linear_vehicle.names, road_excitation.independent)


NEGLIGIBLE_SHARE = 1e-10
"""Share of the largest inertia, damping or stiffness, scaled to a unit diagonal, below which a motion has none."""


def has_singular_mass(mass: np.ndarray) -> bool:
    """Whether the mass matrix is singular: some motion involves no inertia."""
    return bool(_range_and_kernel(mass)[1].size)


@dataclass(frozen=True)
class VehicleStateForm:
    """State-space form of a vehicle under generalised forces g (n,): x' = A x + B g, coordinates q = Q x + direct g.

    The state is (a, a', b). A (x, x), B (x, n), Q (n, x); direct (n, n) is the compliance of what only springs hold.
    massless_part, integrated_part: matrices from q to a and from q to b.
    """

    A: np.ndarray
    B: np.ndarray
    Q: np.ndarray
    direct: np.ndarray
    massless_part: np.ndarray
    integrated_part: np.ndarray


def vehicle_states(linear_vehicle: LinearVehicle) -> VehicleStateForm:
    """``VehicleStateForm`` of a vehicle whose mass matrix may be singular. Raises InputError where a massless body has
    neither spring nor damper."""
    Y, Z = _range_and_kernel(linear_vehicle.mass)
    V, E = (Z @ basis for basis in _range_and_kernel(Z.T @ linear_vehicle.damping @ Z))
    n, a, b = len(linear_vehicle.mass), Y.shape[1], V.shape[1]
    q_a, v_a, q_b = np.split(np.eye(2 * a + b), [a, 2 * a])
    q, direct = Y @ q_a + V @ q_b, np.zeros((n, n))
    if E.shape[1]:
        elastic = E.T @ linear_vehicle.stiffness
        direct = E @ _solved_for(elastic @ E, E.T)
        q = q - direct @ (linear_vehicle.stiffness @ q)
    # forces by the state and by g, on what is inert and on what dampers hold back
    force = np.hstack(
        [
            -linear_vehicle.stiffness @ q - linear_vehicle.damping @ Y @ v_a,
            np.eye(n) - linear_vehicle.stiffness @ direct,
        ]
    )
    slow = _solved_for(V.T @ linear_vehicle.damping @ V, V.T @ force)
    inert = _solved_for(Y.T @ linear_vehicle.mass @ Y, Y.T @ (force - linear_vehicle.damping @ V @ slow))
    A, B = np.split(np.vstack([np.hstack([v_a, np.zeros((a, n))]), inert, slow]), [2 * a + b], axis=1)
    back = np.linalg.inv(np.hstack([Y, V, E]))
    return VehicleStateForm(A, B, q, direct, back[:a], back[a : a + b])


def first_order_system(
    linear_vehicle: LinearVehicle, vehicle_form: VehicleStateForm, road_excitation: RoadExcitation, speed: float
) -> tuple[DelayedSystem, np.ndarray]:
    """State-space model with the state (a, a', b, f) of a vehicle whose mass matrix may be singular, and the matrix (n,
    x) from this state to the vehicle's coordinates.

    C and D are without rounding; what would see the derivative of white noise has infinite D.
    """
    x, heights, axles = len(vehicle_form.A), np.hstack(road_excitation.heights), len(road_excitation.heights)
    m, k = road_excitation.G.shape
    path, noise_inputs = np.zeros((axles * m,) * 2), np.zeros((axles, axles * m, k))
    for i in range(axles):
        filter_slice = slice(i * m, (i + 1) * m)
        path[filter_slice, filter_slice], noise_inputs[i, filter_slice] = (
            speed * road_excitation.F,
            speed**0.5 * road_excitation.G,
        )
    stiff, rate = linear_vehicle.road_stiffness @ heights, heights @ path
    by_rate = vehicle_form.B @ linear_vehicle.road_damping
    A = np.zeros((x + axles * m,) * 2)
    A[:x, :x], A[x:, x:] = vehicle_form.A, path
    A[:x, x:] = vehicle_form.B @ stiff + by_rate @ rate
    noise = heights @ noise_inputs
    B = np.concatenate([by_rate @ noise, noise_inputs], axis=1)
    q, read = np.hstack([vehicle_form.Q, vehicle_form.direct @ stiff]), linear_vehicle.read
    v = q @ A
    C = read.displacement_factors @ q + read.rate_factors @ v + read.acceleration_factors @ v @ A
    C[:, x:] += read.road_factors @ heights + read.road_rate_factors @ rate
    return _delayed_system_at_speed(
        linear_vehicle, road_excitation, speed, A, B, C, _direct_transmission(read, q, v, B, noise)
    ), q


def _direct_transmission(
    output_rows: OutputRows, q: np.ndarray, v: np.ndarray, B: np.ndarray, road_rate_noise: np.ndarray
) -> np.ndarray:
    """Direct transmission D (axles, p, k) of white noise to the outputs, through q and q' of the state, through B, and
    through noise in the rates of the road's heights."""
    transmission = (
        output_rows.rate_factors @ q @ B
        + output_rows.acceleration_factors @ v @ B
        + output_rows.road_rate_factors @ road_rate_noise
    )
    size = abs(output_rows.rate_factors) @ abs(q) @ abs(B) + abs(output_rows.acceleration_factors) @ abs(v) @ abs(B)
    is_certain = abs(transmission) > NEGLIGIBLE_SHARE * (
        size + abs(output_rows.road_rate_factors) @ abs(road_rate_noise)
    )
    worse = abs(output_rows.acceleration_factors @ (q @ B)) > NEGLIGIBLE_SHARE * (
        abs(output_rows.acceleration_factors) @ abs(q) @ abs(B)
    )
    return np.where(worse, np.inf, np.where(is_certain, transmission, 0.0))


def _solved_for(matrix: np.ndarray, right_side: np.ndarray) -> np.ndarray:
    """Solution X of matrix X = right_side. Raises InputError where a massless body has neither spring nor damper."""
    if not len(matrix):
        return right_side
    if np.linalg.cond(matrix) > 1 / NEGLIGIBLE_SHARE:
        raise InputError("", "effects", None, "a massless body has no spring or damper that holds it")
    return np.linalg.solve(matrix, right_side)


def _range_and_kernel(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bases of the range and of the null space of a symmetric matrix; single coordinates where it is diagonal."""
    if not len(matrix):
        return matrix, matrix
    scale = np.sqrt(np.where(matrix.diagonal() > 0, matrix.diagonal(), 1.0))
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2 / np.outer(scale, scale))
    if values[0] > NEGLIGIBLE_SHARE:
        return np.eye(len(matrix)), np.zeros((len(matrix), 0))
    on = values > NEGLIGIBLE_SHARE
    return vectors[:, on] / scale[:, None], vectors[:, ~on] / scale[:, None]
