"""Test procedures of braking: straight, split friction, in a turn, J-turn; the driver steers open loop."""

import json
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path as Folder

import numpy as np

from models.brake.controller import ConstantPressures, Sample
from models.brake.plane_records import motion_of
from models.brake.plane_step import advance_one_step
from models.brake.plane_vehicle import PlaneVehicle
from models.brake.port.setup import ControllerRunData, controller_of_run
from models.brake.steering import Steering, YawResponse, yaw_response
from models.brake.surfaces import check_step_distance, fill_surfaces_under_wheels, new_wheel_surfaces
from models.core.errors import InputError
from models.systems.braking.march import BrakedVehicle, BrakingPath, StartState
from models.systems.braking.of_scene import SPRUNG_ENGINE, braked_vehicle, controller_of
from models.systems.braking.scene import BrakingProcedure, BrakingScene

UNBRAKED_DURATION = 4.0
"""Time (s) after the last steering knot over which the yaw response without brakes is computed."""
STEERED_WHEEL_COUNT = 2
"""Number of steered wheels: the wheels of the first axle, in parallel."""
ACCELERATION_INTERVAL = 1e-5
"""Time step (s) over which the accelerations of a steady turn are computed."""
CONTINUATION_SHARES = np.linspace(0.1, 1.0, 10)
"""Shares of the speed at which a steady turn is solved in turn, each from the solution before: solutions that are
solved at once may slide beyond the tyres' peak.
"""
LARGEST_TURN_ANGLE = 0.5
"""Largest steer angle, side slip and hinge angle (rad) of a steady turn that is accepted."""
LARGEST_STEADY_ACCELERATION = 1e-6
"""Largest residual acceleration (m/s^2 and rad/s^2) of a steady turn."""


def vehicle_and_start_state(scene: BrakingScene, procedure_name: str) -> tuple[BrakedVehicle, StartState]:
    """Returns vehicle and start state of a procedure. Raises InputError for a circle that the tyres' side forces cannot
    hold.
    """
    procedure = scene.procedures[procedure_name]
    vehicle = braked_vehicle(scene, procedure)
    try:
        check_step_distance(vehicle.road, scene.run.sample / scene.run.substeps * procedure.speed)
    except InputError as error:
        raise InputError(scene.file, f"road.{error.place}", error.value, error.allowed) from None
    if procedure.radius is not None:
        turn = steady_turn(vehicle, procedure.speed, procedure.radius)
        if turn is None:
            allowed = f"tyres do not hold a steady circle of this radius at {procedure.speed:g} m/s on this surface"
            raise InputError(scene.file, f"procedures.{procedure_name}.radius", procedure.radius, allowed)
        return replace(vehicle, steer=turn.steer), turn.start
    start, steering = vehicle.rolling(procedure.speed), steering_of(procedure, vehicle)
    return replace(vehicle, steer=steering(0.0), steering=steering if procedure.steering else None), start


def steering_of(procedure: BrakingProcedure, vehicle: BrakedVehicle) -> Steering:
    """Returns the driver's steering over time from time 0 on; a single angle is applied at once."""
    knots = procedure.steering or [[0.0, procedure.steer or 0.0]]
    knot_times, angles = np.array(knots, float).T
    return Steering(knot_times, angles, steer_angles(vehicle, 1.0))


def step_steer_response(scene: BrakingScene, procedure_name: str) -> YawResponse | None:
    """Computes the yaw rate's response to the steering of a J-turn without brakes; None where it does not settle."""
    vehicle, start = vehicle_and_start_state(scene, procedure_name)
    steering = steering_of(scene.procedures[procedure_name], vehicle)
    path = vehicle.run(
        ConstantPressures(np.zeros(vehicle.plane.wheels)), start, float(steering.times[-1]) + UNBRAKED_DURATION
    )
    return yaw_response(path.times, path.states[:, 1, 2], steering.half)


