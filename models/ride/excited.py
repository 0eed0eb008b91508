"""A linear vehicle behind its road filters at a constant speed, as a system of first order with delays."""

import math

import numpy as np

from models.core.errors import InputError
from models.ride.delayed_system import DelayedSystem
from models.ride.massless import first_order, singular
from models.road.excitation import Excitation
from models.vehicles.linear_vehicle import LinearVehicle


def excited(vehicle: LinearVehicle, excitation: Excitation, speed: float) -> DelayedSystem:
    """The vehicle behind its road filters at a constant speed (m/s, above 0).

    State (q, q', f of each axle). In time a filter reads f' = v F f + sqrt(v) G w; the height's rate is
    z' = H f', white noise in part where the filter is of first order: it reaches the wheels through tyre damping.
    Of bodies without mass fewer states are left. Raises InputError for a speed that is none.
    """
    if not 0.0 < speed < math.inf:
        raise InputError("", "speed", speed, "must be above 0, in m/s: at standstill no noise arrives")
    if singular(vehicle.mass):
        return first_order(vehicle, excitation, speed)[0]
    n, axles = len(vehicle.mass), len(excitation.heights)
    m, k = excitation.G.shape
    size = 2 * n + axles * m
    own = np.linalg.solve(vehicle.mass, np.hstack([-vehicle.stiffness, -vehicle.damping]))
    forced = np.linalg.solve(vehicle.mass, np.hstack([vehicle.road_stiffness, vehicle.road_damping]))
    by_height, by_rate = np.split(forced, 2, axis=1)
    A = np.zeros((size, size))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, : 2 * n] = own
    B = []
    for i, H in enumerate(excitation.heights):
        at = slice(2 * n + i * m, 2 * n + (i + 1) * m)
        A[n : 2 * n, at] = by_height @ H + by_rate @ H @ excitation.F * speed
        A[at, at] = speed * excitation.F
        noise = np.zeros((size, k))
        noise[n : 2 * n] = speed**0.5 * by_rate @ H @ excitation.G
        noise[at] = speed**0.5 * excitation.G
        B.append(noise)
    C, D = _outputs(vehicle, excitation, speed, A, B)
    delays = tuple(length / speed for length in excitation.lengths)
    names = tuple(output.name for output in vehicle.outputs)
    return DelayedSystem(A, tuple(B), delays, C, D, names, excitation.independent)


def _outputs(
    vehicle: LinearVehicle, excitation: Excitation, speed: float, A: np.ndarray, B: list[np.ndarray]
) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """C (p, n) and one D (p, k) per axle; what the noise reaches at once stands in D."""
    n = len(vehicle.mass)
    m = len(excitation.F)
    of = {
        key: np.array([getattr(output, key) for output in vehicle.outputs])
        for key in ("acceleration", "rate", "displacement", "road", "road_rate")
    }
    C = of["acceleration"] @ A[n : 2 * n]
    C[:, :n] += of["displacement"]
    C[:, n : 2 * n] += of["rate"]
    D = []
    for i, H in enumerate(excitation.heights):
        at = slice(2 * n + i * m, 2 * n + (i + 1) * m)
        C[:, at] += of["road"] @ H + speed * of["road_rate"] @ H @ excitation.F
        D.append(of["acceleration"] @ B[i][n : 2 * n] + speed**0.5 * of["road_rate"] @ H @ excitation.G)
    return C, tuple(D)
