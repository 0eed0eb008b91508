"""A ride scene without some effects as a linear system x' = A x + B w, with the maps between its state and that of the
full scene.

What rigid springs, locked freedoms and bodies without mass leave of the vehicle is said in
``models.vehicles.spatial.ReductionLimits`` and ``models.ride.excited``. The vehicle that is left is made once for all
speeds and roads, if it does not depend on the speed.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from models.advice.ride_choice.modes import Modes, modes_of, modes_with_road, modes_with_weightings, stable_step
from models.core.errors import InputError
from models.core.scene_effects import effect_tables_of
from models.ride.covariance import noise_intensity_of_system
from models.ride.excited import DelayedSystem, VehicleStateForm, first_order_system, vehicle_states
from models.ride.weighting import system_with_weightings
from models.road.excitation import RoadExcitation
from models.systems.ride.reduced_scene import ReducedScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, mass_matrix_without, reduced_vehicle, remaining_motions


@dataclass(frozen=True)
class ReducedVehicle:
    """A vehicle without some of its effects. linear : M, D, K in the remaining coordinates (M may be singular); N (n,
    r) : from these to the full vehicle's coordinates; states : of first order; residual_flexibility (r, n) : from the
    full coordinates back, keeping momentum.
    """

    linear: LinearVehicle
    N: np.ndarray
    states: VehicleStateForm
    residual_flexibility: np.ndarray

    @cached_property
    def modes(self) -> Modes | None:
        """Eigenmodes of the vehicle's state matrix; None where eigenvectors are nearly parallel."""
        return modes_of(self.states.A)

    @cached_property
    def stable_step(self) -> float:
        """Longest step (s) with which the classical Runge-Kutta method is stable; 0 where a mode grows."""
        return stable_step(self.modes.rates if self.modes else np.linalg.eigvals(self.states.A))


@dataclass(frozen=True)
class Reduced:
    """A reduced vehicle, its road ``excitation``, and the linear ``system`` of both. T (n, x) : from the reduced state
    to the full state (q, q', f, weightings); left (x, n) : back, keeping momentum; states : number of states of vehicle
    and road, which precede those of the ``weightings`` (their names).
    """

    reduced_vehicle: ReducedVehicle
    excitation: RoadExcitation
    system: DelayedSystem
    T: np.ndarray
    left: np.ndarray
    states: int
    weightings: tuple[str, ...] = ()

    @property
    def vehicle(self) -> LinearVehicle:
        """Matrices M, D, K of the reduced vehicle."""
        return self.reduced_vehicle.linear

    @cached_property
    def modes(self) -> Modes | None:
        """Eigenmodes of vehicle, road and weightings together; None where eigenvectors are nearly parallel."""
        A, axles, m = self.system.A[: self.states, : self.states], len(self.excitation.heights), len(self.excitation.F)
        modes = modes_with_road(A, self.reduced_vehicle.modes, A[-m:, -m:], axles)
        return modes_with_weightings(self.system.A, modes, self.weightings) if self.weightings else modes

    @cached_property
    def noise(self) -> np.ndarray:
        """Rate (x, x) per second at which the noise of all axles adds to the covariance of the states."""
        return noise_intensity_of_system(self.system, self.modes.propagated if self.modes else None)


class IndexNumbers:
    """Index numbers of values, the same for equal values. An object that was seen before is recognised by its identity,
    without a long hash.
    """

    def __init__(self) -> None:
        self._of_object: dict[int, tuple[object, int]] = {}
        self._of_value: dict[Hashable, int] = {}

    def index_of(self, known_object: object, value_of: Callable[[], Hashable]) -> int:
        """Index number of an object's value. The object is stored, so that its identity remains unique."""
        known = self._of_object.get(id(known_object))
        if known is None:
            known = self._of_object[id(known_object)] = (
                known_object,
                self._of_value.setdefault(value_of(), len(self._of_value)),
            )
        return known[1]

    def indices_of_attributes(self, known_object: Any, *attribute_names: str) -> tuple[int, ...]:
        """Index numbers of an object's attributes; copies of an object share most attributes."""
        parts = [getattr(known_object, name) for name in attribute_names]
        return tuple(self.index_of(attribute, partial(_hashable_key, attribute)) for attribute in parts)


def _hashable_key(any_value: Hashable) -> Hashable:
    return any_value


PARTS_OF_VEHICLE = tuple(field.name for field in fields(SpatialVehicle))
"""Names of a vehicle's attributes."""