def engines_of(scene: BrakingScene, requested_engines: tuple[str, ...]) -> tuple[str, ...]:
    """Returns the engines in which a scene is run: the requested engines, or the usual engine if none was requested.

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
    scene: BrakingScene, procedure_name: str, vehicle: BrakedVehicle, start_state: StartState, engine: str = ""
) -> BrakingPath:
    """Run a procedure from a start state, with the scene's controller in the loop or with what is connected to the
    port. ``engine`` : name of the engine in file names; the vehicle's engine is used.
    """
    usual = controller_of(scene, vehicle.plane.wheels, procedure_name)
    if scene.port is None:
        return vehicle.run(usual, start_state, scene.run.duration)
    with controller_of_run(scene.port, port_run_of(scene, procedure_name, vehicle, engine), usual) as (
        controller,
        clock,
    ):
        path = vehicle.run(controller, start_state, scene.run.duration)
    return path if clock is None else replace(path, clock=clock.report())


def controller_commands(
    scene: BrakingScene,
    procedure_name: str,
    vehicle: BrakedVehicle,
    times: np.ndarray,
    wheel_speeds: np.ndarray,
    speeds: np.ndarray,
) -> np.ndarray:
    """Returns the commands (n, W), valve states or pressures (bar), of a run's controller to given wheel speeds (n, W)
    and vehicle speeds (n,) in m/s at times (n,) in s. No vehicle is simulated.
    """
    usual, supply = controller_of(scene, vehicle.plane.wheels, procedure_name), vehicle.chambers.supply
    with ExitStack() as stack:
        if scene.port is not None:
            usual, _ = stack.enter_context(
                controller_of_run(scene.port, port_run_of(scene, procedure_name, vehicle, "reference"), usual)
            )
        known = speeds if vehicle.speed_given else np.full(speeds.shape, np.nan)
        commands = [
            usual.sample(Sample(k, round(time * 1e9), wheel_speeds[k], True, supply, float(known[k])))
            for k, time in enumerate(times)
        ]
    return np.array([command.valves if command.pressures is None else command.pressures for command in commands])


def port_run_of(scene: BrakingScene, procedure_name: str, vehicle: BrakedVehicle, engine: str) -> ControllerRunData:
    """Returns the facts of a run that the port needs. The key of a log depends on vehicle and procedure, not on the
    controller.
    """
    known = {key: value for key, value in scene.table().items() if key not in ("port", "controller")}
    text = json.dumps([procedure_name, known], sort_keys=True)
    return ControllerRunData(
        vehicle.plane.radius,
        scene.run.sample,
        text,
        Folder(scene.folder),
        scene.file,
        procedure_name,
        engine,
        vehicle.chambers.slow.size > 0,
    )


def steer_angles(vehicle: BrakedVehicle, front_angle: float) -> np.ndarray:
    """Steer angles (W,) of all wheels with the front wheels at an angle (rad), the other wheels straight."""
    return np.where(np.arange(vehicle.plane.wheels) < STEERED_WHEEL_COUNT, front_angle, 0.0)


@dataclass(frozen=True, eq=False)
class SteadyCircle:
    """A steady circle: steer angles (W,) in rad, and a start state in which the towing vehicle heads along x."""

    steer: np.ndarray
    start: StartState


@dataclass(frozen=True, eq=False)
class CircleMotion:
    """Motion of a vehicle whose towing unit's centre of mass follows a circle at a speed (m/s); radius in m, positive
    to the left.

    All wheels roll freely: no drive holds the speed, so that the vehicle slows down by the drag of its slip angles.
    Unknowns (n - 1,) are the steer angle, the side slip (rad) and all n coordinates but position and heading of the
    towing unit: headings of towed units or, if ``sprung``, the coordinates of the suspension.
    """

    vehicle: BrakedVehicle
    speed: float
    radius: float
    sprung: bool = False

    def state(self, unknowns: np.ndarray) -> np.ndarray:
        """Returns positions and rates (2, n) of the coordinates for given unknowns."""
        positions_and_rates = np.zeros((2, unknowns.size + 1))
        positions_and_rates[0, 3:], positions_and_rates[1, 2 : 3 if self.sprung else None] = (
            unknowns[2:],
            self.speed / self.radius,
        )
        positions_and_rates[1, :2] = self.speed * np.cos(unknowns[1]), self.speed * np.sin(unknowns[1])
        return positions_and_rates

    def motion(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns accelerations (n,) of the coordinates for given unknowns, and angular speeds of the wheels (W,) in
        rad/s.
        """
        vehicle, state, steer = self.vehicle, self.state(unknowns), steer_angles(self.vehicle, unknowns[0])
        if not self.sprung:
            return _accelerations(vehicle, state, steer)
        motion: tuple[np.ndarray, np.ndarray] = vehicle.engine.rolling(state, steer, vehicle.on_road)
        return motion

    def residual_accelerations(self, unknowns: np.ndarray) -> np.ndarray:
        """Residual accelerations (n - 1,) for given unknowns, zero on a steady circle: across the path, then of the
        coordinates from the heading on.
        """
        rates, _ = self.motion(unknowns)
        across = rates[1] * np.cos(unknowns[1]) - rates[0] * np.sin(unknowns[1])
        return np.concatenate(([across - self.speed**2 / self.radius], rates[2:]))

    def solve_steady_circle(self, unknowns_guess: np.ndarray) -> tuple[np.ndarray, bool]:
        """Solves for the unknowns of a steady circle from a guess. Returns them, and whether the residual accelerations
        vanish.
        """
        from scipy.optimize import root

        unknown: np.ndarray = root(self.residual_accelerations, unknowns_guess, tol=1e-12).x
        return unknown, bool(np.abs(self.residual_accelerations(unknown)).max() <= LARGEST_STEADY_ACCELERATION)

    def steady_turn(self, unknowns: np.ndarray) -> SteadyCircle:
        """Returns the steady turn for given unknowns, with which a procedure begins."""
        return SteadyCircle(
            steer_angles(self.vehicle, unknowns[0]), StartState(self.state(unknowns), self.motion(unknowns)[1])
        )


