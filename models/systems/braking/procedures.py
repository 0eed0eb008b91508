"""The driver's part of a test: straight braking, split friction, braking in a turn, J-turn, steered without looking."""

import json
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path as Folder

import numpy as np

from models.brake.controller import Pressures, Sample
from models.brake.plane_records import motion_of
from models.brake.plane_step import step_on
from models.brake.plane_vehicle import Plane
from models.brake.port.setup import ControllerRun, controller_of_run
from models.brake.steering import Steering, YawResponse, yaw_response
from models.brake.surfaces import check_way, surfaces, under_wheels
from models.core.errors import InputError
from models.systems.braking.march import BrakedVehicle, BrakingPath, StartState
from models.systems.braking.of_scene import SPRUNG_ENGINE, braked_vehicle, controller_of
from models.systems.braking.scene import BrakingScene, Procedure

UNBRAKED_DURATION = 4.0
"""s: for which the response to steering is watched after its last knot."""
STEERED_WHEELS = 2
"""Wheels that are steered: those of the first axle, in parallel."""
ACCELERATION_INTERVAL = 1e-5
"""s: time over which the accelerations of a steady turn are taken."""
CONTINUATION_SHARES = np.linspace(0.1, 1.0, 10)
"""Shares of the speed through which a steady turn is followed: other solutions slide beyond the tyres' peak."""
LARGEST_TURN_ANGLE = 0.5
"""rad: steer angle, side slip and angles of hinges of a turn that is one."""
STEADY_ACCELERATION = 1e-6
"""m/s^2, and rad/s^2 times 1 m: what is left of a steady turn's accelerations."""


def vehicle_and_start(scene: BrakingScene, name: str) -> tuple[BrakedVehicle, StartState]:
    """Vehicle and start of a procedure; InputError for a circle that the tyres' side forces cannot hold."""
    procedure = scene.procedures[name]
    vehicle = braked_vehicle(scene, procedure)
    try:
        check_way(vehicle.road, scene.run.sample / scene.run.substeps * procedure.speed)
    except InputError as error:
        raise InputError(scene.file, f"road.{error.place}", error.value, error.allowed) from None
    if procedure.radius is not None:
        turn = steady_turn(vehicle, procedure.speed, procedure.radius)
        if turn is None:
            allowed = f"tyres do not hold a steady circle of this radius at {procedure.speed:g} m/s on this surface"
            raise InputError(scene.file, f"procedures.{name}.radius", procedure.radius, allowed)
        return replace(vehicle, steer=turn.steer), turn.start
    start, steering = vehicle.rolling(procedure.speed), steering_of(procedure, vehicle)
    return replace(vehicle, steer=steering(0.0), steering=steering if procedure.steering else None), start


def steering_of(procedure: Procedure, vehicle: BrakedVehicle) -> Steering:
    """The driver's steering from time 0 on; a single angle is applied at once."""
    knots = procedure.steering or [[0.0, procedure.steer or 0.0]]
    knot_times, angles = np.array(knots, float).T
    return Steering(knot_times, angles, steer_angles(vehicle, 1.0))


def step_steer(scene: BrakingScene, name: str) -> YawResponse | None:
    """Response of the yaw rate to the steering step of a J-turn without brakes; None where it does not settle."""
    vehicle, start = vehicle_and_start(scene, name)
    steering = steering_of(scene.procedures[name], vehicle)
    path = vehicle.run(Pressures(np.zeros(vehicle.plane.wheels)), start, float(steering.times[-1]) + UNBRAKED_DURATION)
    return yaw_response(path.times, path.states[:, 1, 2], steering.half)


def engines_of(scene: BrakingScene, requested_engines: tuple[str, ...]) -> tuple[str, ...]:
    """The requested engines, or the usual engine if none was requested.

    The reference takes minutes for a stop on a suspension: there it is used only if no other engine is requested.
    """
    if scene.vehicle.file is None:
        return requested_engines or ("reference",)
    return (
        tuple(name for name in requested_engines if name != "reference")
        if len(requested_engines) > 1
        else requested_engines or (SPRUNG_ENGINE,)
    )


