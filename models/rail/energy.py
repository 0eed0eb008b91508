"""Energy balance of a wheelset on rails along its path: stored energies and works.

Stored: kinetic energy, energy of the springs and of gravity (with the vehicle's weight on the axle), and the work done
on the elastic contacts so far, flanges of cones included. Supplied: the work of the drive, which holds the frame at its
speed against the creep forces along the track. Dissipated: in the suspension's dampers, in the contacts' damping and in
creep. Each work is a further state: its power is added up at the stages of RK4 with the weights of RK4, as the path
itself is computed. So the ledger closes to the integrator's order also where creep forces have kinks, at which a curve
through the powers of the path's instants would not."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.contact.inputs import Array
from models.rail.equations import (
    ROLL,
    ROLL_RATE,
    SPIN,
    Y_RATE,
    YAW,
    YAW_RATE,
    Z_RATE,
    WheelsetBody,
    WheelsetEquations,
    WheelsetPath,
    Y,
    Z,
)
from models.rail.wheelset import GRAVITY


@dataclass(frozen=True, eq=False)
class EnergyLedger:
    """Energy balance of a wheelset over time: energies (n,) in J at times (n,) in s; works count from the path's start,
    works done by the wheelset positive."""

    times: Array
    kinetic: Array
    springs: Array
    gravity: Array
    contacts: Array
    drive: Array
    dampers: Array
    contact_damping: Array
    creep: Array

    @cached_property
    def residual(self) -> Array:
        """Residual of the energy balance (n,) in J at each time; 0 at the start."""
        stored = self.kinetic + self.springs + self.gravity + self.contacts
        return stored - stored[0] - (self.drive - self.dampers - self.contact_damping - self.creep)


def energy_ledger(wheelset_equations: WheelsetEquations, wheelset_path: WheelsetPath) -> EnergyLedger:
    """Energy balance along a path computed by RK4, of which every step must be stored."""
    start, step = wheelset_path.states[:-1], np.diff(wheelset_path.times)[:, None]
    works, rates = np.zeros((len(wheelset_path.times), 5)), np.zeros_like(start)
    for stage_fraction, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        rates, powers = rates_and_powers(wheelset_equations, start + stage_fraction * step * rates)
        works[1:] += weight / 6.0 * step * powers
    return EnergyLedger(
        wheelset_path.times, *energies_at_states(wheelset_equations, wheelset_path.states), *works.cumsum(axis=0).T
    )


def rates_and_powers(wheelset_equations: WheelsetEquations, wheelset_states: Array) -> tuple[Array, Array]:
    """Rates (n, 10) of the states, and powers (n, 5) in W whose integrals are the works, in the order of the ledger."""
    rates, contacts = wheelset_equations.at(wheelset_states)
    names = "elastic_power", "fx", "damping_power", "power"
    elastic, forward_force, damping, creep = (-contacts[name].sum(axis=1) for name in names)
    drive, dampers = (
        wheelset_equations.speed * forward_force,
        _spring_energy_and_damping(wheelset_equations.body, wheelset_states)[1],
    )
    return rates, np.column_stack([elastic, drive, dampers, damping, creep])


def energies_at_states(wheelset_equations: WheelsetEquations, wheelset_states: Array) -> tuple[Array, Array, Array]:
    """Energies (n,) in J at wheelset_states (n, 10): kinetic energy, energy of the springs, and potential energy of
    gravity.
    """
    w, body = wheelset_equations.wheelset, wheelset_equations.body
    across = wheelset_states[:, ROLL_RATE] ** 2 + (wheelset_states[:, YAW_RATE] * np.cos(wheelset_states[:, ROLL])) ** 2
    squared_speed = wheelset_states[:, Y_RATE] ** 2 + wheelset_states[:, Z_RATE] ** 2
    kinetic = 0.5 * (w.mass * squared_speed + w.yaw_inertia * across + w.spin_inertia * wheelset_states[:, SPIN] ** 2)
    return (
        kinetic,
        _spring_energy_and_damping(body, wheelset_states)[0],
        -(w.mass * GRAVITY + 2.0 * body.carried_weight) * wheelset_states[:, Z],
    )


def _spring_energy_and_damping(wheelset_body: WheelsetBody, wheelset_states: Array) -> tuple[Array, Array]:
    """Energy stored in the suspension springs (n,) in J, and power dissipated in the dampers (n,) in W."""
    (cr, sr), (cy, sy) = ((np.cos(wheelset_states[:, k]), np.sin(wheelset_states[:, k])) for k in (ROLL, YAW))
    axle = np.array([-sy * cr, cy * cr, sr])
    turning = np.array(
        [cy * wheelset_states[:, ROLL_RATE], sy * wheelset_states[:, ROLL_RATE], wheelset_states[:, YAW_RATE]]
    )
    energy = power = np.zeros(len(wheelset_states))
    for arm in (wheelset_body.half_spacing, -wheelset_body.half_spacing):
        spring_travel, rate = arm * axle, np.cross(turning, arm * axle, axis=0)
        spring_travel[1] += wheelset_states[:, Y] - arm
        spring_travel[2] += wheelset_states[:, Z] - wheelset_body.rest_height
        rate[1] += wheelset_states[:, Y_RATE]
        rate[2] += wheelset_states[:, Z_RATE]
        energy = energy + 0.5 * np.array(wheelset_body.stiffness) @ spring_travel**2
        power = power + np.array(wheelset_body.damping) @ rate**2
    return energy, power
