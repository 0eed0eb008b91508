"""The engine protocol of a spatial vehicle: the engine linearises the vehicle, and runs it in time on a given road.

An engine's module ``spatial_NAME`` has a class ``SpatialName`` of (vehicle, settings, speed, road). Rides march in both
with the same tableau, the classical Runge-Kutta one, so that they may be compared to rounding; ALLOWED_INTEGRATORS has
the others. All read the road from one table at half steps. Nothing is integrated here.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import Protocol

import numpy as np

from models.core.errors import InputError, Refused
from models.core.steps import dividing_step, step_divides
from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE
from models.engines.model import Model
from models.engines.protocol import check_trajectory
from models.engines.stability import ALLOWED_GROWTH, log_growth, longest_stable_step
from models.vehicles.kinematics import Kinematics
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle, Vector
from models.vehicles.spatial_linear import linear_outputs, linearise, wheels

INTEGRATORS = {"exudyn": "RK44", "mujoco": "RK4"}
"""Name of the classical Runge-Kutta method in each engine."""
ALLOWED_INTEGRATORS = {
    engine: tuple(name for name, method in CATALOGUE[engine].items() if method.nodes != "any") for engine in INTEGRATORS
}
"""Integrators of each engine that read the road at half steps only."""
DIFFERENCE_WEIGHTS = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
"""Weights of f(i h) - f(-i h) in h f'(0), by i: central differences of order six."""
SMOOTH_STEP, CORNERED_STEP = 4e-3, 1e-5
"""Steps h (m, rad, m/s, rad/s) of the central differences, for smooth laws, with errors below 1e-13, and for laws with
corners and friction, with errors of 1e-11."""


class SpatialModel(Model, Protocol):
    """A spatial vehicle in an engine, which also gives the linear vehicle that ride needs."""

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray, road_row: np.ndarray | None = None) -> np.ndarray:
        """Accelerations (n,) at a time (s), positions and rates (n,); ``road_row`` (2 w,) replaces the model's own
        road: heights (m), then rates (m/s) under w tyres."""
        ...

    def run(self, q: np.ndarray | None = None, v: np.ndarray | None = None) -> Trajectory:
        """Trajectory from positions and rates (n,), or from rest in the design position."""
        ...

    def linearise(self) -> LinearVehicle:
        """The linear vehicle, as the engine linearises it about the design position."""
        ...


def build(
    engine: str,
    vehicle: SpatialVehicle,
    run_settings: Settings | None = None,
    speed: float | None = None,
    road_rows: np.ndarray | None = None,
) -> SpatialModel:
    """Model of a spatial vehicle in "exudyn" or "mujoco".

    run_settings : wanted for runs in time; Refused where the step does not fit or a mode would grow.
    speed : m/s, for side forces and drag; InputError where they miss it.
    road_rows : heights (m) under the tyres, then their rates (m/s), at every half step: (2 steps + 1, 2 w); None: flat.
    """
    check_buildable(engine, vehicle)
    linear = linearise(vehicle, speed)
    if run_settings is not None:
        _check_run(engine, linear, run_settings, road_rows)
    elif road_rows is not None:
        raise Refused(engine, "a road is read by half steps: it needs settings with a step")
    kind = getattr(import_module(f"models.engines.spatial_{engine}"), f"Spatial{engine.capitalize()}")
    model: SpatialModel = kind(vehicle, run_settings, speed, road_rows)
    return model


def check_buildable(engine: str, vehicle: SpatialVehicle) -> None:
    """Raise Refused for a vehicle that "exudyn" and "mujoco" cannot build: a reduced vehicle, one with spring axes that
    turn with a body, or one with springs along coordinates."""
    if vehicle.limits:
        raise Refused(
            engine,
            "a reduced vehicle has bodies without mass, rigid springs or locked freedoms, which only "
            "the closed form of the reference has: use --engine reference, or the whole vehicle",
        )
    if vehicle.joint_elements:
        raise Refused(
            engine,
            f"{vehicle.joint_elements[0].name} acts along coordinates: in ride the engines know springs between points "
            "along axes that are fixed in the space; use --engine reference, whose closed form has the others",
        )
    for spring in (spring for spring in vehicle.springs if spring.frame is not None):
        raise Refused(
            engine,
            f"the axis of {spring.name!r} is fixed in {spring.frame!r}: in ride the engines know axes that are fixed "
            "in the space; use --engine reference, whose closed form has the others, or leave out frame",
        )


def _check_run(
    engine: str, linearised_vehicle: LinearVehicle, run_settings: Settings, road_rows: np.ndarray | None
) -> None:
    """Raise Refused for integrators, roads and steps with which a run would compute wrong results."""
    if run_settings.integrator not in ALLOWED_INTEGRATORS[engine]:
        raise Refused(
            engine,
            f"vehicles in space march with {' or '.join(ALLOWED_INTEGRATORS[engine])}, "
            f"not with {run_settings.integrator}",
        )
    check_divides(engine, run_settings)
    shape = (2 * run_settings.steps + 1, 2 * len(linearised_vehicle.wheels))
    if road_rows is not None and (road_rows.shape != shape or not np.isfinite(road_rows).all()):
        raise Refused(
            engine,
            f"the road must be {shape[0]} rows (half steps) of {shape[1]} finite numbers (heights, "
            f"then rates under {len(linearised_vehicle.wheels)} tyres)",
        )
    check_modes(engine, linearised_vehicle, run_settings)


def check_divides(engine: str, run_settings: Settings) -> None:
    """Raise Refused for a step that does not divide the duration."""
    step, duration = run_settings.step, run_settings.duration
    if not step_divides(step, duration):
        raise Refused(
            engine,
            f"the step {step:g} s does not divide the duration {duration:g} s; use for "
            f"example {dividing_step(step, duration)} s",
        )


