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
    Body,
    Equations,
    WheelsetPath,
    Y,
    Z,
)
from models.rail.wheelset import GRAVITY


@dataclass(frozen=True, eq=False)
class Ledger:
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


def energy_ledger(equations: Equations, path: WheelsetPath) -> Ledger:
    """Energy balance along a path computed by RK4, of which every step must be stored."""
    start, step = path.states[:-1], np.diff(path.times)[:, None]
    works, rates = np.zeros((len(path.times), 5)), np.zeros_like(start)
    for stage_fraction, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        rates, powers = rates_and_powers(equations, start + stage_fraction * step * rates)
        works[1:] += weight / 6.0 * step * powers
    return Ledger(path.times, *energies_at_states(equations, path.states), *works.cumsum(axis=0).T)


def rates_and_powers(equations: Equations, states: Array) -> tuple[Array, Array]:
    """Rates (n, 10) of the states, and powers (n, 5) in W whose integrals are the works, in the order of the ledger."""
    rates, contacts = equations.at(states)
    names = "elastic_power", "fx", "damping_power", "power"
    elastic, forward_force, damping, creep = (-contacts[name].sum(axis=1) for name in names)
    drive, dampers = equations.speed * forward_force, _spring_energy_and_damping(equations.body, states)[1]
    return rates, np.column_stack([elastic, drive, dampers, damping, creep])


def energies_at_states(equations: Equations, states: Array) -> tuple[Array, Array, Array]:
    """Energies (n,) in J at states (n, 10): kinetic energy, energy of the springs, and potential energy of gravity."""
    w, body = equations.wheelset, equations.body
    across = states[:, ROLL_RATE] ** 2 + (states[:, YAW_RATE] * np.cos(states[:, ROLL])) ** 2
    squared_speed = states[:, Y_RATE] ** 2 + states[:, Z_RATE] ** 2
    kinetic = 0.5 * (w.mass * squared_speed + w.yaw_inertia * across + w.spin_inertia * states[:, SPIN] ** 2)
    return (
        kinetic,
        _spring_energy_and_damping(body, states)[0],
        -(w.mass * GRAVITY + 2.0 * body.carried_weight) * states[:, Z],
    )


def _spring_energy_and_damping(body: Body, states: Array) -> tuple[Array, Array]:
    """Energy stored in the suspension springs (n,) in J, and power dissipated in the dampers (n,) in W."""
    (cr, sr), (cy, sy) = ((np.cos(states[:, k]), np.sin(states[:, k])) for k in (ROLL, YAW))
    axle = np.array([-sy * cr, cy * cr, sr])
    turning = np.array([cy * states[:, ROLL_RATE], sy * states[:, ROLL_RATE], states[:, YAW_RATE]])
    energy = power = np.zeros(len(states))
    for arm in (body.half_spacing, -body.half_spacing):
        spring_travel, rate = arm * axle, np.cross(turning, arm * axle, axis=0)
        spring_travel[1] += states[:, Y] - arm
        spring_travel[2] += states[:, Z] - body.rest_height
        rate[1] += states[:, Y_RATE]
        rate[2] += states[:, Z_RATE]
        energy = energy + 0.5 * np.array(body.stiffness) @ spring_travel**2
        power = power + np.array(body.damping) @ rate**2
    return energy, power
