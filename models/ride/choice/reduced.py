"""A scene less some effects as a system x' = A x + B w, with the way from its state to that of the whole scene.

Rigid springs and locked freedoms leave q = N r with fewer coordinates r. Where bodies have no mass, r splits into a
that is inert, b that only dampers hold back (a state each) and e that only springs hold (no state):

    M a'' + (D q' + K q)_a = (R z + S z')_a,   (D q' + K q)_b = (R z + S z')_b,   (K q)_e = (R z)_e.

Nothing is taken to a limit with large numbers, so that singular changes are as exact as any other.
"""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import block_diag, null_space

from models.errors import InputError
from models.ride.choice.held import Held
from models.ride.delayed_system import DelayedSystem
from models.ride.excitation import Excitation
from models.ride.linear_vehicle import LinearVehicle
from models.ride.weighting import weighted
from models.scene_effects import tables_of
from models.vehicles.kinematics import Kinematics
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, mass

NOTHING = 1e-10
"""Share of the largest inertia, damping or stiffness, scaled to a unit diagonal, below which there is none."""


@dataclass(frozen=True)
class Reduced:
    """``vehicle`` M, D, K in what coordinates are left (M may be singular), N (n, r) to those of the whole vehicle,
    ``excitation`` and ``system``; T (n, x) from its state to (q, q', f, weightings) of the whole, ``left`` (x, n) a way
    back that keeps momentum; ``states`` of vehicle and road, before those of the weightings."""

    vehicle: LinearVehicle
    N: np.ndarray
    excitation: Excitation
    system: DelayedSystem
    T: np.ndarray
    left: np.ndarray
    states: int


@dataclass(frozen=True)
class Unweighted:
    """``Reduced`` before weightings."""

    vehicle: LinearVehicle
    N: np.ndarray
    excitation: Excitation
    system: DelayedSystem
    T: np.ndarray
    left: np.ndarray


class Whole:
    """A scene with all its effects at a speed (m/s), from which systems without some of them are made."""

    def __init__(self, held: Held, speed: float) -> None:
        self.held, self.speed = held, speed
        self.linear = linearise(held.vehicle, speed)
        self.excitation = held.excitation()
        self._made: dict[Hashable, Unweighted] = {}
        self._roads: dict[Hashable, tuple[Excitation, np.ndarray, np.ndarray]] = {}
        self.full = self.reduced(held)

    def reduced(self, held: Held) -> Reduced:
        """What is left of the scene; raises InputError where it is no system."""
        rest = self._unweighted(held)
        system, T, left = rest.system, rest.T, rest.left
        states, weightings = len(system.A), self.held.scene.weighting
        if weightings:
            system = weighted(system, weightings)
            more = np.eye(len(system.A) - states)
            T, left = block_diag(T, more), block_diag(left, more)
        return Reduced(rest.vehicle, rest.N, rest.excitation, system, T, left, states)

    def _unweighted(self, held: Held) -> "Unweighted":
        """Made once."""
        key = (held.vehicle, *_road(held), held.massless, held.rigid, held.locked)
        if key not in self._made:
            self._made[key] = self._make(held)
        return self._made[key]

    def _make(self, held: Held) -> "Unweighted":
        constrained, N = constrain(held, self.speed)
        excitation, Tf, left_f = self._heights(held)
        system, Tq, back = first_order(constrained, excitation, self.speed)
        behind = np.linalg.solve(N.T @ self.linear.mass @ N, N.T @ self.linear.mass)
        n, m, x = len(self.linear.mass), len(Tf), len(system.A)
        if x == Tf.shape[1]:
            raise InputError("", "effects", None, "nothing is left that could move")
        q = N @ Tq
        f = np.hstack([np.zeros((m, x - Tf.shape[1])), Tf])
        left = np.zeros((x, 2 * n + m))
        inert = len(back[0])
        left[:inert, :n], left[inert : 2 * inert, n : 2 * n] = back[0] @ behind, back[0] @ behind
        left[2 * inert : x - Tf.shape[1], :n] = back[1] @ behind
        left[x - Tf.shape[1] :, 2 * n :] = left_f
        return Unweighted(constrained, N, excitation, system, np.vstack([q, q @ system.A, f]), left)

    def _heights(self, held: Held) -> tuple[Excitation, np.ndarray, np.ndarray]:
        """The road that is left, and ``_of_road`` of it."""
        key = _road(held)
        if key not in self._roads:
            excitation = held.excitation()
            self._roads[key] = (excitation, *_of_road(self.held, self.excitation, held, excitation))
        return self._roads[key]