def check_modes(engine: str, linearised_vehicle: LinearVehicle, run_settings: Settings) -> None:
    """Raise Refused for a step with which a mode of the linear vehicle grows, although the mode itself does not."""
    n = len(linearised_vehicle.mass)
    damping, stiffness = np.split(
        np.linalg.solve(linearised_vehicle.mass, np.hstack([linearised_vehicle.damping, linearised_vehicle.stiffness])),
        2,
        1,
    )
    parts = (np.eye(n), damping, stiffness, *np.zeros((2, n, n)))  # no engine knows its callback's damping
    name, h, duration = run_settings.integrator, run_settings.step, run_settings.duration
    poles = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]]))
    if log_growth(name, h, duration, parts) > math.log(ALLOWED_GROWTH) + max(0.0, float(poles.real.max())) * duration:
        raise Refused(
            engine,
            f"at a step of {h:g} s {name} lets a mode of the vehicle grow; use at most "
            f"{longest_stable_step(name, h, duration, parts):.3g} s",
        )


def difference_step(vehicle: SpatialVehicle) -> float:
    """Step of central differences that suits the vehicle's force laws: one size for laws with corners, another for
    smooth laws."""
    return CORNERED_STEP if curve_count(vehicle) else SMOOTH_STEP


def curve_count(vehicle: SpatialVehicle) -> int:
    """Number of nonlinear curves and dry frictions in the springs of a vehicle."""
    return sum((s.travel_force is not None) + (s.rate_force is not None) + (s.friction != 0) for s in vehicle.springs)


def jacobian(vector_function: Callable[[np.ndarray], np.ndarray], argument_count: int, small_step: float) -> np.ndarray:
    """Jacobian (outputs, size) of a function at 0, by central differences of order six with a step."""
    columns = [
        sum(
            weight * (vector_function(i * small_step * unit) - vector_function(-i * small_step * unit))
            for i, weight in DIFFERENCE_WEIGHTS.items()
        )
        / small_step
        for unit in np.eye(argument_count)
    ]
    return np.column_stack(columns)


class EngineKinematics(Kinematics):
    """Kinematics of points and bodies from an engine's Jacobians in the design position."""

    def __init__(
        self,
        vehicle: SpatialVehicle,
        point_jacobian: Callable[[str, Vector], np.ndarray],
        rotation_jacobian: Callable[[str], np.ndarray],
    ) -> None:
        super().__init__(vehicle)
        self._shift, self._turn = point_jacobian, rotation_jacobian

    def shift(self, body: str | None, point: Vector) -> np.ndarray:
        """Jacobian (3, n) of a point's (m) displacement with respect to the coordinates; zeros for a point on the
        ground (None)."""
        return np.zeros((3, self.size)) if body is None else self._shift(body, point)

    def turn(self, body: str) -> np.ndarray:
        """Jacobian (3, n) of a body's small rotation (rad) with respect to the coordinates."""
        return self._turn(body)


def linear_vehicle(
    engine: str,
    vehicle: SpatialVehicle,
    kinematics: EngineKinematics,
    mass_matrix: np.ndarray,
    damping_matrix: np.ndarray,
    stiffness_matrix: np.ndarray,
    road_rows: np.ndarray,
) -> LinearVehicle:
    """The linear vehicle from an engine's matrices; ``road_rows`` (n, 2 w) : generalised forces per road height, then
    per rate, under w tyres."""
    by_height, by_rate = np.split(road_rows, 2, axis=1)
    source = f"{engine}, " + ("loaded" if vehicle.gravity else "unloaded")
    return LinearVehicle(
        mass_matrix,
        damping_matrix,
        stiffness_matrix,
        by_height,
        by_rate,
        vehicle.coordinates(),
        wheels(vehicle),
        linear_outputs(vehicle, kinematics),
        source,
    )


LINEARISED_SPEEDS = (5.0, 15.0, 45.0)
"""Speeds (m/s) at which the vehicle is linearised; any three would do."""


def linear_vehicle_at_speeds(engine: str, vehicle: SpatialVehicle) -> Callable[[float], LinearVehicle]:
    """Function that gives the linear vehicle at a speed (m/s, above 0), as the engine linearises it, from one or three
    linearisations.

    Side forces damp by 1 / v and drag by v, and nothing else depends on the speed: D = D0 + D1 / v + D2 v exactly.
    """
    if not vehicle.side_forces and not vehicle.drags:
        only = build(engine, vehicle).linearise()
        return lambda speed: only
    linears = [build(engine, vehicle, speed=speed).linearise() for speed in LINEARISED_SPEEDS]
    powers = np.array([[1.0, 1.0 / speed, speed] for speed in LINEARISED_SPEEDS])
    parts = np.tensordot(np.linalg.inv(powers), np.array([linear.damping for linear in linears]), 1)

    def linear_vehicle_at(speed: float) -> LinearVehicle:
        if not speed > 0:
            raise InputError(vehicle.name, "speed", speed, "side forces and drag need a speed above 0 m/s")
        return replace(linears[0], damping=parts[0] + parts[1] / speed + parts[2] * speed)

    return linear_vehicle_at


def checked_trajectory(
    engine: str,
    run_settings: Settings,
    times: np.ndarray,
    states: np.ndarray,
    engine_note: str,
    run_counts: dict[str, int],
) -> Trajectory:
    """The trajectory of a run, after the checks of ``check_trajectory``; raises RunFailed."""
    check_trajectory(engine, times, states, run_settings.duration, engine_note)
    return Trajectory(times, states, counts=run_counts)
