"""Energy of a simulated drive from the velocities of its bodies, and the energy that its work does not explain."""

import numpy as np

from models.engines.spatial_reference import SpatialReference
from models.multibody import forces as at
from models.multibody.numbers import Handling
from models.systems.handling.run import SimulatedDrive, joint_travel


def drive_energy(simulated_drive: SimulatedDrive) -> np.ndarray:
    """Energy (m,) of a drive in J: kinetic energy from the velocities of all rigid bodies, and potential energy of
    weights, springs and tyres.
    """
    run = simulated_drive.run
    motion = np.array(
        [bodies_energy(simulated_drive.handling, q, v) for q, v in zip(run.positions, run.rates, strict=True)]
    )
    return motion + simulated_drive.ledger[:, at.POTENTIAL]


def unaccounted_energy(simulated_drive: SimulatedDrive) -> np.ndarray:
    """Energy of a drive in J that its work does not explain: energy less its initial value, less the work done since by
    Simpson's rule.

    Values lie at every second step, as the rule takes two steps at a time.
    """
    power, run_times, total_energy = (
        simulated_drive.power(),
        simulated_drive.run.times,
        drive_energy(simulated_drive)[::2],
    )
    work = np.cumsum((run_times[1] - run_times[0]) / 3.0 * (power[:-2:2] + 4.0 * power[1:-1:2] + power[2::2]))
    return total_energy[1:] - total_energy[0] - work


def bodies_energy(handling_model: Handling, q: np.ndarray, v: np.ndarray) -> float:
    """Kinetic energy and gravitational energy of all bodies (J) at positions q and rates v. Velocities come from the
    reference's equations, not from an engine.
    """
    total, motions = 0.0, SpatialReference(handling_model.vehicle).motions_of(q, v)
    for body in handling_model.vehicle.bodies:
        motion = motions[body.name]
        speed, spin = motion.shift @ v, motion.rotation.T @ (motion.turn @ v)
        total += 0.5 * body.mass * speed @ speed + 0.5 * spin @ np.array(body.inertia) @ spin
        total -= body.mass * handling_model.gravity @ motion.centre
    for element in handling_model.vehicle.joint_elements:
        total += 0.5 * element.inertia * float(joint_travel(handling_model, element, v)) ** 2
    return float(total)
