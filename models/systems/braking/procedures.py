"""The driver's part of a test: straight braking, split friction, braking in a turn, J-turn, steered without looking."""

import json
from dataclasses import dataclass, replace
from pathlib import Path as Folder
from typing import ClassVar

import numpy as np
from scipy.optimize import root

from models.brake.controller import Command, Sample
from models.brake.plane_step import REPORTED, step_on
from models.brake.port.setup import Run, opened
from models.brake.steering import Response, Steering, response
from models.brake.surfaces import check_way, under_wheels
from models.core.errors import InputError, Refused
from models.systems.braking.of_scene import SPRUNG_ENGINE, braked, controller_of, on_springs
from models.systems.braking.run import Braked, Path, Start
from models.systems.braking.scene import BrakingScene, Procedure

UNBRAKED = 4.0
"""s: for which the response to steering is watched after its last knot."""
STEERED = 2
"""Wheels that are steered: those of the first axle, in parallel."""
BLINK = 1e-5
"""s: time over which the accelerations of a steady turn are taken."""
SPEEDS = np.linspace(0.1, 1.0, 10)
"""Shares of the speed through which a steady turn is followed: other solutions slide beyond the tyres' peak."""
LARGEST = 0.5
"""rad: steer angle, side slip and angles of hinges of a turn that is one."""
STEADY = 1e-6
"""m/s^2, and rad/s^2 times 1 m: what is left of a steady turn's accelerations."""


def ready(scene: BrakingScene, name: str) -> tuple[Braked, Start]:
    """Vehicle and start of a procedure; InputError for a circle that tyres cannot hold."""
    own = scene.procedures[name]
    vehicle = braked(scene, own)
    try:
        check_way(vehicle.road, scene.run.sample / scene.run.substeps * own.speed)
    except InputError as error:
        raise InputError(scene.file, f"road.{error.place}", error.value, error.allowed) from None
    if own.radius is not None:
        turn = steady_turn(vehicle, own.speed, own.radius)
        if turn is not None and vehicle.sprung is not None:
            from models.systems.braking.sprung_turn import sprung_turn

            turn = sprung_turn(vehicle, own.speed, own.radius, turn)
        if turn is None:
            allowed = f"tyres do not hold a steady circle of this radius at {own.speed:g} m/s on this surface"
            raise InputError(scene.file, f"procedures.{name}.radius", own.radius, allowed)
        return replace(vehicle, steer=turn.steer), turn.start
    start, steering = vehicle.rolling(own.speed), steering_of(own, vehicle)
    return replace(vehicle, steer=steering(0.0), steering=steering if own.steering else None), start


def steering_of(own: Procedure, vehicle: Braked) -> Steering:
    """What the driver does at the wheel from time 0 on; one angle is there at once."""
    knots = own.steering or [[0.0, own.steer or 0.0]]
    times, angles = np.array(knots, float).T
    return Steering(times, angles, steered(vehicle, 1.0))


@dataclass(frozen=True)
class Released:
    """No pressure anywhere, for wheels (W,)."""

    wheels: int
    steady: ClassVar[bool] = True

    def sample(self, given: Sample) -> Command:
        """None."""
        return Command(pressures=np.zeros(self.wheels))


def step_steer(scene: BrakingScene, name: str) -> Response | None:
    """How fast the vehicle of a J-turn answers to its steering without brakes; None where no yaw rate is steady."""
    vehicle, start = ready(scene, name)
    steering = steering_of(scene.procedures[name], vehicle)
    path = vehicle.run(Released(vehicle.plane.wheels), start, float(steering.times[-1]) + UNBRAKED)
    return response(path.times, path.states[:, 1, 2], steering.half)


def engines_of(scene: BrakingScene, asked: tuple[str, ...]) -> tuple[str, ...]:
    """Engines that were asked for, of several those that have such a vehicle; where none were, the usual one."""
    if scene.vehicle.file is None:
        return asked or ("reference",)
    return tuple(name for name in asked if name != "reference") if len(asked) > 1 else asked or (SPRUNG_ENGINE,)


def drive(scene: BrakingScene, name: str, engine: str | None = None) -> Path:
    """One run of a procedure, whatever stands behind the port; InputError, Refused, or RunFailed with the path until
    then."""
    (engine,) = engines_of(scene, (engine,) if engine else ())
    check_engine(scene, engine)
    vehicle, start = ready(scene, name)
    if vehicle.sprung is not None:
        vehicle = replace(vehicle, engine=on_springs(engine, vehicle.sprung))
    elif engine != "reference":
        from models.engines.braking import Carried

        vehicle = replace(vehicle, engine=Carried(engine, vehicle.plane))
    return looped(scene, name, vehicle, start, engine)


def check_engine(scene: BrakingScene, engine: str) -> None:
    """Refuse an engine that would leave an effect of the scene out."""
    if scene.relaxation is not None and engine != "reference":
        raise Refused(engine, "the lag of tyres is not in its steps: use --engine reference", scene.file)
    if scene.vehicle.file is not None and engine == "reference":
        raise Refused(engine, "it has no suspension, roll and pitch: use --engine mujoco or exudyn", scene.file)