def _road(held: Held) -> tuple[Hashable, ...]:
    """What tells one road of a scene less some effects from another."""
    return held.scene.road, tuple(tables_of(held.scene))


def constrain(held: Held, speed: float) -> tuple[LinearVehicle, np.ndarray]:
    """M, D, K and outputs in the coordinates that rigid springs and locked freedoms leave, and N with q = N r."""
    vehicle = held.vehicle
    linear = _linear(vehicle, speed)
    M, N = _mass(vehicle, held.massless), _free(held)
    if not N.size:
        raise InputError("", "effects", None, "nothing is left that could move")
    outputs = tuple(replace(o, acceleration=o.acceleration @ N, rate=o.rate @ N, displacement=o.displacement @ N)
                    for o in linear.outputs)  # fmt: skip
    return replace(linear, mass=N.T @ M @ N, damping=N.T @ linear.damping @ N, stiffness=N.T @ linear.stiffness @ N,
                   road_stiffness=N.T @ linear.road_stiffness, road_damping=N.T @ linear.road_damping,
                   coordinates=tuple(("", str(i)) for i in range(N.shape[1])), outputs=outputs), N  # fmt: skip


@lru_cache(maxsize=64)
def _linear(vehicle: SpatialVehicle, speed: float) -> LinearVehicle:
    return linearise(vehicle, speed)


@lru_cache(maxsize=64)
def _mass(vehicle: SpatialVehicle, massless: frozenset[str]) -> np.ndarray:
    light = tuple(replace(body, mass=0.0, inertia=((0.0,) * 3,) * 3) if body.name in massless else body
                  for body in vehicle.bodies)  # fmt: skip
    return mass(replace(vehicle, bodies=light))


@lru_cache(maxsize=64)
def _travels(vehicle: SpatialVehicle) -> dict[str, np.ndarray]:
    """Row (n,) of every spring's travel."""
    motion = Kinematics(vehicle)
    return {s.name: np.array(s.axis) @ (motion.shift(s.two, s.point_two) - motion.shift(s.one, s.point_one))
            for s in vehicle.springs}  # fmt: skip


def _free(held: Held) -> np.ndarray:
    """N (n, r): single coordinates where nothing but locks holds them, else a basis of what the rigid springs leave."""
    coordinates = held.vehicle.coordinates()
    kept = np.eye(len(coordinates))[:, [c not in held.locked for c in coordinates]]
    rows = np.array([row @ kept for name, row in _travels(held.vehicle).items() if name in held.rigid])
    return kept @ null_space(rows, rcond=NOTHING) if len(rows) else kept


def first_order(
    vehicle: LinearVehicle, excitation: Excitation, speed: float
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
    B = tuple(np.vstack([np.zeros((a, k)), _solved(inert, Y.T @ (d - pull @ s)), s, w])
              for d, s, w in zip(direct, slow_noise, noise, strict=True))  # fmt: skip
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


def _outputs(vehicle: LinearVehicle, q: np.ndarray, A: np.ndarray, B: tuple[np.ndarray, ...], z: np.ndarray,
             rate: np.ndarray, noise: list[np.ndarray]) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:  # fmt: skip
    """C (p, x) and D (p, k) per axle, without rounding; what would see the derivative of white noise has infinite D."""
    of = {key: np.array([getattr(output, key) for output in vehicle.outputs]) for key in
          ("acceleration", "rate", "displacement", "road", "road_rate")}  # fmt: skip
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


def _of_road(full: Held, whole: Excitation, held: Held, rest: Excitation) -> tuple[np.ndarray, np.ndarray]:
    """States of the whole road's filters by those that are left, axle by axle, and back; what effects add is last."""
    count, cutoff = whole.G.shape[1], full.scene.road.cutoff
    one: np.ndarray = np.eye(count if cutoff is None else 2 * count)
    back: np.ndarray = one
    if cutoff is not None and held.scene.road.cutoff is None:
        one, back = np.kron(np.eye(count), [[1.0], [0.0]]), np.kron(np.eye(count), [[1.0, 1.0 / cutoff]])
    added = np.eye(len(whole.F) - len(one), len(rest.F) - len(back))
    one, back = block_diag(one, added), block_diag(back, added.T)
    axles, left = len(whole.heights), len(rest.heights)
    if left == axles:
        return np.kron(np.eye(axles), one), np.kron(np.eye(axles), back)
    return np.kron(np.ones((axles, 1)), one), np.kron(np.eye(axles)[:1], back)
