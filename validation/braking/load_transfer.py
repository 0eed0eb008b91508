"""Load transfer between wheels in steady braking or a steady turn, against the balance of moments.

About the ground, with m and h of the whole vehicle, r its wheels' radius and J their inertia, all over the vehicle,

    sum dN x = -a_x (m h + sum J / r) + m g (h - r) pitch,    sum dN y = -a_y (m h + sum J / r) - m g (h - r) roll

to first order, whatever springs do: contacts go with their wheels, spins slow down or turn with the vehicle.
"""

import numpy as np

from models.multibody.numbers import GRAVITY, Controls, Handling, TyreParameters
from models.systems.handling.run import SimulatedDrive
from models.vehicles.free_vehicle import SWAY
from models.vehicles.spatial import SpatialVehicle


def sliding_car(vehicle: SpatialVehicle, friction_coefficient: float) -> Handling:
    """The vehicle with all wheels locked, which slide with constant friction mu and so brake at mu g."""
    return Handling(
        vehicle, TyreParameters(friction=friction_coefficient, fixed=tuple(tyre.name for tyre in vehicle.tyres))
    )


def turning_car(vehicle: SpatialVehicle, steer: float) -> Handling:
    """The vehicle with controls of a turn: the steer angle (rad) is reached at 0.5 s and then stays constant."""
    return Handling(vehicle, controls=Controls(steer=((0.0, 0.0), (0.5, steer))))


def load_transfer(manoeuvre: SimulatedDrive) -> np.ndarray:
    """Moments (2,) in N m of the change of the wheel loads from start to end of a drive. The lever arms are the wheels'
    design positions: forward, then to the left."""
    design = np.array([tyre.point[:2] for tyre in manoeuvre.handling.vehicle.tyres])
    moments: np.ndarray = (manoeuvre["load"][-1] - manoeuvre["load"][0]) @ design
    return moments


def expected_moments(manoeuvre: SimulatedDrive, accelerations: np.ndarray) -> np.ndarray:
    """Moments (2,) in N m that ``load_transfer`` should return, by the balance of all bodies at accelerations (2,) in
    m/s^2: forward, then to the left."""
    handling, vehicle = manoeuvre.handling, manoeuvre.handling.vehicle
    masses, heights = np.array([(body.mass, body.position[2]) for body in vehicle.bodies]).T
    radii = np.array([tyre.point[2] for tyre in vehicle.tyres])
    roll, pitch = (manoeuvre.run.positions[-1, vehicle.coordinates().index((SWAY, turn))] for turn in ("rx", "ry"))
    spins = sum(
        handling.tyres.spin_inertia / r
        for r, tyre in zip(radii, vehicle.tyres, strict=True)
        if tyre.name not in handling.tyres.fixed
    )
    leaning = GRAVITY * float(masses @ heights - masses.sum() * radii.mean())
    return leaning * np.array([pitch, -roll]) - accelerations * (masses @ heights + spins)


def braked_error(manoeuvre: SimulatedDrive, friction_coefficient: float) -> float:
    """Relative error of the load transfer between front and rear axle while all wheels slide."""
    return float(
        load_transfer(manoeuvre)[0] / expected_moments(manoeuvre, np.array([-friction_coefficient * GRAVITY, 0.0]))[0]
        - 1.0
    )


def turning_error(manoeuvre: SimulatedDrive) -> float:
    """Relative error of the load transfer between the left and right wheels in a steady turn."""
    forward_speed, _, rate = manoeuvre.velocity()[-1]
    return float(
        load_transfer(manoeuvre)[1] / expected_moments(manoeuvre, np.array([0.0, forward_speed * rate]))[1] - 1.0
    )