class Roads:
    """Road excitations of reduced scenes, each computed once for all speeds."""

    def __init__(self) -> None:
        self._numbers = IndexNumbers()
        self._stored: dict[int, RoadExcitation] = {}

    def number(self, scene: ReducedScene) -> int:
        """Index number that is the same for scenes with the same road: the same road effects, and the same tables that
        add to the road.
        """
        ride = scene.ride_scene
        return self._numbers.index_of(ride, lambda: (ride.road, *effect_tables_of(ride)))

    def excitation_of(self, scene: ReducedScene) -> RoadExcitation:
        """The road excitation of a reduced scene, computed when it is first requested."""
        number = self.number(scene)
        if number not in self._stored:
            self._stored[number] = scene.excitation()
        return self._stored[number]


class Vehicles:
    """Reduced vehicles, each computed once and stored for all choices that request it; ``roads`` : their road
    excitations.
    """

    def __init__(self, full_vehicle: SpatialVehicle, speed: float, roads: Roads | None = None) -> None:
        self.roads = roads or Roads()
        self._numbers = IndexNumbers()
        self._stored: dict[Hashable, ReducedVehicle] = {}
        self._linear: dict[Hashable, LinearVehicle] = {}
        self._masses: dict[Hashable, np.ndarray] = {}
        self._free: dict[Hashable, np.ndarray] = {}
        self.mass = self.linear(full_vehicle, speed).mass

    def __len__(self) -> int:
        return len(self._stored)

    def reduced_vehicle_of(self, scene: ReducedScene, speed: float) -> ReducedVehicle:
        """The reduced vehicle of a scene at a speed (m/s); InputError where no meaningful vehicle remains."""
        key = self.number(scene.vehicle), scene.limits, speed_if_needed(scene.vehicle, speed)
        reduced_vehicle = self._stored.get(key)
        if reduced_vehicle is None:
            reduced_vehicle = self._stored[key] = self._make(scene, speed)
        return reduced_vehicle

    def number(self, vehicle: SpatialVehicle) -> int:
        """Index number that is the same for vehicles with equal parts."""
        return self._numbers.index_of(vehicle, lambda: self._numbers.indices_of_attributes(vehicle, *PARTS_OF_VEHICLE))

    def linear(self, vehicle: SpatialVehicle, speed: float) -> LinearVehicle:
        """The linearised vehicle at a speed (m/s), before parts are made massless, rigid or locked."""
        key = self.number(vehicle), speed_if_needed(vehicle, speed)
        if key not in self._linear:
            self._linear[key] = linearise(vehicle, speed)
        return self._linear[key]

    def _make(self, scene: ReducedScene, speed: float) -> ReducedVehicle:
        """The reduced vehicle of a scene at a speed (m/s), newly computed; InputError where no freedom is left."""
        N = self._free_directions(scene)
        left = reduced_vehicle(self.linear(scene.vehicle, speed), self._mass_matrix(scene), N)
        states = vehicle_states(left)
        if not len(states.A):
            raise InputError("", "effects", None, "the reduced vehicle has no degree of freedom left")
        return ReducedVehicle(left, N, states, np.linalg.solve(N.T @ self.mass @ N, N.T @ self.mass))

    def _mass_matrix(self, scene: ReducedScene) -> np.ndarray:
        """The mass matrix (n, n) of a scene, computed once for all sets of springs and locked coordinates, on which it
        does not depend.
        """
        names = scene.limits.massless
        key = *self._numbers.indices_of_attributes(scene.vehicle, "bodies", "joint_elements"), names
        if key not in self._masses:
            self._masses[key] = mass_matrix_without(scene.vehicle, names)
        return self._masses[key]

    def _free_directions(self, scene: ReducedScene) -> np.ndarray:
        """The matrix N (n, r) from the remaining to all coordinates, computed once for all sets of bars, tyres and
        masses, on which it does not depend.
        """
        limits = scene.limits
        key = *self._numbers.indices_of_attributes(scene.vehicle, "bodies", "springs"), limits.rigid, limits.locked
        if key not in self._free:
            self._free[key] = remaining_motions(scene.vehicle, limits)
        return self._free[key]


def speed_if_needed(vehicle: SpatialVehicle, speed: float) -> float | None:
    """The speed (m/s) if the vehicle's matrices depend on it, else None."""
    return speed if vehicle.side_forces or vehicle.drags else None


