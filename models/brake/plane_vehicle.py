"""Parameters of a vehicle in the plane for compiled functions: units, wheels, and how wheel loads follow
accelerations.
"""

import math
from typing import NamedTuple

import numpy as np

from models.core.errors import InputError
from models.core.strict import Strict, quantity

GRAVITY = 9.81
"""Gravitational acceleration (m/s^2)."""


class TruckAxle(Strict):
    """An axle with two wheels, at one position along its unit."""

    x: float = quantity("m", "ahead of the unit's centre of mass", signed=True)
    track: float = quantity("m", "distance of the two wheels' centres")
    radius: float = quantity("m", "of a wheel")
    spin_inertia: float = quantity("kg m^2", "of a wheel about its axle")
    roll_share: float = quantity("", "share of the load transfer by lateral acceleration", zero=True)


class Truck(Strict):
    """A two-axle vehicle whose wheel loads follow its accelerations without delay.

    Source of the form: the paper's four-wheel vehicle, whose load transfer has its front and rear share as input.
    """

    mass: float = quantity("kg", "of the vehicle")
    yaw_inertia: float = quantity("kg m^2", "about the vertical through its centre of mass")
    height: float = quantity("m", "of the centre of mass", zero=True)
    front: TruckAxle
    rear: TruckAxle

    @property
    def wheelbase(self) -> float:
        """Distance between the axles (m)."""
        return self.front.x - self.rear.x


class PlaneVehicle(NamedTuple):
    """Parameters of a vehicle in the plane, of U units and W wheels, for compiled functions.

    masses, inertias (U,); arm_lengths (U, U): see ``plane_chain``; unit, load_unit (W,): of each wheel, the group being
    the unit whose acceleration moves its load; place (W, 2): m, in its unit's axes; radius, spin_inertia (W,): m, kg
    m^2;
    static_loads (W,): N; load_per_x_acceleration, load_per_y_acceleration (W,): change of load by the group's
    acceleration, N s^2/m; has_prescribed_hook: 1 if the first two coordinates are prescribed; jackknife_angle: rad,
    angle of a hinge beyond which a train jackknifes; units
    (U,): their numbers, of one alone as a tuple, whose size compiled functions know beforehand, so that none of them
    counts units where there is no trailer.
    """

    masses: np.ndarray
    inertias: np.ndarray
    arm_lengths: np.ndarray
    unit: np.ndarray
    load_unit: np.ndarray
    place: np.ndarray
    radius: np.ndarray
    spin_inertia: np.ndarray
    static_loads: np.ndarray
    load_per_x_acceleration: np.ndarray
    load_per_y_acceleration: np.ndarray
    has_prescribed_hook: int
    jackknife_angle: float = math.inf
    units: np.ndarray | tuple[int] = (0,)

    @property
    def wheels(self) -> int:
        """Number of wheels."""
        return self.unit.size


def plane_of_truck(truck: Truck, with_load_transfer: bool = True) -> PlaneVehicle:
    """``PlaneVehicle`` of a two-axle vehicle; without ``with_load_transfer`` its wheel loads stay at their static
    values.
    """
    check_wheels(truck, truck.mass)
    zeros = np.zeros(4, dtype=np.int64)
    wheel_positions, radius, spin, static, by_x, by_y = wheel_fields_of_plane(truck, with_load_transfer)
    return PlaneVehicle(
        np.array([truck.mass]),
        np.array([truck.yaw_inertia]),
        np.zeros((1, 1)),
        zeros,
        zeros.copy(),
        wheel_positions,
        radius,
        spin,
        static,
        by_x,
        by_y,
        0,
    )


def check_wheels(truck: Truck, mass: float) -> None:
    """Refuse a vehicle whose mass (kg) is at most its wheels' smallest possible mass: J / r^2 each, as if all mass were
    in the rim.
    """
    least_mass = sum(2.0 * axle.spin_inertia / axle.radius**2 for axle in (truck.front, truck.rear))
    if mass <= least_mass:
        allowed = f"must be above {least_mass:.4g} kg: J / r^2 of its wheels, which cannot be lighter"
        raise InputError("", "mass", mass, allowed)


def wheel_fields_of_plane(truck: Truck, with_load_transfer: bool) -> tuple[np.ndarray, ...]:
    """Fields place (4, 2), radius, spin, static, by_x and by_y (4,) of ``PlaneVehicle`` for the four wheels of a
    two-axle body.
    """
    if not truck.front.x > 0.0 > truck.rear.x:
        raise InputError("", "rear.x", truck.rear.x, "must be below 0, and front.x above")
    shares = truck.front.roll_share + truck.rear.roll_share
    if with_load_transfer and abs(shares - 1.0) > 1e-9:
        raise InputError("", "roll_share", shares, "of both axles must add up to 1")
    front, rear, side = truck.front, truck.rear, np.array([1.0, -1.0, 1.0, -1.0])

    def by_wheel(parameter_name: str) -> np.ndarray:
        """One value per wheel (4,) of a parameter that belongs to its axle."""
        return np.repeat([getattr(front, parameter_name), getattr(rear, parameter_name)], 2)

    share = np.repeat([-rear.x / truck.wheelbase, front.x / truck.wheelbase], 2)
    pitch = np.repeat([-1.0, 1.0], 2) * truck.mass * truck.height / (2.0 * truck.wheelbase)
    roll = -side * by_wheel("roll_share") * truck.mass * truck.height / by_wheel("track")
    wheel_positions = np.column_stack((by_wheel("x"), side * by_wheel("track") / 2.0))
    static = truck.mass * GRAVITY * share / 2.0
    return (
        wheel_positions,
        by_wheel("radius"),
        by_wheel("spin_inertia"),
        static,
        pitch * with_load_transfer,
        roll * with_load_transfer,
    )


PAPER_TRUCK = Truck(
    mass=5640.0,
    yaw_inertia=25000.0,
    height=1.2,
    front=TruckAxle(x=1.42, track=1.9, radius=0.5, spin_inertia=13.35, roll_share=0.3),
    rear=TruckAxle(x=-2.19, track=1.8, radius=0.5, spin_inertia=27.0, roll_share=0.7),
)
"""The paper's unladen truck of two axles as far as its printed data can be read.

Firm: radius, the shares 0.3 and 0.7, the total weight to 15 %. Guessed from a damaged print: yaw inertia, spin
inertias (the rear one that of twin wheels), height, tracks, wheelbase 3.61 m. Chosen: the place of the centre of mass,
by axle loads of 33.6 and 21.8 kN."""