def controlled_run(
    scene: BrakingScene, name: str, vehicle: BrakedVehicle, start_state: StartState, engine: str = ""
) -> BrakingPath:
    """One run from a start, with the scene's controller in the loop or with what is connected to the port. ``engine``
    is only a name, for files.
    """
    usual = controller_of(scene, vehicle.plane.wheels, name)
    if scene.port is None:
        return vehicle.run(usual, start_state, scene.run.duration)
    with controller_of_run(scene.port, port_of(scene, name, vehicle, engine), usual) as (controller, clock):
        path = vehicle.run(controller, start_state, scene.run.duration)
    return path if clock is None else replace(path, clock=clock.report())


def controller_answers(
    scene: BrakingScene, name: str, vehicle: BrakedVehicle, times: np.ndarray, rims: np.ndarray, speeds: np.ndarray
) -> np.ndarray:
    """Commands (n, W), of valves or pressures, with which a run's controller answers given speeds (m/s) of rims (n, W)
    and of the vehicle (n,) at times (n,) in s. No vehicle is simulated.
    """
    usual, supply = controller_of(scene, vehicle.plane.wheels, name), vehicle.chambers.supply
    with ExitStack() as stack:
        if scene.port is not None:
            usual, _ = stack.enter_context(
                controller_of_run(scene.port, port_of(scene, name, vehicle, "reference"), usual)
            )
        known = speeds if vehicle.speed_given else np.full(speeds.shape, np.nan)
        commands = [
            usual.sample(Sample(k, round(time * 1e9), rims[k], True, supply, float(known[k])))
            for k, time in enumerate(times)
        ]
    return np.array([command.valves if command.pressures is None else command.pressures for command in commands])


def port_of(scene: BrakingScene, name: str, vehicle: BrakedVehicle, engine: str) -> ControllerRun:
    """Facts of a run that the port needs. A log belongs to a vehicle and its drive, whatever controller answered."""
    known = {key: value for key, value in scene.table().items() if key not in ("port", "controller")}
    text = json.dumps([name, known], sort_keys=True)
    return ControllerRun(
        vehicle.plane.radius,
        scene.run.sample,
        text,
        Folder(scene.folder),
        scene.file,
        name,
        engine,
        vehicle.chambers.slow.size > 0,
    )


def steer_angles(vehicle: BrakedVehicle, angle: float) -> np.ndarray:
    """Steer angles (W,) with the front wheels at one angle (rad)."""
    return np.where(np.arange(vehicle.plane.wheels) < STEERED_WHEELS, angle, 0.0)


@dataclass(frozen=True, eq=False)
class SteadyTurn:
    """A steady circle: steer angles (W,) in rad, and a start state in which the first unit heads along x."""

    steer: np.ndarray
    start: StartState


