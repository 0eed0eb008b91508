"""A scene less some effects as a system x' = A x + B w, with the way from its state to that of the whole scene.

What rigid springs, locked freedoms and bodies without mass leave of the vehicle is said in
``models.vehicles.spatial.Limits`` and ``models.ride.excited``. The vehicle that is left is made once for all speeds and
roads, if it does not depend on the speed.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from models.advice.ride_choice.modes import Modes, behind_road, behind_weightings, modes_of, stable_step
from models.core.errors import InputError
from models.core.scene_effects import tables_of
from models.ride.covariance import noise_intensity_of_system
from models.ride.excited import DelayedSystem, VehicleStates, first_order_system, vehicle_states
from models.ride.weighting import system_with_weightings
from models.road.excitation import Excitation
from models.systems.ride.reduced_scene import ReducedScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, mass_matrix_without, reduced_vehicle, remaining_motions


@dataclass(frozen=True)
class ReducedVehicle:
    """A vehicle without some of its effects. linear : M, D, K in the remaining coordinates (M may be singular); N (n,
    r) : from these to the full vehicle's; states : of first order; residual_flexibility (r, n) : from the full
    coordinates back, keeping momentum.
    """

    linear: LinearVehicle
    N: np.ndarray
    states: VehicleStates
    residual_flexibility: np.ndarray

    @cached_property
    def modes(self) -> Modes | None:
        """Eigenmodes of the states; None where eigenvectors are nearly parallel."""
        return modes_of(self.states.A)

    @cached_property
    def stable_step(self) -> float:
        """Longest step (s) at which the classical Runge-Kutta method is stable; 0 for a mode that grows."""
        return stable_step(self.modes.rates if self.modes else np.linalg.eigvals(self.states.A))


@dataclass(frozen=True)
class Reduced:
    """A reduced vehicle, its road ``excitation``, and their ``system``. T (n, x) : from the reduced state to the full
    (q, q', f, weightings); left (x, n) : back, keeping momentum; states : number of those of vehicle and road, which
    precede those of the ``weightings`` (their names).
    """

    of_vehicle: ReducedVehicle
    excitation: Excitation
    system: DelayedSystem
    T: np.ndarray
    left: np.ndarray
    states: int
    weightings: tuple[str, ...] = ()

    @property
    def vehicle(self) -> LinearVehicle:
        """Matrices M, D, K of the reduced vehicle."""
        return self.of_vehicle.linear

    @cached_property
    def modes(self) -> Modes | None:
        """Eigenmodes of the system; None where eigenvectors are nearly parallel."""
        A, axles, m = self.system.A[: self.states, : self.states], len(self.excitation.heights), len(self.excitation.F)
        modes = behind_road(A, self.of_vehicle.modes, A[-m:, -m:], axles)
        return behind_weightings(self.system.A, modes, self.weightings) if self.weightings else modes

    @cached_property
    def noise(self) -> np.ndarray:
        """Covariance (x, x) per second that the noise of all axles adds."""
        return noise_intensity_of_system(self.system, self.modes.propagated if self.modes else None)


class Numbers:
    """Index numbers of values, the same for equal values. An object that was seen before is recognised by its identity,
    without a long hash.
    """

    def __init__(self) -> None:
        self._of_object: dict[int, tuple[object, int]] = {}
        self._of_value: dict[Hashable, int] = {}

    def of(self, known_object: object, value_of: Callable[[], Hashable]) -> int:
        """Number of an object's value. The object is kept, so that its identity remains unique."""
        known = self._of_object.get(id(known_object))
        if known is None:
            known = self._of_object[id(known_object)] = (
                known_object,
                self._of_value.setdefault(value_of(), len(self._of_value)),
            )
        return known[1]

    def of_parts(self, known_object: Any, *names: str) -> tuple[int, ...]:
        """Numbers of an object's attributes; copies of an object share most attributes."""
        parts = [getattr(known_object, name) for name in names]
        return tuple(self.of(attribute, partial(_hashable_key, attribute)) for attribute in parts)


def _hashable_key(any_value: Hashable) -> Hashable:
    return any_value


PARTS_OF_VEHICLE = tuple(field.name for field in fields(SpatialVehicle))
"""Attributes of a vehicle."""


class Roads:
    """Roads of reduced scenes, each made once for all speeds."""

    def __init__(self) -> None:
        self._numbers = Numbers()
        self._made: dict[int, Excitation] = {}

    def number(self, scene: ReducedScene) -> int:
        """Number that is the same for scenes with the same road: the same effects of the road, and the same tables that
        add to it.
        """
        ride = scene.ride
        return self._numbers.of(ride, lambda: (ride.road, *tables_of(ride)))

    def of(self, scene: ReducedScene) -> Excitation:
        """The road of a reduced scene, made when it is first requested."""
        number = self.number(scene)
        if number not in self._made:
            self._made[number] = scene.excitation()
        return self._made[number]


class Vehicles:
    """Reduced vehicles, each made once and kept for all choices that request it; ``roads`` : their roads."""

    def __init__(self, full_vehicle: SpatialVehicle, speed: float, roads: Roads | None = None) -> None:
        self.roads = roads or Roads()
        self._numbers = Numbers()
        self._made: dict[Hashable, ReducedVehicle] = {}
        self._linear: dict[Hashable, LinearVehicle] = {}
        self._masses: dict[Hashable, np.ndarray] = {}
        self._free: dict[Hashable, np.ndarray] = {}
        self.mass = self.linear(full_vehicle, speed).mass

    def __len__(self) -> int:
        return len(self._made)

    def of(self, scene: ReducedScene, speed: float) -> ReducedVehicle:
        """The reduced vehicle of a scene at a speed (m/s); InputError where no meaningful vehicle remains."""
        key = self.number(scene.vehicle), scene.limits, of_speed(scene.vehicle, speed)
        reduced_vehicle = self._made.get(key)
        if reduced_vehicle is None:
            reduced_vehicle = self._made[key] = self._make(scene, speed)
        return reduced_vehicle

    def number(self, vehicle: SpatialVehicle) -> int:
        """Number that is the same for vehicles with the same parts."""
        return self._numbers.of(vehicle, lambda: self._numbers.of_parts(vehicle, *PARTS_OF_VEHICLE))

    def linear(self, vehicle: SpatialVehicle, speed: float) -> LinearVehicle:
        """The linearised vehicle without its limits, that is without massless, rigid or locked parts."""
        key = self.number(vehicle), of_speed(vehicle, speed)
        if key not in self._linear:
            self._linear[key] = linearise(vehicle, speed)
        return self._linear[key]

    def _make(self, scene: ReducedScene, speed: float) -> ReducedVehicle:
        N = self._free_directions(scene)
        left = reduced_vehicle(self.linear(scene.vehicle, speed), self._mass_matrix(scene), N)
        states = vehicle_states(left)
        if not len(states.A):
            raise InputError("", "effects", None, "the reduced vehicle has no degree of freedom left")
        return ReducedVehicle(left, N, states, np.linalg.solve(N.T @ self.mass @ N, N.T @ self.mass))

    def _mass_matrix(self, scene: ReducedScene) -> np.ndarray:
        """The mass matrix (n, n) of a scene, which springs and locks do not change; made once."""
        names = scene.limits.massless
        key = *self._numbers.of_parts(scene.vehicle, "bodies", "joint_elements"), names
        if key not in self._masses:
            self._masses[key] = mass_matrix_without(scene.vehicle, names)
        return self._masses[key]

    def _free_directions(self, scene: ReducedScene) -> np.ndarray:
        """The matrix N (n, r) of a scene, which bars, tyres and masses do not change; made once."""
        limits = scene.limits
        key = *self._numbers.of_parts(scene.vehicle, "bodies", "springs"), limits.rigid, limits.locked
        if key not in self._free:
            self._free[key] = remaining_motions(scene.vehicle, limits)
        return self._free[key]


def of_speed(vehicle: SpatialVehicle, speed: float) -> float | None:
    """The speed (m/s) if the vehicle's matrices depend on it, else None."""
    return speed if vehicle.side_forces or vehicle.drags else None


class FullScene:
    """A scene with all its effects at a speed (m/s), from which reduced systems are made."""

    def __init__(self, scene: ReducedScene, speed: float, vehicles: Vehicles | None = None) -> None:
        self.scene, self.speed = scene, speed
        self.vehicles = Vehicles(scene.vehicle, speed) if vehicles is None else vehicles
        self.linear = self.vehicles.linear(scene.vehicle, speed)
        self.excitation = self.vehicles.roads.of(scene)
        self._made: dict[Hashable, Reduced] = {}
        self._roads: dict[Hashable, tuple[Excitation, np.ndarray, np.ndarray]] = {}
        self.full = self.reduced(scene)

    def reduced(self, scene: ReducedScene) -> Reduced:
        """The system of the reduced scene; raises InputError where it is no system."""
        key = self.vehicles.number(scene.vehicle), self.vehicles.roads.number(scene), scene.limits
        reduced_system = self._made.get(key)
        if reduced_system is None:
            reduced_system = self._made[key] = self._weighted(self._make(scene))
        return reduced_system

    def _weighted(self, reduced: Reduced) -> Reduced:
        weightings = self.scene.ride.weighting
        if not weightings:
            return reduced
        system = system_with_weightings(reduced.system, weightings)
        unit_matrix, names = np.eye(len(system.A) - reduced.states), tuple(weightings.values())
        T, left = block_diag(reduced.T, unit_matrix), block_diag(reduced.left, unit_matrix)
        return replace(reduced, system=system, T=T, left=left, weightings=names)

    def _make(self, scene: ReducedScene) -> Reduced:
        """The system of the reduced scene before the weightings of outputs are added."""
        vehicle, (excitation, Tf, left_f) = self.vehicles.of(scene, self.speed), self._heights(scene)
        states, N = vehicle.states, vehicle.N
        system, Tq = first_order_system(vehicle.linear, states, excitation, self.speed)
        n, m, x = len(self.linear.mass), len(Tf), len(system.A)
        inert, road = len(states.massless_part), len(states.A)
        q, f = N @ Tq, np.hstack([np.zeros((m, road)), Tf])
        left = np.zeros((x, 2 * n + m))
        left[:inert, :n] = left[inert : 2 * inert, n : 2 * n] = states.massless_part @ vehicle.residual_flexibility
        left[2 * inert : road, :n], left[road:, 2 * n :] = states.integrated_part @ vehicle.residual_flexibility, left_f
        return Reduced(vehicle, excitation, system, np.vstack([q, q @ system.A, f]), left, x)

    def road(self, scene: ReducedScene) -> Excitation:
        """The road of the reduced scene."""
        return self._heights(scene)[0]

    def _heights(self, scene: ReducedScene) -> tuple[Excitation, np.ndarray, np.ndarray]:
        """The road of the reduced scene, and the matrices of ``_filter_state_maps`` for it."""
        key = self.vehicles.roads.number(scene)
        if key not in self._roads:
            excitation = self.vehicles.roads.of(scene)
            self._roads[key] = (excitation, *_filter_state_maps(self.scene, self.excitation, scene, excitation))
        return self._roads[key]


def _filter_state_maps(
    scene: ReducedScene, full_road: Excitation, reduced_scene: ReducedScene, reduced_road: Excitation
) -> tuple[np.ndarray, np.ndarray]:
    """Matrices from the filter states of the reduced road to those of the full road, axle by axle, and back; states
    that effects add are last.
    """
    count, cutoff = full_road.G.shape[1], scene.ride.road.cutoff
    onto: np.ndarray = np.eye(count if cutoff is None else 2 * count)
    back: np.ndarray = onto
    if cutoff is not None and reduced_scene.ride.road.cutoff is None:
        onto, back = np.kron(np.eye(count), [[1.0], [0.0]]), np.kron(np.eye(count), [[1.0, 1.0 / cutoff]])
    added = np.eye(len(full_road.F) - len(onto), len(reduced_road.F) - len(back))
    onto, back = block_diag(onto, added), block_diag(back, added.T)
    axles = len(full_road.heights)
    if len(reduced_road.heights) == axles:
        return np.kron(np.eye(axles), onto), np.kron(np.eye(axles), back)
    return np.kron(np.ones((axles, 1)), onto), np.kron(np.eye(axles)[:1], back)
