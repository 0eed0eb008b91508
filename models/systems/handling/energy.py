"""Energy of a drive, by the rigid bodies' own velocities, and whether its ledger closes."""

import numpy as np

from models.engines.spatial_reference import SpatialReference
from models.multibody import forces as at
from models.multibody.numbers import Handling
from models.systems.handling.run import Drive, joint_travel


def drive_energy(drive: Drive) -> np.ndarray:
    """Energy (m,) of a drive in J: kinetic energy from the rigid bodies' own velocities, and potential energy of
    weights, springs and tyres.
    """
    run = drive.run
    motion = np.array([bodies_energy(drive.handling, q, v) for q, v in zip(run.positions, run.rates, strict=True)])
    return motion + drive.ledger[:, at.POTENTIAL]


def unaccounted(drive: Drive) -> np.ndarray:
    """Energy (m,) in J that does not balance: energy less its initial value and less the work done since, by Simpson's
    rule.

    Rows lie at every second step: the middle one of three belongs to the rule.
    """
    power, run_times, total_energy = drive.power(), drive.run.times, drive_energy(drive)[::2]
    work = np.cumsum((run_times[1] - run_times[0]) / 3.0 * (power[:-2:2] + 4.0 * power[1:-1:2] + power[2::2]))
    return total_energy[1:] - total_energy[0] - work


def bodies_energy(handling: Handling, q: np.ndarray, v: np.ndarray) -> float:
    """Kinetic energy and energy of the weights (J), summed over the bodies. Velocities come from the reference's
    written-out motion, from no engine.
    """
    total, motions = 0.0, SpatialReference(handling.vehicle).motions_of(q, v)
    for body in handling.vehicle.bodies:
        motion = motions[body.name]
        speed, spin = motion.shift @ v, motion.rotation.T @ (motion.turn @ v)
        total += 0.5 * body.mass * speed @ speed + 0.5 * spin @ np.array(body.inertia) @ spin
        total -= body.mass * handling.gravity @ motion.centre
    for element in handling.vehicle.joint_elements:
        total += 0.5 * element.inertia * float(joint_travel(handling, element, v)) ** 2
    return float(total)
