"""A scene less some effects as a system x' = A x + B w, with the way from its state to that of the whole scene.

What rigid springs, locked freedoms and bodies without mass leave of the vehicle is said in
``models.vehicles.spatial.Limits`` and ``models.ride.excited``.
"""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import block_diag

from models.core.errors import InputError
from models.core.scene_effects import tables_of
from models.ride.excited import DelayedSystem, first_order
from models.ride.weighting import weighted
from models.road.excitation import Excitation
from models.systems.ride.reduced_scene import ReducedScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import limited, linearise


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


class FullScene:
    """A scene with all its effects at a speed (m/s), from which systems without some of them are made."""

    def __init__(self, scene: ReducedScene, speed: float) -> None:
        self.scene, self.speed = scene, speed
        self.linear = linearise(scene.vehicle, speed)
        self.excitation = scene.excitation()
        self._made: dict[Hashable, Reduced] = {}
        self._roads: dict[Hashable, tuple[Excitation, np.ndarray, np.ndarray]] = {}
        self.full = self.reduced(scene)

    def reduced(self, scene: ReducedScene) -> Reduced:
        """The scene without the effects; raises InputError where what remains has no equations of motion."""
        key = (scene.vehicle, *_road(scene), scene.massless, scene.rigid, scene.locked)
        if key not in self._made:
            self._made[key] = self._make(scene)
        rest, weightings = self._made[key], self.scene.ride.weighting
        if not weightings:
            return rest
        system = weighted(rest.system, weightings)
        more = np.eye(len(system.A) - rest.states)
        return replace(rest, system=system, T=block_diag(rest.T, more), left=block_diag(rest.left, more))

    def _make(self, scene: ReducedScene) -> Reduced:
        """The reduced system before the outputs are weighted."""
        constrained, N = constrain(scene, self.speed)
        excitation, Tf, left_f = self._heights(scene)
        system, Tq, back = first_order(constrained, excitation, self.speed)
        behind = np.linalg.solve(N.T @ self.linear.mass @ N, N.T @ self.linear.mass)
        n, m, x = len(self.linear.mass), len(Tf), len(system.A)
        inert, road = len(back[0]), x - Tf.shape[1]
        if not road:
            raise InputError("", "effects", None, "nothing is left that could move")
        q, f = N @ Tq, np.hstack([np.zeros((m, road)), Tf])
        left = np.zeros((x, 2 * n + m))
        left[:inert, :n], left[inert : 2 * inert, n : 2 * n] = back[0] @ behind, back[0] @ behind
        left[2 * inert : road, :n], left[road:, 2 * n :] = back[1] @ behind, left_f
        return Reduced(constrained, N, excitation, system, np.vstack([q, q @ system.A, f]), left, x)

    def _heights(self, scene: ReducedScene) -> tuple[Excitation, np.ndarray, np.ndarray]:
        """The reduced scene's road, and its relation to the whole road by ``_of_road``."""
        key = _road(scene)
        if key not in self._roads:
            excitation = scene.excitation()
            self._roads[key] = (excitation, *_of_road(self.scene, self.excitation, scene, excitation))
        return self._roads[key]


def _road(scene: ReducedScene) -> tuple[Hashable, ...]:
    """Key that is equal for reduced scenes with the same road."""
    return scene.ride.road, tuple(tables_of(scene.ride))


def constrain(scene: ReducedScene, speed: float) -> tuple[LinearVehicle, np.ndarray]:
    """M, D, K and outputs in the coordinates that rigid springs and locked freedoms leave, and N with q = N r."""
    return limited(_linear(scene.vehicle, speed), scene.vehicle, scene.limits)


@lru_cache(maxsize=64)
def _linear(vehicle: SpatialVehicle, speed: float) -> LinearVehicle:
    return linearise(vehicle, speed)


def _of_road(
    scene: ReducedScene, full: Excitation, less: ReducedScene, reduced: Excitation
) -> tuple[np.ndarray, np.ndarray]:
    """States of the whole road's filters by those that are left, axle by axle, and back; what effects add is last."""
    count, cutoff = full.G.shape[1], scene.ride.road.cutoff
    onto: np.ndarray = np.eye(count if cutoff is None else 2 * count)
    back: np.ndarray = onto
    if cutoff is not None and less.ride.road.cutoff is None:
        onto, back = np.kron(np.eye(count), [[1.0], [0.0]]), np.kron(np.eye(count), [[1.0, 1.0 / cutoff]])
    added = np.eye(len(full.F) - len(onto), len(reduced.F) - len(back))
    onto, back = block_diag(onto, added), block_diag(back, added.T)
    axles = len(full.heights)
    if len(reduced.heights) == axles:
        return np.kron(np.eye(axles), onto), np.kron(np.eye(axles), back)
    return np.kron(np.ones((axles, 1)), onto), np.kron(np.eye(axles)[:1], back)