@dataclass(frozen=True, eq=False)
class Circle:
    """Motion of a vehicle at a speed (m/s) whose first unit's centre of mass follows a circle (radius in m, positive to
    the left).

    All wheels roll freely: the drive that holds the speed (m/s) is not there, so that the vehicle slows down by the
    drag of its slip angles. Unknown (n - 1,) are the steer angle, the side slip (rad) and all n coordinates but the
    first unit's place and heading: headings of the units behind, or, if it is ``sprung``, those on the springs.
    """

    vehicle: BrakedVehicle
    speed: float
    radius: float
    sprung: bool = False

    def state(self, unknowns: np.ndarray) -> np.ndarray:
        """Positions and rates (2, n) for these unknowns."""
        positions_and_rates = np.zeros((2, unknowns.size + 1))
        positions_and_rates[0, 3:], positions_and_rates[1, 2 : 3 if self.sprung else None] = (
            unknowns[2:],
            self.speed / self.radius,
        )
        positions_and_rates[1, :2] = self.speed * np.cos(unknowns[1]), self.speed * np.sin(unknowns[1])
        return positions_and_rates

    def motion(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations (n,) for these unknowns, and the wheels' speeds of turning (W,)."""
        vehicle, state, steer = self.vehicle, self.state(unknowns), steer_angles(self.vehicle, unknowns[0])
        if not self.sprung:
            return _accelerations(vehicle, state, steer)
        motion: tuple[np.ndarray, np.ndarray] = vehicle.engine.rolling(state, steer, vehicle.on_road)
        return motion

    def left(self, unknowns: np.ndarray) -> np.ndarray:
        """Residual accelerations (n - 1,), zero on a steady circle: first that across the path, then those of the other
        coordinates.
        """
        rates, _ = self.motion(unknowns)
        across = rates[1] * np.cos(unknowns[1]) - rates[0] * np.sin(unknowns[1])
        return np.concatenate(([across - self.speed**2 / self.radius], rates[2:]))

    def solve_steady_circle(self, unknowns_guess: np.ndarray) -> tuple[np.ndarray, bool]:
        """Solution for the unknowns of a steady circle from a guess, and whether its residual accelerations vanish."""
        from scipy.optimize import root

        unknown: np.ndarray = root(self.left, unknowns_guess, tol=1e-12).x
        return unknown, bool(np.abs(self.left(unknown)).max() <= STEADY_ACCELERATION)

    def turn(self, unknowns: np.ndarray) -> SteadyTurn:
        """The steady turn, with which a procedure begins, for these unknowns."""
        return SteadyTurn(
            steer_angles(self.vehicle, unknowns[0]), StartState(self.state(unknowns), self.motion(unknowns)[1])
        )


def steady_turn(vehicle: BrakedVehicle, speed: float, radius: float) -> SteadyTurn | None:
    """The steady circle (see ``Circle``) of a vehicle; None if there is none.

    That of the plane vehicle is followed from a low speed on, and is the first guess of one on its suspension.
    """
    plane, units = vehicle.plane, vehicle.plane.masses.size
    rearmost_x = np.array([plane.reach[k].sum() + plane.place[plane.unit == k, 0].min() for k in range(units)])
    unknown = np.zeros(1 + units)  # of wheels that roll along the circle: the last ones of each unit on its tangent
    unknown[0], unknown[1] = np.ptp(plane.place[plane.unit == 0, 0]) / radius, -rearmost_x[0] / radius
    unknown[2:] = (rearmost_x[1:] - rearmost_x[0]) / radius
    for slower in speed * CONTINUATION_SHARES:
        unknown, steady = Circle(vehicle, slower, radius).solve_steady_circle(unknown)
        if not steady or np.abs(unknown).max() > LARGEST_TURN_ANGLE:
            return None
    circle, state = Circle(vehicle, speed, radius), Circle(vehicle, speed, radius).state(unknown)
    if vehicle.sprung is not None:
        guess = np.zeros(vehicle.engine.size - 1)
        guess[0], guess[1] = unknown[0], np.arctan2(state[1, 1], state[1, 0])
        guess[vehicle.sprung.turns - 1] = np.diff(state[0, 2:])
        circle = Circle(vehicle, speed, radius, sprung=True)
        unknown, steady = circle.solve_steady_circle(guess)
    return circle.turn(unknown) if steady else None


def _rolling_speeds(plane: Plane, state: np.ndarray, steer: np.ndarray) -> np.ndarray:
    """Speeds of turning (W,) in rad/s of wheels that roll without slip."""
    headings, rates, unit = state[0, 2:], state[1, 2:], plane.unit
    forward = np.column_stack((np.cos(headings), np.sin(headings)))
    leftward = np.column_stack((-forward[:, 1], forward[:, 0]))
    centres = state[1, :2] + plane.reach @ (rates[:, None] * leftward)
    spun = rates[unit, None] * (plane.place[:, :1] * leftward[unit] - plane.place[:, 1:] * forward[unit])
    course = headings[unit] + steer
    rolling_direction = np.column_stack((np.cos(course), np.sin(course)))
    return ((centres[unit] + spun) * rolling_direction).sum(axis=1) / plane.radius


def _accelerations(vehicle: BrakedVehicle, state: np.ndarray, steer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (2 + U,) of a plane vehicle whose unbraked wheels roll freely, and the wheels' speeds of turning
    (W,).
    """
    plane, no_torques, turning = (
        vehicle.plane,
        np.zeros((2, vehicle.plane.wheels)),
        _rolling_speeds(vehicle.plane, state, steer),
    )
    motion, ground = motion_of(state.copy(), turning.copy()), surfaces(plane.wheels)
    motion.accelerations[:2] = state[1, 2] * np.array([-state[1, 1], state[1, 0]])
    under_wheels(state, 0.0, vehicle.on_road, ground)
    step_on(
        motion,
        no_torques,
        ACCELERATION_INTERVAL,
        steer,
        vehicle.slope * 9.81 * ACCELERATION_INTERVAL,
        vehicle.on_road,
        ground,
    )
    return motion.accelerations, turning
