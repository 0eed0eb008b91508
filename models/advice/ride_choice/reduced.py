"""A scene less some effects as a system x' = A x + B w, with the way from its state to that of the whole scene.

What rigid springs, locked freedoms and bodies without mass leave of the vehicle is said in
``models.vehicles.limits`` and ``models.ride.massless``.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import block_diag

from models.core.errors import InputError
from models.core.scene_effects import tables_of
from models.ride.delayed_system import DelayedSystem
from models.ride.massless import first_order
from models.ride.weighting import weighted
from models.road.excitation import Excitation
from models.systems.ride.reduced_scene import Held
from models.vehicles.limits import limited
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise


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
    return limited(_linear(held.vehicle, speed), held.vehicle, held.limits)


@lru_cache(maxsize=64)
def _linear(vehicle: SpatialVehicle, speed: float) -> LinearVehicle:
    return linearise(vehicle, speed)


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
