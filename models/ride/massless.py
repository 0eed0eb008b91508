"""A linear vehicle some of whose bodies have no mass, as a system x' = A x + B w of first order.

With r its coordinates, a combinations of them that are inert, b that only dampers hold back (a state each) and e that
only springs hold (no state):

    M a'' + (D q' + K q)_a = (R z + S z')_a,   (D q' + K q)_b = (R z + S z')_b,   (K q)_e = (R z)_e.
"""

from typing import TYPE_CHECKING

import numpy as np

from models.core.errors import InputError
from models.ride.delayed_system import DelayedSystem
from models.vehicles.linear_vehicle import LinearVehicle

if TYPE_CHECKING:
    from models.road.excitation import Excitation

NOTHING = 1e-10
"""Share of the largest inertia, damping or stiffness, scaled to a unit diagonal, below which there is none."""


def singular(mass: np.ndarray) -> bool:
    """Whether nothing inert moves with some motion."""
    return bool(_split(mass)[1].size)


def first_order(
    vehicle: LinearVehicle, excitation: "Excitation", speed: float
) -> tuple[DelayedSystem, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """The system with state (a, a', b, f), r by its state (n, x), and a and b by r; the mass may be singular."""
    Y, Z = _split(vehicle.mass)
    V, E = (Z @ part for part in _split(Z.T @ vehicle.damping @ Z))
    heights = np.hstack(excitation.heights)
    a, b, k, axles = Y.shape[1], V.shape[1], excitation.G.shape[1], len(excitation.heights)
    m = heights.shape[1]
    x = 2 * a + b + m
    state = np.eye(x)
    q_a, v_a, q_b, f = np.split(state, [a, 2 * a, 2 * a + b])
    path = speed * np.kron(np.eye(axles), excitation.F)
    z, rate = heights @ f, heights @ path @ f
    noise = [speed**0.5 * np.kron(np.eye(axles)[:, [i]], excitation.G) for i in range(axles)]
    q = Y @ q_a + V @ q_b
    if E.shape[1]:
        held = E.T @ vehicle.stiffness
        q = q + E @ _solved(held @ E, E.T @ vehicle.road_stiffness @ z - held @ q)
    force: np.ndarray = vehicle.road_stiffness @ z + vehicle.road_damping @ rate - vehicle.stiffness @ q
    direct = [vehicle.road_damping @ heights @ each for each in noise]
    force = force - vehicle.damping @ Y @ v_a
    damped = V.T @ vehicle.damping @ V
    slow, slow_noise = _solved(damped, V.T @ force), [_solved(damped, V.T @ each) for each in direct]
    pull = vehicle.damping @ V
    inert = Y.T @ vehicle.mass @ Y
    A = np.vstack([v_a, _solved(inert, Y.T @ (force - pull @ slow)), slow, path @ f])
    B = tuple(
        np.vstack([np.zeros((a, k)), _solved(inert, Y.T @ (d - pull @ s)), s, w])
        for d, s, w in zip(direct, slow_noise, noise, strict=True)
    )
    back = np.linalg.inv(np.hstack([Y, V, E]))
    C, D = _outputs(vehicle, q, A, B, z, rate, [heights @ each for each in noise])
    names = tuple(output.name for output in vehicle.outputs)
    delays = tuple(length / speed for length in excitation.lengths)
    return DelayedSystem(A, B, delays, C, D, names, excitation.independent), q, (back[:a], back[a : a + b])


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """matrix^-1 right; InputError where nothing holds a body without mass."""
    if len(matrix) and np.linalg.cond(matrix) > 1 / NOTHING:
        raise InputError("", "effects", None, "nothing holds what is left without mass")
    return np.linalg.solve(matrix, right)


def _split(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bases of what a symmetric matrix acts on and of what it does not; single coordinates where it is diagonal."""
    scale = np.sqrt(np.where(matrix.diagonal() > 0, matrix.diagonal(), 1.0))
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2 / np.outer(scale, scale))
    if len(values) == 0 or values[0] > NOTHING:
        return np.eye(len(matrix)), np.zeros((len(matrix), 0))
    on = values > NOTHING
    return vectors[:, on] / scale[:, None], vectors[:, ~on] / scale[:, None]


def _outputs(
    vehicle: LinearVehicle,
    q: np.ndarray,
    A: np.ndarray,
    B: tuple[np.ndarray, ...],
    z: np.ndarray,
    rate: np.ndarray,
    noise: list[np.ndarray],
) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """C (p, x) and D (p, k) per axle, without rounding; what would see the derivative of white noise has infinite D."""
    of = {
        key: np.array([getattr(output, key) for output in vehicle.outputs])
        for key in ("acceleration", "rate", "displacement", "road", "road_rate")
    }
    v = q @ A
    C = of["displacement"] @ q + of["rate"] @ v + of["acceleration"] @ v @ A + of["road"] @ z + of["road_rate"] @ rate
    D = []
    for b, w in zip(B, noise, strict=True):
        direct = of["rate"] @ q @ b + of["acceleration"] @ v @ b + of["road_rate"] @ w
        size = abs(of["rate"]) @ abs(q) @ abs(b) + abs(of["acceleration"]) @ abs(v) @ abs(b)
        told = abs(direct) > NOTHING * (size + abs(of["road_rate"]) @ abs(w))
        worse = abs(of["acceleration"] @ (q @ b)) > NOTHING * (abs(of["acceleration"]) @ abs(q) @ abs(b))
        D.append(np.where(worse, np.inf, np.where(told, direct, 0.0)))
    return C, tuple(D)
