"""Transfer of wheel loads in a settled drive, beside what inertia, spinning wheels and weight that leans ask for.

About the ground, with m and h of the whole vehicle, r its wheels' radius and J their inertia, all over the vehicle,

    sum dN x = -a_x (m h + sum J / r) + m g (h - r) pitch,    sum dN y = -a_y (m h + sum J / r) - m g (h - r) roll

to first order, whatever springs do: contacts go with their wheels, spins slow down or turn with the vehicle.
"""

import numpy as np

from models.multibody.numbers import GRAVITY, Controls, Handling, Tyres
from models.systems.handling.run import Drive
from models.vehicles.free_vehicle import SWAY
from models.vehicles.spatial import SpatialVehicle


def sliding_car(vehicle: SpatialVehicle, mu: float) -> Handling:
    """The vehicle with all wheels locked, which slide with constant friction and so brake at mu g."""
    return Handling(vehicle, Tyres(friction=mu, fixed=tuple(tyre.name for tyre in vehicle.tyres)))


def turning_car(vehicle: SpatialVehicle, steer: float) -> Handling:
    """Controls of a turn: the steer angle (rad) is reached at 0.5 s and then stays."""
    return Handling(vehicle, controls=Controls(steer=((0.0, 0.0), (0.5, steer))))


def load_transfer(drive: Drive) -> np.ndarray:
    """Change of the wheel loads from start to end of a drive, as moments (2,) in N m. The lever arms are the wheels'
    design positions: forward, then to the left."""
    design = np.array([tyre.point[:2] for tyre in drive.handling.vehicle.tyres])
    moments: np.ndarray = (drive["load"][-1] - drive["load"][0]) @ design
    return moments


def asked_moments(drive: Drive, accelerations: np.ndarray) -> np.ndarray:
    """Moments (2,) in N m that ``load_transfer`` should have by the balance of all bodies at accelerations (2,) in
    m/s^2: forward, then to the left."""
    handling, free = drive.handling, drive.handling.vehicle
    masses, heights = np.array([(body.mass, body.position[2]) for body in free.bodies]).T
    radii = np.array([tyre.point[2] for tyre in free.tyres])
    roll, pitch = (drive.run.positions[-1, free.coordinates().index((SWAY, turn))] for turn in ("rx", "ry"))
    spins = sum(
        handling.tyres.spin_inertia / r
        for r, tyre in zip(radii, free.tyres, strict=True)
        if tyre.name not in handling.tyres.fixed
    )
    leaning = GRAVITY * float(masses @ heights - masses.sum() * radii.mean())
    return leaning * np.array([pitch, -roll]) - accelerations * (masses @ heights + spins)


def braked_error(drive: Drive, mu: float) -> float:
    """Relative error of the load transfer between front and rear axle while all wheels slide."""
    return float(load_transfer(drive)[0] / asked_moments(drive, np.array([-mu * GRAVITY, 0.0]))[0] - 1.0)


def turning_error(drive: Drive) -> float:
    """Relative error of the load transfer between the left and right wheels in a steady turn."""
    forward_speed, _, rate = drive.velocity()[-1]
    return float(load_transfer(drive)[1] / asked_moments(drive, np.array([0.0, forward_speed * rate]))[1] - 1.0)
