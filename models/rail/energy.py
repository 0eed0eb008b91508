"""The energy of a wheelset on rails along a path: what it has, what came in and what went out.

Has: kinetic energy, that of the springs, of gravity (with what the vehicle weighs on the axle), and the work done on
the elastic contacts so far, flanges of cones included. Came in: the work of the drive, which holds the frame at its
speed against the creep forces along the track. Went out: in the suspension's dampers, in the contacts' damping and in
creep. Powers are known at the path's instants and added up by cubics, to the fourth order in their distance.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from models.rail.equations import (
    ARM,
    CARRIED,
    DX,
    KX,
    ROLL,
    ROLL_RATE,
    SPIN,
    SUNK,
    Y_RATE,
    YAW,
    YAW_RATE,
    Z_RATE,
    Equations,
    Path,
    Y,
    Z,
)
from models.rail.wheel_forces import DAMPING_POWER, ELASTIC_POWER, FX, POWER
from models.rail.wheelset import GRAVITY


@dataclass(frozen=True, eq=False)
class Ledger:
    """Energies (n,) in J at times (n,) in s; works count from the path's start, those done by the wheelset positive."""

    times: np.ndarray
    kinetic: np.ndarray
    springs: np.ndarray
    gravity: np.ndarray
    contacts: np.ndarray
    drive: np.ndarray
    dampers: np.ndarray
    contact_damping: np.ndarray
    creep: np.ndarray

    @cached_property
    def residual(self) -> np.ndarray:
        """What the sums do not account for (n,), 0 at the start (J)."""
        held = self.kinetic + self.springs + self.gravity + self.contacts
        return held - held[0] - (self.drive - self.dampers - self.contact_damping - self.creep)


def ledger(equations: Equations, path: Path) -> Ledger:
    """The ledger of a path whose every step was kept."""
    contacts, states = path.contacts, path.states
    springs, dampers = _suspension(equations.body, states)
    out = -contacts.sum(axis=1)
    works = {"contacts": out[:, ELASTIC_POWER], "drive": equations.speed * out[:, FX], "dampers": dampers,
             "contact_damping": out[:, DAMPING_POWER], "creep": out[:, POWER]}  # fmt: skip
    w = equations.wheelset
    gravity = -(w.mass * GRAVITY + 2.0 * equations.body[CARRIED]) * states[:, Z]
    return Ledger(path.times, _kinetic(equations, states), springs, gravity,
                  **{name: _work(path.times, power) for name, power in works.items()})  # fmt: skip


def _work(times: np.ndarray, power: np.ndarray) -> np.ndarray:
    return CubicSpline(times, power).antiderivative()(times)


def _kinetic(equations: Equations, states: np.ndarray) -> np.ndarray:
    w = equations.wheelset
    across = states[:, ROLL_RATE] ** 2 + (states[:, YAW_RATE] * np.cos(states[:, ROLL])) ** 2
    moved = states[:, Y_RATE] ** 2 + states[:, Z_RATE] ** 2
    return 0.5 * (w.mass * moved + w.yaw_inertia * across + w.spin_inertia * states[:, SPIN] ** 2)


def _suspension(body: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Energy of the springs (n,) and power into the dampers (n,)."""
    (cr, sr), (cy, sy) = ((np.cos(states[:, k]), np.sin(states[:, k])) for k in (ROLL, YAW))
    axle = np.array([-sy * cr, cy * cr, sr])
    turning = np.array([cy * states[:, ROLL_RATE], sy * states[:, ROLL_RATE], states[:, YAW_RATE]])
    energy = power = np.zeros(len(states))
    for arm in (body[ARM], -body[ARM]):
        way, rate = arm * axle, np.cross(turning, arm * axle, axis=0)
        way[1] += states[:, Y] - arm
        way[2] += states[:, Z] - body[SUNK]
        rate[1] += states[:, Y_RATE]
        rate[2] += states[:, Z_RATE]
        energy = energy + 0.5 * body[KX : KX + 3] @ way**2
        power = power + body[DX : DX + 3] @ rate**2
    return energy, power
