"""A braked box on four springs: closed forms of its wheel loads and its pitch, and runs of it."""

from dataclasses import replace
from functools import cache

import numpy as np

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.controller import ConstantPressures
from models.brake.plane_records import REPORT_SIZE, PlaneMotion
from models.brake.plane_vehicle import GRAVITY
from models.brake.pressure import BrakeChambers
from models.brake.sprung import SprungVehicle, suspended_vehicle
from models.engines.braking_sprung import EngineSprungVehicle
from models.systems.braking.march import BrakedVehicle, BrakingPath, braked_vehicle_on_tyres
from models.tyre.tyre_table import TyreTable
from models.vehicles.spatial import FREEDOMS, Body, SideForce, SpatialVehicle, SpringDamper, Tyre, Vector
from models.vehicles.vehicle_file import load_vehicle

HALF_WHEELBASE, HALF_TRACK, RADIUS = 1.3, 0.7, 0.3
SPRING_STIFFNESS, TYRE_STIFFNESS, SPRING_DAMPING = 3e4, 2e5, 2e3
WHEEL_SPIN_INERTIA = 1.7
INERTIA_TENSOR = ((400.0, 0.0, 0.0), (0.0, 1500.0, 0.0), (0.0, 0.0, 1700.0))
LOCKING_TORQUE = 1e5
"""Torque (N m) that locks a wheel at once."""
SUPPLY = 6.0
"""Supply pressure of the brakes (bar)."""
TORQUE_PER_BAR = 2e4
"""Torque divided by pressure (N m/bar) of brakes with prescribed torques."""


@cache
def box(stiffness_factor: float = 1.0, spin_inertia: float = WHEEL_SPIN_INERTIA) -> SprungVehicle:
    """A box of 1000 kg on four wheels of 30 kg. The stiffness of springs and tyres is multiplied by a factor, at the
    same damping ratio."""
    wheels = {
        f"{x}{y}": (u * HALF_WHEELBASE, v * HALF_TRACK, RADIUS)
        for x, u in (("f", 1.0), ("r", -1.0))
        for y, v in (("l", 1.0), ("r", -1.0))
    }
    upward: Vector = (0.0, 0.0, 1.0)
    return suspended_vehicle(
        SpatialVehicle(
            "box",
            (
                Body("chassis", 1000.0, (0.0, 0.0, 0.55), FREEDOMS, INERTIA_TENSOR),
                *(Body(name, 30.0, point, ("z",)) for name, point in wheels.items()),
            ),
            tuple(
                SpringDamper(
                    name,
                    "chassis",
                    name,
                    point,
                    point,
                    upward,
                    SPRING_STIFFNESS * stiffness_factor,
                    SPRING_DAMPING * stiffness_factor**0.5,
                )
                for name, point in wheels.items()
            ),
            tuple(
                Tyre(name, name, point, "fr".index(name[0]), TYRE_STIFFNESS * stiffness_factor)
                for name, point in wheels.items()
            ),
            (HALF_WHEELBASE, -HALF_WHEELBASE),
            side_forces=tuple(
                SideForce(name, "chassis", (x, y, 0.0), "chassis", 5e4) for name, (x, y, _) in wheels.items()
            ),
        ),
        spin_inertia,
    )


@cache
def car() -> SprungVehicle:
    """The car with 19 degrees of freedom on its suspension, without aerodynamic drag."""
    return suspended_vehicle(replace(load_vehicle("r19_free"), drags=()), WHEEL_SPIN_INERTIA)


def pitch_and_transfer(deceleration: float) -> tuple[float, float]:
    """Pitch (rad, nose down) of the box in steady braking, and the increase (N) of its front axle load from rest.

    About the ground, m a h + m g (h - r) theta = K theta: the contacts go forwards with their wheels. Each axle bears
    K theta / L of it. To first order in theta.
    """
    plane = box().plane
    stiffness = 4.0 * HALF_WHEELBASE**2 / (1.0 / SPRING_STIFFNESS + 1.0 / TYRE_STIFFNESS)
    pitch = plane.mass * deceleration * plane.height / (stiffness - plane.mass * GRAVITY * (plane.height - RADIUS))
    return pitch, stiffness * pitch / plane.wheelbase


def constant_friction(friction_coefficient: float) -> TyreTable:
    """Tyre table in which a sliding wheel has the same friction in every direction, and a rolling wheel has none."""
    slips, angles = np.array([0.0, 0.01, 1.0]), np.array([0.0, 0.01, np.pi / 2.0])
    share_ahead, share_aside = np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.01, 1.0])
    x = friction_coefficient * share_ahead[:, None, None] * np.array([0.0, 1.0, 1.0])
    return TyreTable(angles, slips, np.array([1e3]), x, np.ones((3, 3)), friction_coefficient * share_aside[:, None])


def steady_torques(*brake_torques: float) -> ConstantPressures:
    """Controller that keeps constant brake torques (N m), one for each wheel, in runs of ``braked_vehicle``."""
    return ConstantPressures(np.array(brake_torques) / TORQUE_PER_BAR)


def braked_vehicle(
    sprung_vehicle: SprungVehicle,
    tyre_table: TyreTable,
    engine: str | None = "mujoco",
    steer: float = 0.0,
    time_step: float = 5.5e-3,
    substeps: int = 1,
    gradient: float = TORQUE_PER_BAR,
) -> BrakedVehicle:
    """A vehicle on its suspension on a single surface, with brakes without hysteresis. If ``engine`` is None, the plane
    vehicle without suspension.

    steer : angle of the front wheels (rad); gradient : brake torque divided by pressure (N m/bar).
    """
    brake, plane = Brake(push_out=0.0, release=0.0, rising=gradient, falling=gradient), sprung_vehicle.in_plane()
    zeros = np.zeros(plane.wheels)
    return braked_vehicle_on_tyres(
        plane,
        [tyre_table],
        brakes_of_wheels(*[brake] * plane.wheels),
        BrakeChambers(zeros + 0.03, zeros + 0.02, SUPPLY),
        steer=np.where(np.arange(plane.wheels) < 2, steer, 0.0),
        substeps=substeps,
        sample=time_step,
        engine=None if engine is None else EngineSprungVehicle(engine, sprung_vehicle),
        sprung=None if engine is None else sprung_vehicle,
    )


def remaining_speed(vehicle: BrakedVehicle, stop_path: BrakingPath, duration: float = 2.0) -> float:
    """Largest speed (m/s) of the vehicle or of a wheel's rim during a duration (s) after a stop, with unchanged brake
    torques."""
    rates, report = np.zeros(2 + vehicle.plane.masses.size), np.zeros((REPORT_SIZE, vehicle.plane.wheels))
    motion = PlaneMotion(stop_path.states[-1].copy(), stop_path.turning[-1].copy(), rates, report)
    torques, largest = np.tile(stop_path.torques[-1], (2, 1)), 0.0
    for _ in range(round(duration / vehicle.sample)):
        vehicle.engine.advance(motion, torques, vehicle.sample, vehicle.steer, vehicle.on_road)
        rims = np.abs(motion.turning * vehicle.plane.radius)
        largest = max(largest, float(np.hypot(*motion.state[1, :2])), float(rims.max()))
    return largest