class FullScene:
    """A ride scene with all its effects at a speed (m/s), from which reduced systems are derived."""

    def __init__(self, scene: ReducedScene, speed: float, vehicles: Vehicles | None = None) -> None:
        self.scene, self.speed = scene, speed
        self.vehicles = Vehicles(scene.vehicle, speed) if vehicles is None else vehicles
        self.linear = self.vehicles.linear(scene.vehicle, speed)
        self.excitation = self.vehicles.roads.excitation_of(scene)
        self._stored: dict[Hashable, Reduced] = {}
        self._roads: dict[Hashable, tuple[RoadExcitation, np.ndarray, np.ndarray]] = {}
        self.full = self.reduced(scene)

    def reduced(self, reduced_scene: ReducedScene) -> Reduced:
        """The linear system of a reduced scene, stored for later requests; InputError where no meaningful system
        remains.
        """
        key = (
            self.vehicles.number(reduced_scene.vehicle),
            self.vehicles.roads.number(reduced_scene),
            reduced_scene.limits,
        )
        reduced_system = self._stored.get(key)
        if reduced_system is None:
            reduced_system = self._stored[key] = self._weighted(self._make(reduced_scene))
        return reduced_system

    def _weighted(self, reduced_system: Reduced) -> Reduced:
        """The system with the weighting filters of the scene's outputs added."""
        weightings = self.scene.ride_scene.weighting
        if not weightings:
            return reduced_system
        system = system_with_weightings(reduced_system.system, weightings)
        unit_matrix, names = np.eye(len(system.A) - reduced_system.states), tuple(weightings.values())
        T, left = block_diag(reduced_system.T, unit_matrix), block_diag(reduced_system.left, unit_matrix)
        return replace(reduced_system, system=system, T=T, left=left, weightings=names)

    def _make(self, reduced_scene: ReducedScene) -> Reduced:
        """The linear system of the reduced scene before the weighting filters of outputs are added."""
        vehicle, (excitation, Tf, left_f) = (
            self.vehicles.reduced_vehicle_of(reduced_scene, self.speed),
            self._heights(reduced_scene),
        )
        states, N = vehicle.states, vehicle.N
        system, Tq = first_order_system(vehicle.linear, states, excitation, self.speed)
        n, m, x = len(self.linear.mass), len(Tf), len(system.A)
        inert, road = len(states.massless_part), len(states.A)
        q, f = N @ Tq, np.hstack([np.zeros((m, road)), Tf])
        left = np.zeros((x, 2 * n + m))
        left[:inert, :n] = left[inert : 2 * inert, n : 2 * n] = states.massless_part @ vehicle.residual_flexibility
        left[2 * inert : road, :n], left[road:, 2 * n :] = states.integrated_part @ vehicle.residual_flexibility, left_f
        return Reduced(vehicle, excitation, system, np.vstack([q, q @ system.A, f]), left, x)

    def road(self, reduced_scene: ReducedScene) -> RoadExcitation:
        """The road excitation of the reduced scene."""
        return self._heights(reduced_scene)[0]

    def _heights(self, reduced_scene: ReducedScene) -> tuple[RoadExcitation, np.ndarray, np.ndarray]:
        """The road excitation of the reduced scene, and the matrices of ``_filter_state_maps`` for it."""
        key = self.vehicles.roads.number(reduced_scene)
        if key not in self._roads:
            excitation = self.vehicles.roads.excitation_of(reduced_scene)
            self._roads[key] = (excitation, *_filter_state_maps(self.scene, self.excitation, reduced_scene, excitation))
        return self._roads[key]


def _filter_state_maps(
    scene: ReducedScene, full_road: RoadExcitation, reduced_scene: ReducedScene, reduced_road: RoadExcitation
) -> tuple[np.ndarray, np.ndarray]:
    """Matrices from the filter states of the reduced road to those of the full road, axle by axle, and back; states
    that effects add are last.
    """
    count, cutoff = full_road.G.shape[1], scene.ride_scene.road.cutoff
    onto: np.ndarray = np.eye(count if cutoff is None else 2 * count)
    back: np.ndarray = onto
    if cutoff is not None and reduced_scene.ride_scene.road.cutoff is None:
        onto, back = np.kron(np.eye(count), [[1.0], [0.0]]), np.kron(np.eye(count), [[1.0, 1.0 / cutoff]])
    added = np.eye(len(full_road.F) - len(onto), len(reduced_road.F) - len(back))
    onto, back = block_diag(onto, added), block_diag(back, added.T)
    axles = len(full_road.heights)
    if len(reduced_road.heights) == axles:
        return np.kron(np.eye(axles), onto), np.kron(np.eye(axles), back)
    return np.kron(np.ones((axles, 1)), onto), np.kron(np.eye(axles)[:1], back)