def steady_turn(vehicle: BrakedVehicle, speed: float, turn_radius: float) -> SteadyCircle | None:
    """Solve the steady circle of a vehicle (see ``CircleMotion``) at a speed (m/s) and radius (m); None if there is
    none.

    The circle of the plane vehicle is followed from a low speed on; it is the first guess for a vehicle on its
    suspension.
    """
    plane, units = vehicle.plane, vehicle.plane.masses.size
    rearmost_x = np.array([plane.arm_lengths[k].sum() + plane.place[plane.unit == k, 0].min() for k in range(units)])
    unknown = np.zeros(1 + units)  # of wheels that roll along the circle: the last ones of each unit on its tangent
    unknown[0], unknown[1] = np.ptp(plane.place[plane.unit == 0, 0]) / turn_radius, -rearmost_x[0] / turn_radius
    unknown[2:] = (rearmost_x[1:] - rearmost_x[0]) / turn_radius
    for slower in speed * CONTINUATION_SHARES:
        unknown, steady = CircleMotion(vehicle, slower, turn_radius).solve_steady_circle(unknown)
        if not steady or np.abs(unknown).max() > LARGEST_TURN_ANGLE:
            return None
    circle, state = CircleMotion(vehicle, speed, turn_radius), CircleMotion(vehicle, speed, turn_radius).state(unknown)
    if vehicle.sprung is not None:
        guess = np.zeros(vehicle.engine.size - 1)
        guess[0], guess[1] = unknown[0], np.arctan2(state[1, 1], state[1, 0])
        guess[vehicle.sprung.turns - 1] = np.diff(state[0, 2:])
        circle = CircleMotion(vehicle, speed, turn_radius, sprung=True)
        unknown, steady = circle.solve_steady_circle(guess)
    return circle.steady_turn(unknown) if steady else None


def _rolling_speeds(
    plane_vehicle: PlaneVehicle, motion_state: np.ndarray, wheel_steer_angles: np.ndarray
) -> np.ndarray:
    """Angular speeds (W,) in rad/s of wheels that roll without slip, for positions and rates (2, 2 + U) of a plane
    vehicle.
    """
    headings, rates, unit = motion_state[0, 2:], motion_state[1, 2:], plane_vehicle.unit
    forward = np.column_stack((np.cos(headings), np.sin(headings)))
    leftward = np.column_stack((-forward[:, 1], forward[:, 0]))
    centres = motion_state[1, :2] + plane_vehicle.arm_lengths @ (rates[:, None] * leftward)
    spun = rates[unit, None] * (
        plane_vehicle.place[:, :1] * leftward[unit] - plane_vehicle.place[:, 1:] * forward[unit]
    )
    course = headings[unit] + wheel_steer_angles
    rolling_direction = np.column_stack((np.cos(course), np.sin(course)))
    return ((centres[unit] + spun) * rolling_direction).sum(axis=1) / plane_vehicle.radius


def _accelerations(
    vehicle: BrakedVehicle, motion_state: np.ndarray, wheel_steer_angles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns accelerations (2 + U,) of a plane vehicle whose wheels roll freely without brakes, and angular speeds of
    the wheels (W,) in rad/s.
    """
    plane, no_torques, turning = (
        vehicle.plane,
        np.zeros((2, vehicle.plane.wheels)),
        _rolling_speeds(vehicle.plane, motion_state, wheel_steer_angles),
    )
    motion, ground = motion_of(motion_state.copy(), turning.copy()), new_wheel_surfaces(plane.wheels)
    motion.accelerations[:2] = motion_state[1, 2] * np.array([-motion_state[1, 1], motion_state[1, 0]])
    fill_surfaces_under_wheels(motion_state, 0.0, vehicle.on_road, ground)
    advance_one_step(
        motion,
        no_torques,
        ACCELERATION_INTERVAL,
        wheel_steer_angles,
        vehicle.slope * 9.81 * ACCELERATION_INTERVAL,
        vehicle.on_road,
        ground,
    )
    return motion.accelerations, turning
