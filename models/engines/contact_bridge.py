"""Creep forces on the wheels of a rail vehicle as one callback: the code that all engines share.

Each wheel has four coordinates of its own: forward x beside the steady rolling at speed V, lateral y, vertical z
downwards and yaw. From them follow the approach to the rail and the velocity x', y' - V yaw, yaw' at which the wheel
slips, and from these, by the contact kernel, the load and the creep forces. Springs to the frame and masses belong to
the engine. It is the least vehicle on which a callback can be measured, and a pattern for those of more bodies:
positions and rates in, forces added, one compiled function that finds all numbers in one table and enters Python
nowhere.

Speed
    Creepages are the velocity of slip by |V|, or by REGULARISED_SPEED = 0.1 m/s where |V| is less, zero included: a
    wheel at rest is held by friction as by a damper. A wheel that rolls backwards is the mirror image of one that rolls
    forwards; from REGULARISED_SPEED to -REGULARISED_SPEED the two are mixed, so that the forces are continuous through
    V = 0 and have no power of their own.
Steps
    Creep forces damp like G a b C / V by mass: 10^4 1/s at 1 m/s, 10^5 1/s at 0.1 m/s and below. Explicit methods need
    steps shorter than about 2 by that, and a longer one is refused before the run, as friction keeps its nonsense
    small. Implicit ones take steps of the suspension's own motions, with ``force_slopes_by_differences`` for their
    Newton's method.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from models.contact.hertz import by_load
from models.contact.inputs import Array
from models.contact.kernel import (
    BY_APPROACH,
    INPUT_COUNT,
    INPUT_RECORD,
    OUTPUT_COUNT,
    OUTPUT_RECORD,
    grid_table,
    solve_contact,
)
from models.contact.kernel_simplified import distance_table
from models.contact.material import MaterialPair
from models.contact.simplified_theory import solve_normal_contact
from models.contact.undeformed_distance import UndeformedDistance, quadratic
from models.core.errors import InputError, Refused
from models.engines.stability import ALLOWED_GROWTH, LONG_RUN, LinearMatrices, log_growth, longest_stable_step
from models.machine.compiled import njit
from models.machine.records import record, records_at_pointer, size_of
from models.machine.stack import array, at, beyond, doubles, start
from models.rail.wheel_forces import REGULARISED_SPEED

FREEDOM = record("x", "y", "z", "yaw")
"""Coordinates of a wheel, the rates of these, or the forces on them."""
FREEDOMS = size_of(FREEDOM)
Theory = Literal["none", "linear", "fastsim", "simplified"]
HEAD = record("wheels", "speed", "weight", "sunk", "mu", "G", "nu", "curved_x", "curved_y")
"""Header of the table of numbers: count of wheels; speed V (m/s); load (N) and approach (m) at rest; friction
coefficient mu; shear modulus G (Pa); Poisson's ratio nu; curvatures A, B (1/m). The tables of the contact theory
follow."""
HEADER = size_of(HEAD)

THEORIES = get_args(Theory)
HALF_WIDTH = 0.03
"""Half the sides (m) of the area on which the undeformed distance is computed from curvatures."""
OF_POSITION, OF_RATE = np.array([1e-8, 1e-8, 1e-8, 1e-6]), np.array([1e-5, 1e-5, 1e-5, 1e-4])
"""Steps (m, rad; m/s, rad/s) of the finite differences of forces: creepages of about 1e-6."""


@dataclass(frozen=True)
class RailWheels:
    """Rail wheels that roll side by side. Springs and dampers connect each to a frame that moves along the track at
    ``speed`` (m/s).

    count : of wheels; theory : of the contact, as scenes name it, or "none"; cells : per strip, where strips are;
    speed : V (m/s), negative backwards, also zero; load : N, on each wheel at rest; mu : coefficient of friction;
    curvatures : A, B (1/m); distance : undeformed distance of wheel and rail for "simplified", that of the curvatures
    if none is given; mass, inertia : of a wheel (kg, kg m^2); stiffness, damping : to the frame along x, y, z (N/m,
    N s/m) and in yaw (N m, N m s). Raises InputError.
    """

    count: int = 4
    theory: Theory = "fastsim"
    cells: int = 21
    speed: float = 20.0
    load: float = 8e4
    mu: float = 0.3
    curvatures: tuple[float, float] = (1.1, 1.7)
    distance: UndeformedDistance | None = None
    mass: float = 600.0
    inertia: float = 100.0
    stiffness: tuple[float, float, float, float] = (5e6, 5e6, 1e6, 2e6)
    damping: tuple[float, float, float, float] = (1e4, 1e4, 2e4, 1e4)
    pair: MaterialPair = field(default_factory=MaterialPair)

    def __post_init__(self) -> None:
        if isinstance(self.count, bool) or not isinstance(self.count, int) or not 1 <= self.count <= 1000:
            raise InputError("", "count", self.count, "must be a whole number of wheels from 1 to 1000")
        if self.theory not in THEORIES:
            raise InputError("", "theory", self.theory, "is not known", THEORIES)
        for name in ("load", "mass", "inertia"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise InputError("", name, getattr(self, name), "must be above 0")
        if not np.isfinite(self.speed):
            raise InputError("", "speed", self.speed, "must be a finite speed in m/s")
        if self.distance is not None and self.speed < REGULARISED_SPEED:
            skew = np.abs(self.distance.height - self.distance.height[:, ::-1]).max()
            if max(skew, abs(self.distance.x[0] + self.distance.x[-1])) > 1e-9:
                raise InputError(
                    "", "distance", None, f"must be its own mirror image in x below {REGULARISED_SPEED} m/s"
                )

    @property
    def size(self) -> int:
        """Number of coordinates of all wheels, four each."""
        return FREEDOMS * self.count

    @property
    def masses(self) -> Array:
        """Diagonal (size,) of the mass matrix, in kg and kg m^2."""
        return np.tile([self.mass, self.mass, self.mass, self.inertia], self.count)

    @cached_property
    def numbers(self) -> Array:
        """The table that ``forces`` reads: the header, then the numbers of the contact theory."""
        if self.theory == "simplified":
            law = distance_table(self.bodies, self.cells)
        else:
            law = grid_table(self.cells if self.theory == "fastsim" else 0)
        head = [self.count, self.speed, self.load, self.sunk, self.mu, self.pair.G, self.pair.nu, *self.curvatures]
        return np.concatenate((head, law))

    @cached_property
    def sunk(self) -> float:
        """Approach (m) of a wheel and its rail under the load at rest."""
        if self.theory == "simplified":
            return solve_normal_contact(self.bodies, self.pair, load=self.load).approach
        return float(by_load(*self.curvatures, self.load, self.pair).approach)

    @cached_property
    def bodies(self) -> UndeformedDistance:
        """Undeformed distance between a wheel and its rail."""
        return self.distance if self.distance is not None else quadratic(*self.curvatures, HALF_WIDTH, HALF_WIDTH)

    @property
    def sticking(self) -> Array:
        """The table that ``forces`` reads, for the linear theory, whose forces rise most steeply with creepage."""
        return replace(self, theory="linear").numbers

    def state(self, random_seed: int = 8) -> tuple[Array, Array]:
        """Random positions and rates (size,) with creepages about as large as those at which the wheels begin to
        slide."""
        draw = np.random.default_rng(random_seed)
        q = draw.normal(0.0, 1.0, (self.count, FREEDOMS)) * [1e-4, 1e-4, 5e-6, 1e-3]
        v = draw.normal(0.0, 1.0, (self.count, FREEDOMS)) * [0.02, 0.02, 1e-3, 0.5]
        return q.ravel(), v.ravel()


@njit(cache=True, error_model="numpy")
def forces(parameter_table, t, q, v, generalised_forces):
    """Add the forces (N, N m) on all wheels to ``generalised_forces``, for callbacks; all arguments but the time are
    pointers to doubles.

    Not a number where a contact is none that the kernel can answer: the engines stop at that, and say so.
    """
    head = records_at_pointer(parameter_table, 1, HEAD)[0]
    wheels = int(head.wheels)
    places, rates, sums = (
        records_at_pointer(q, wheels, FREEDOM),
        records_at_pointer(v, wheels, FREEDOM),
        records_at_pointer(generalised_forces, wheels, FREEDOM),
    )
    inputs, outputs = doubles(INPUT_COUNT), doubles(OUTPUT_COUNT)
    given, answer = records_at_pointer(inputs, 1, INPUT_RECORD)[0], records_at_pointer(outputs, 1, OUTPUT_RECORD)[0]
    given.shape_x, given.shape_y, given.mu = head.curved_x, head.curved_y, head.mu
    given.G, given.nu = head.G, head.nu
    speed = max(abs(head.speed), REGULARISED_SPEED)
    forwards = min(1.0, max(0.0, 0.5 + 0.5 * head.speed / REGULARISED_SPEED))
    for way in (1.0, -1.0):
        share = forwards if way > 0.0 else 1.0 - forwards
        if share == 0.0:
            continue
        for k in range(wheels):
            place, rate, force = places[k], rates[k], sums[k]
            given.pressing = head.sunk + place.z
            given.xi_x = way * rate.x / speed
            given.xi_y = (rate.y - head.speed * place.yaw) / speed
            given.spin = way * rate.yaw / speed
            solve_contact(BY_APPROACH, inputs, beyond(parameter_table, HEADER), outputs)
            force.x += share * way * answer.fx
            force.y += share * answer.fy
            force.z += share * (head.weight - answer.load)
            force.yaw += share * way * answer.mz


@njit(cache=True, error_model="numpy")
def add_forces(parameter_table, q, v, generalised_forces):
    """Add the forces on all wheels to ``generalised_forces`` as ``forces`` does, with arrays as arguments, for a
    callback from Python."""
    forces(start(parameter_table), 0.0, start(q), start(v), start(generalised_forces))


@njit(cache=True, error_model="numpy")
def set_forces(block_address, t, coordinate_count):
    """Compute the forces on all wheels as ``forces`` does, in one block of doubles at an address, the least that Python
    can pass to compiled code.

    It holds f, q and v (size,) and the numbers; f is cleared before.
    """
    f = at(block_address)
    array(f, (coordinate_count,))[:] = 0.0
    forces(beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f)


@njit(cache=True, error_model="numpy")
def force_slopes_by_differences(parameter_table, q, v, position_factor, rate_factor, force_slopes):
    """Fill ``force_slopes`` (size, size) with derivatives of the forces F on all wheels, by_q dF/dq + by_v dF/dv, by
    central differences, for implicit integrators.

    No wheel feels another, so that one coordinate of all wheels is moved at a time: 16 evaluations, however many
    wheels there are.
    """
    high, low, place, rate = np.empty(q.size), np.empty(q.size), q.copy(), v.copy()
    force_slopes[:] = 0.0
    for i in range(FREEDOMS):
        for moved, by, step in ((place, position_factor, OF_POSITION[i]), (rate, rate_factor, OF_RATE[i])):
            if by == 0.0:
                continue
            kept = moved[i::FREEDOMS].copy()
            high[:], low[:] = 0.0, 0.0
            moved[i::FREEDOMS] = kept + step
            add_forces(parameter_table, place, rate, high)
            moved[i::FREEDOMS] = kept - step
            add_forces(parameter_table, place, rate, low)
            moved[i::FREEDOMS] = kept
            for row in range(q.size):
                force_slopes[row, row - row % FREEDOMS + i] += by * (high[row] - low[row]) / (2.0 * step)


def linearised_wheels(wheels: RailWheels) -> LinearMatrices:
    """Matrices of the wheels linearised about rest, by the linear theory, whose forces rise most steeply with creepage;
    see ``stability``."""
    n, zeros = wheels.size, np.zeros(wheels.size)
    by_place, by_rate = np.zeros((n, n)), np.zeros((n, n))
    if wheels.theory != "none":
        numbers = wheels.sticking
        force_slopes_by_differences(numbers, zeros, zeros, 1.0, 0.0, by_place)
        force_slopes_by_differences(numbers, zeros, zeros, 0.0, 1.0, by_rate)
    stiffness, damping = (np.diag(np.tile(values, wheels.count)) for values in (wheels.stiffness, wheels.damping))
    return np.diag(wheels.masses), damping - by_rate, stiffness - by_place, damping, damping


def check_step(engine: str, wheels: RailWheels, method_name: str, time_step: float, step_count: int = LONG_RUN) -> None:
    """Raise Refused for a step (s) with which a motion of the wheels would grow over the run; the message gives the
    longest stable step.

    MuJoCo's ``discrete`` is implicit in its own springs and dampers, not in forces of a callback: it goes by the limit
    of ``Euler``.
    """
    about, like = linearised_wheels(replace(wheels, count=1)), "Euler" if method_name == "discrete" else method_name
    if log_growth(like, time_step, step_count * time_step, about) > np.log(ALLOWED_GROWTH):
        longest = longest_stable_step(like, time_step, LONG_RUN * time_step, about)
        raise Refused(
            engine,
            f"step {time_step:g} s exceeds the stability limit of {method_name}, {0.999 * longest:.3g} s, for "
            f"wheels at {wheels.speed:g} m/s: shorten it, or take an implicit method",
        )
