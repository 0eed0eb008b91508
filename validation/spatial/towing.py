"""Cars with trailers compared with closed forms: static loads, small steady turns, and circles without side slip."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.multibody import forces as at
from models.multibody.numbers import GRAVITY, Controls, Handling, TyreParameters
from models.systems.handling.run import SimulatedDrive, drive_run
from models.systems.handling.single_track import steady_turn_gains
from models.vehicles.spatial import SpatialVehicle, hitch_of
from models.vehicles.towing import hitch_load
from validation.spatial.trains import caravan

SMALL_STEER = 2e-5
"""Steer angle (rad) with so little slip that no bristle of the tyres slides."""


@dataclass(frozen=True)
class TurnErrors:
    """Errors of a steady turn against its closed form. yaw_rate : relative error of the yaw rate per steer angle;
    towed_headings : errors of the towed bodies' headings relative to the car (rad per rad of steer)."""

    yaw_rate: float
    towed_headings: np.ndarray


def static_load_error() -> float:
    """Largest relative error of the hitch load and of all axle loads of a car with caravan, against the balance of
    moments."""
    car = Handling(caravan())
    free, (towed,) = car.vehicle, car.vehicle.towed
    loads = [sum(car.held.tyres[tyre.name] for tyre in free.tyres if tyre.axle == i) for i in range(3)]
    loads.append(hitch_load(free, car.held, towed))
    return max(abs(load / lever - 1.0) for load, lever in zip(loads, static_loads(car), strict=True))


def static_loads(towing_car: Handling) -> list[float]:
    """Loads (N) of a car's front and rear axle, of the caravan's axle and of the ball, by the balance of moments.

    About the ball for the caravan; about the front axle for the car, with the caravan's load on the ball.
    """
    free, (towed,) = towing_car.vehicle, towing_car.vehicle.towed
    front, rear, axle = towing_car.given.axles
    weights = np.array(
        [(body.mass * GRAVITY, body.position[0], towed in free.chain(body.name)) for body in free.bodies]
    )
    (w, x, _), hitch = weights[weights[:, 2] == 1.0].T, free.body(hitch_of(towed)).position[0]
    borne = float(w @ (hitch - x)) / (hitch - axle)
    ball = float(w.sum()) - borne
    w, x, _ = weights[weights[:, 2] == 0.0].T
    behind = (float(w @ (front - x)) + ball * (front - hitch)) / (front - rear)
    return [float(w.sum()) + ball - behind, behind, borne, ball]


def towed_turn(
    vehicle: SpatialVehicle, speed: float, change_car: Callable[[Handling], None] | None = None, duration: float = 8.0
) -> TurnErrors:
    """Errors of a steady turn with small slip at a speed (m/s) in MuJoCo, against the closed form.

    One to the left less one to the right: a vehicle without symmetry pulls. change_car : plants a fault in the
    table; duration : s.
    """
    turns = []
    for steer in (SMALL_STEER, -SMALL_STEER):
        car = Handling(replace(vehicle, drags=()), controls=Controls(steer=((0.0, 0.0), (0.5, steer))))
        wanted = steady_turn_gains(car, speed)
        if change_car is not None:
            change_car(car)
        turns.append(drive_run("mujoco", car, speed, duration))
    left, right = (np.array([turn.velocity()[-1, 2], *final_headings(turn)]) for turn in turns)
    yaw, *towed = (left - right) / (2.0 * SMALL_STEER)
    return TurnErrors(float(yaw) / wanted.yaw_gain - 1.0, np.array(towed) - wanted.towed_headings)


def final_headings(manoeuvre: SimulatedDrive) -> list[float]:
    """Final heading (rad) of each towed body relative to the car: the sum of the yaw angles of the hitches between
    them."""
    free = manoeuvre.handling.vehicle
    yaws = {
        name: float(manoeuvre.run.positions[-1, free.coordinates().index((hitch_of(name), "rz"))])
        for name in free.towed
    }
    return [sum(yaws[body_name] for body_name in free.chain(name) if body_name in yaws) for name in free.towed]


def circle_error(steer: float = 0.15, speed: float = 3.0) -> float:
    """Relative error of the angle between caravan and car in a slow turn, against the angle of wheels without side
    slip.

    A rear axle at a wheelbase L behind one that is steered by delta rolls on a circle of R = L / tan(delta); the ball,
    e behind it, on one of sqrt(R^2 + e^2), and the caravan's axle, l behind the ball, touches its own circle.
    """
    car = Handling(replace(caravan(), drags=()), TyreParameters(), Controls(steer=((0.0, 0.0), (2.0, steer))))
    front, rear, axle = car.given.axles
    hitch = car.vehicle.body(hitch_of(car.vehicle.towed[0])).position[0]
    radius, back, bar = (front - rear) / math.tan(steer), rear - hitch, hitch - axle
    wanted = math.atan(back / radius) + math.asin(bar / math.hypot(radius, back))
    (angle,) = final_headings(drive_run("mujoco", car, speed, 8.0))
    return -angle / wanted - 1.0


def give_towed_wheels_car_heading(handling_car: Handling) -> None:
    """Plant a fault: the tyres of towed bodies take the heading of the car."""
    for i in range(len(handling_car.vehicle.tyres)):
        handling_car.tyre_numbers(i)[at.TOWED] = 0.0
