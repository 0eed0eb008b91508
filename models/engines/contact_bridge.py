"""Creep forces on the wheels of a vehicle as one callback: what is the same in every engine.

Each wheel has four coordinates of its own: forward x beside the steady rolling at speed V, lateral y, vertical z
downwards and yaw. From them follow the approach to the rail, the creepages x'/V and y'/V - yaw and the spin yaw'/V,
and from these, by the contact kernel, the load and the creep forces. Springs to the frame and masses belong to the
engine. It is the least vehicle on which a callback can be measured, and a pattern for those of more bodies: positions
and rates in, forces added, one compiled function that finds all numbers in one table and enters Python nowhere.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import carray

from models.compiled import njit
from models.contact.hertz import by_load
from models.contact.inputs import Array
from models.contact.kernel import (
    BY_APPROACH,
    CREEP_X,
    CREEP_Y,
    FRICTION,
    FX,
    FY,
    INPUTS,
    MODULUS,
    MZ,
    NORMAL,
    OUTPUTS,
    POISSON,
    PRESSING,
    SHAPE_X,
    SHAPE_Y,
    TURNING,
    contact,
    net,
)
from models.contact.material import Pair
from models.contact.stack import at, beyond, doubles, start
from models.errors import InputError

X, Y, Z, YAW = range(4)
FREEDOMS = 4
WHEELS, SPEED, WEIGHT, SUNK, MU, SHEAR, NU, CURVED_X, CURVED_Y, HEADER = range(10)
"""Head of the table: count; V (m/s); load (N) and approach (m) at rest; mu; G (Pa); nu; A, B (1/m). Then a net."""

OF_POSITION, OF_RATE = np.array([1e-8, 1e-8, 1e-8, 1e-6]), np.array([1e-5, 1e-5, 1e-5, 1e-4])
"""Steps (m, rad; m/s, rad/s) by which forces are differentiated: creepages of about 1e-6."""


@dataclass(frozen=True)
class Wheels:
    """Wheels that roll side by side, each on springs and dampers to a frame that moves on at ``speed``.

    count : of wheels; cells : per strip of FASTSIM, 0 for the linear theory, None for no contact at all; speed : m/s;
    load : N, on each wheel at rest; mu : coefficient of friction; curvatures : A, B (1/m); mass, inertia : of a wheel
    (kg, kg m^2); stiffness, damping : to the frame along x, y, z (N/m, N s/m) and in yaw (N m, N m s).
    """

    count: int = 4
    cells: int | None = 21
    speed: float = 20.0
    load: float = 8e4
    mu: float = 0.3
    curvatures: tuple[float, float] = (1.1, 1.7)
    mass: float = 600.0
    inertia: float = 100.0
    stiffness: tuple[float, float, float, float] = (5e6, 5e6, 1e6, 2e6)
    damping: tuple[float, float, float, float] = (1e4, 1e4, 2e4, 1e4)
    pair: Pair = field(default_factory=Pair)

    def __post_init__(self) -> None:
        if isinstance(self.count, bool) or not isinstance(self.count, int) or not 1 <= self.count <= 1000:
            raise InputError("", "count", self.count, "must be a whole number of wheels from 1 to 1000")
        for name in ("speed", "load", "mass", "inertia"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise InputError("", name, getattr(self, name), "must be above 0")

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return FREEDOMS * self.count

    @property
    def masses(self) -> Array:
        """Diagonal of the mass matrix (size,)."""
        return np.tile([self.mass, self.mass, self.mass, self.inertia], self.count)

    @cached_property
    def numbers(self) -> Array:
        """The table that ``forces`` reads: head and net."""
        rest = by_load(*self.curvatures, self.load, self.pair)
        head = [self.count, self.speed, self.load, float(rest.approach), self.mu, self.pair.G, self.pair.nu,
                *self.curvatures]  # fmt: skip
        return np.concatenate((head, net(self.cells or 0)))

    def state(self, seed: int = 8) -> tuple[Array, Array]:
        """Positions and rates (size,) with creepages about those at which the wheels begin to slide."""
        draw = np.random.default_rng(seed)
        q = draw.normal(0.0, 1.0, (self.count, FREEDOMS)) * [1e-4, 1e-4, 5e-6, 1e-3]
        v = draw.normal(0.0, 1.0, (self.count, FREEDOMS)) * [0.02, 0.02, 1e-3, 0.5]
        return q.ravel(), v.ravel()


@njit(cache=True, error_model="numpy")
def forces(numbers, q, v, f):
    """Add the forces (N, N m) on all wheels to ``f``; all four are pointers to doubles.

    Not a number where a contact is none that the kernel can answer: the engines stop at that, and say so.
    """
    head = carray(numbers, (HEADER,))
    wheels = int(head[WHEELS])
    position, rate = carray(q, (FREEDOMS * wheels,)), carray(v, (FREEDOMS * wheels,))
    force = carray(f, (FREEDOMS * wheels,))
    given, answer = doubles(INPUTS), doubles(OUTPUTS)
    own, out = carray(given, (INPUTS,)), carray(answer, (OUTPUTS,))
    own[SHAPE_X], own[SHAPE_Y], own[FRICTION] = head[CURVED_X], head[CURVED_Y], head[MU]
    own[MODULUS], own[POISSON] = head[SHEAR], head[NU]
    for k in range(0, FREEDOMS * wheels, FREEDOMS):
        own[PRESSING] = head[SUNK] + position[k + Z]
        own[CREEP_X] = rate[k + X] / head[SPEED]
        own[CREEP_Y] = rate[k + Y] / head[SPEED] - position[k + YAW]
        own[TURNING] = rate[k + YAW] / head[SPEED]
        contact(BY_APPROACH, given, beyond(numbers, HEADER), answer)
        force[k + X] += out[FX]
        force[k + Y] += out[FY]
        force[k + Z] += head[WEIGHT] - out[NORMAL]
        force[k + YAW] += out[MZ]


@njit(cache=True, error_model="numpy")
def add_forces(numbers, q, v, f):
    """``forces`` of arrays, for a callback that a Python function makes."""
    forces(start(numbers), start(q), start(v), start(f))


@njit(cache=True, error_model="numpy")
def set_forces(block, size):
    """``forces`` in one block of doubles at an address, the least that Python can hand over.

    It holds f, q and v (size,) and the numbers; f is cleared before.
    """
    f = at(block)
    carray(f, (size,))[:] = 0.0
    forces(beyond(f, 3 * size), beyond(f, size), beyond(f, 2 * size), f)


@njit(cache=True, error_model="numpy")
def slopes(numbers, q, v, by_q, by_v, found):
    """Fill ``found`` (size, size) with by_q dF/dq + by_v dF/dv, central differences; for implicit integrators.

    No wheel feels another, so that one coordinate of all wheels is moved at a time: 16 evaluations, however many
    wheels there are.
    """
    high, low, place, rate = np.empty(q.size), np.empty(q.size), q.copy(), v.copy()
    found[:] = 0.0
    for i in range(FREEDOMS):
        for moved, by, step in ((place, by_q, OF_POSITION[i]), (rate, by_v, OF_RATE[i])):
            if by == 0.0:
                continue
            kept = moved[i::FREEDOMS].copy()
            high[:], low[:] = 0.0, 0.0
            moved[i::FREEDOMS] = kept + step
            add_forces(numbers, place, rate, high)
            moved[i::FREEDOMS] = kept - step
            add_forces(numbers, place, rate, low)
            moved[i::FREEDOMS] = kept
            for row in range(q.size):
                found[row, row - row % FREEDOMS + i] += by * (high[row] - low[row]) / (2.0 * step)