def looped(scene: BrakingScene, name: str, vehicle: Braked, start: Start, engine: str = "") -> Path:
    """One run from a start with the scene's controller in the loop, or with what stands behind the port instead; of
    the engine only the name is needed, for files."""
    own = controller_of(scene, vehicle.plane.wheels, name)
    if scene.port is None:
        return vehicle.run(own, start, scene.run.duration)
    with opened(scene.port, port_of(scene, name, vehicle, engine), own) as (controller, clock):
        path = vehicle.run(controller, start, scene.run.duration)
    return path if clock is None else replace(path, clock=clock.report())


def port_of(scene: BrakingScene, name: str, vehicle: Braked, engine: str) -> Run:
    """What the port needs to know; a log is that of a vehicle and its drive, whatever answered."""
    known = {key: value for key, value in scene.table().items() if key not in ("port", "controller")}
    text = json.dumps([name, known], sort_keys=True)
    return Run(
        vehicle.plane.radius,
        scene.run.sample,
        text,
        Folder(scene.folder),
        scene.file,
        name,
        engine,
        vehicle.chambers.slow.size > 0,
    )


def steered(vehicle: Braked, angle: float) -> np.ndarray:
    """Steer angles (W,) with the front wheels at one angle (rad)."""
    return np.where(np.arange(vehicle.plane.wheels) < STEERED, angle, 0.0)


@dataclass(frozen=True, eq=False)
class SteadyTurn:
    """A steady circle: steer angles (W,) in rad, and the state with which the first unit heads along x."""

    steer: np.ndarray
    start: Start


def steady_turn(vehicle: Braked, speed: float, radius: float) -> SteadyTurn | None:
    """Circle of the first unit's centre of mass (m, positive to the left) at a speed (m/s); None if there is none.

    All wheels roll freely: the drive that holds the speed is not there, so that the vehicle slows down by the drag of
    its slip angles. Unknown are the steer angle, the side slip and the headings of the units behind.
    """
    units = vehicle.plane.masses.size

    def state(unknown: np.ndarray, own: float) -> np.ndarray:
        both = np.zeros((2, 2 + units))
        both[0, 3:], both[1, 2:] = unknown[2:], own / radius
        both[1, :2] = own * np.cos(unknown[1]), own * np.sin(unknown[1])
        return both

    def left(unknown: np.ndarray, own: float) -> np.ndarray:
        found = _accelerations(vehicle, state(unknown, own), steered(vehicle, unknown[0]))
        across = found[1] * np.cos(unknown[1]) - found[0] * np.sin(unknown[1])
        return np.concatenate(([across - own**2 / radius], found[2:]))

    plane = vehicle.plane
    last = np.array([plane.reach[k].sum() + plane.place[plane.unit == k, 0].min() for k in range(units)])
    guess = np.zeros(1 + units)  # of wheels that roll along the circle: the last ones of each unit on its tangent
    guess[0], guess[1] = np.ptp(plane.place[plane.unit == 0, 0]) / radius, -last[0] / radius
    guess[2:] = (last[1:] - last[0]) / radius
    for own in speed * SPEEDS:
        guess = root(left, guess, (own,), tol=1e-12).x
        if np.abs(left(guess, own)).max() > STEADY or np.abs(guess).max() > LARGEST:
            return None
    steer = steered(vehicle, guess[0])
    return SteadyTurn(steer, Start(state(guess, speed), _rolling(vehicle, state(guess, speed), steer)))


def _rolling(vehicle: Braked, state: np.ndarray, steer: np.ndarray) -> np.ndarray:
    """Speeds of turning (W,) of wheels without slip."""
    plane, headings, rates = vehicle.plane, state[0, 2:], state[1, 2:]
    ahead = np.column_stack((np.cos(headings), np.sin(headings)))
    aside = np.column_stack((-ahead[:, 1], ahead[:, 0]))
    centres = state[1, :2] + plane.reach @ (rates[:, None] * aside)
    own = plane.unit
    spun = rates[own, None] * (plane.place[:, :1] * aside[own] - plane.place[:, 1:] * ahead[own])
    course = headings[own] + steer
    along = np.column_stack((np.cos(course), np.sin(course)))
    return ((centres[own] + spun) * along).sum(axis=1) / plane.radius


def _accelerations(vehicle: Braked, state: np.ndarray, steer: np.ndarray) -> np.ndarray:
    """Accelerations (2 + U,) of a vehicle whose wheels roll without brakes."""
    plane, none, turning = vehicle.plane, np.zeros(vehicle.plane.wheels), _rolling(vehicle, state, steer)
    surface, found = np.zeros((plane.wheels, 3)), np.zeros(state.shape[1])
    found[:2] = state[1, 2] * np.array([-state[1, 1], state[1, 0]])
    under_wheels(state, 0.0, plane, vehicle.kind, vehicle.road, surface)
    step_on(
        state.copy(),
        turning,
        none,
        none,
        BLINK,
        steer,
        surface,
        vehicle.slope * 9.81 * BLINK,
        plane,
        vehicle.tables.packed,
        found,
        np.zeros((plane.wheels, REPORTED)),
    )
    return found
