"""A braking car with a caravan, both on their suspensions: closed forms of deceleration and loads, and runs.

The closed forms are statics of two bodies on a ball, with the forces of inertia of a steady deceleration. They take
masses, places and nothing else from the vehicle's description, and share no code with what computes the runs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from models.brake.plane_vehicle import GRAVITY
from models.brake.sprung import SprungVehicle
from models.multibody import forces as at
from models.multibody.numbers import Handling
from models.systems.braking.march import BrakingPath
from models.vehicles.spatial import SpatialVehicle, hitch_of
from validation.braking.plain_sprung import towing_car
from validation.braking.sprung_box import (
    LOCKING_TORQUE,
    WHEEL_SPIN_INERTIA,
    braked_vehicle,
    constant_friction,
    steady_torques,
)

LOCKED_FRICTION, CARAVAN_FRICTION = 0.05, 0.1
"""Friction coefficient where all wheels lock, and where the caravan alone brakes."""
SETTLED_SHARE = 0.4
"""Last share of a run over which deceleration and loads are averaged; springs and hitch have come to rest before."""


@dataclass(frozen=True)
class PulledCaravan:
    """Results of a train of which only the caravan brakes: deceleration (m/s^2), load (N) of the caravan's axle, and
    force (N) by which the caravan pulls at the tow ball."""

    deceleration: float
    axle_load: float
    ball_force: float


def locked_stop_and_closed_form(speed: float = 1.5) -> tuple[float, float]:
    """Stopping distance (m) of the train from a speed (m/s) with all wheels locked, and its closed form v^2 / (2 mu
    g)."""
    path = braked_vehicle(towing_car(), constant_friction(LOCKED_FRICTION)).run(
        steady_torques(*6 * (LOCKING_TORQUE,)), speed
    )
    return float(path.states[-1, 0, 0]), speed**2 / (2.0 * LOCKED_FRICTION * GRAVITY)


def caravan_closed_form() -> PulledCaravan:
    """Closed form of deceleration, axle load and ball force of a train of which only the caravan brakes, from moments
    about the ball and the train's momentum.

    With N under its axle l behind the ball, its mass m2 c behind and d above that, the ball h above the road, and a
    deceleration a = mu N / M, M all masses and what the car's rolling wheels count for,

        l N + h mu N + d m2 a = c m2 g.
    """
    vehicle = towing_car().handling.given
    (name,) = vehicle.towed
    car, behind = _mass(vehicle, None), _mass(vehicle, name)
    hitch, axle = np.array(vehicle.body(hitch_of(name)).position), vehicle.axles[2]
    rolling = sum(WHEEL_SPIN_INERTIA / tyre.point[2] ** 2 for tyre in vehicle.tyres if tyre.axle < 2)
    total_mass = car[0] + behind[0] + rolling
    back, height_of_load = hitch[0] - behind[1], behind[2] - hitch[2]
    arm = hitch[0] - axle + CARAVAN_FRICTION * (hitch[2] + height_of_load * behind[0] / total_mass)
    load = back * behind[0] * GRAVITY / arm
    slowing = CARAVAN_FRICTION * load / total_mass
    return PulledCaravan(slowing, load, (car[0] + rolling) * slowing)


def _mass(vehicle: SpatialVehicle, trailer_name: str | None) -> tuple[float, float, float]:
    """Mass (kg) of the car or of its trailer, and the position (m) of its centre of mass: forward, and above the
    road."""
    bodies = [body for body in vehicle.bodies if vehicle.towed_under(body.name) == trailer_name]
    masses = np.array([body.mass for body in bodies])
    x, _, z = masses @ np.array([body.position for body in bodies]) / masses.sum()
    return float(masses.sum()), float(x), float(z)


def caravan_run(plant_fault: Callable[[Handling], None] | None = None, duration: float = 4.0) -> PulledCaravan:
    """Deceleration, axle load and ball force by a run in MuJoCo of a train of which only the caravan brakes, its wheels
    locked. plant_fault: function that changes the parameter table."""
    vehicle = towing_car() if plant_fault is None else towing_car.__wrapped__()
    if plant_fault is not None:
        plant_fault(vehicle.handling)
    path = braked_vehicle(vehicle, constant_friction(CARAVAN_FRICTION)).run(
        steady_torques(0.0, 0.0, 0.0, 0.0, LOCKING_TORQUE, LOCKING_TORQUE), 8.0, duration
    )
    late = slice(-int(SETTLED_SHARE * len(path.times)), None)
    late_times, speeds = path.times[late], path.states[late, 1, 0]
    slowing = float(speeds[0] - speeds[-1]) / float(late_times[-1] - late_times[0])
    load = float(path.reports.load[late, 4:].sum(axis=1).mean())
    return PulledCaravan(slowing, load, _ball_force(vehicle, path, late, slowing))


def _ball_force(vehicle: SprungVehicle, stop_path: BrakingPath, late_samples: slice, deceleration: float) -> float:
    """Longitudinal force (N) at the tow ball from the caravan's balance: tyre drag minus mass times deceleration."""
    mass, _, _ = _mass(vehicle.handling.given, vehicle.handling.given.towed[0])
    return -float(stop_path.reports.force_x[late_samples, 4:].sum(axis=1).mean()) - mass * deceleration


def plant_brakes_on_car(handling_car: Handling) -> None:
    """Plant a fault in a vehicle: brake forces of the caravan's wheels act on the car's body instead of the
    caravan's."""
    for i in range(4, len(handling_car.vehicle.tyres)):
        handling_car.tyre_numbers(i)[at.CARRYING] = handling_car.tyre_numbers(0)[at.CARRYING]


@cache
def caravan_errors() -> PulledCaravan:
    """Relative differences between the simulated train of which only the caravan brakes and its closed form."""
    return relative_difference(caravan_run(), caravan_closed_form())


def relative_difference(measured_pull: PulledCaravan, expected_pull: PulledCaravan) -> PulledCaravan:
    """Relative difference of each quantity: the run's value divided by the expected value, minus 1."""
    return PulledCaravan(
        measured_pull.deceleration / expected_pull.deceleration - 1.0,
        measured_pull.axle_load / expected_pull.axle_load - 1.0,
        measured_pull.ball_force / expected_pull.ball_force - 1.0,
    )
