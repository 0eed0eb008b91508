"""One wheel at a frozen speed under the five-phase controller: its limit cycle, with every switch located.

The vehicle's speed v stays, the wheel obeys J w' = r F(s) - T, and pressure rises and falls at the rates of the phases,
so that the controller is the continuous one of its author: phases end when r w' meets its threshold, not at samples.
Torque between two switches is linear but for the corners of the brake's loop; steps end there too. ``sampled`` is the
same wheel under the same controller as it runs, by samples.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.brake.brake import Brake, of_wheels, torque
from models.brake.controller import SAMPLE, Sample
from models.brake.controllers.five_phase import FivePhase, end_of, rate
from models.brake.wheel_step import node_force, wheel_step
from models.core.errors import InputError, RunFailed
from models.machine.compiled import njit
from models.tyre.tyre_table import TyreTable, place, stacked

LONGEST_PHASE = 1.0
"""Time (s) after which a phase is taken never to end."""
CLOSED = 1e-9
"""Relative change of slip and torque from one cycle to the next one at which it is the limit cycle."""


PRESSURE, TORQUE, TURNING, TIME, IMPULSE = range(5)
"""What a wheel's state holds: bar, N m, rad/s, s, and the integral of the tyre's force over that time (N s)."""
MET, BACK, LOCKS, ENDLESS = range(4)
"""How a phase ends: the rim's acceleration is at its level; it has fallen to the other one, as phase 2 may; else it
does not end."""
RELEASE, CLIMB, SLOW = 1, 2, 5
"""Phases in which pressure falls, in which the wheel gains speed, and that follows one in which it does so no more."""


@dataclass(frozen=True, eq=False)
class Frozen:
    """A wheel with its load (N), radius (m), inertia (kg m^2) and brake, on a tyre table, at a speed (m/s)."""

    speed: float
    load: float
    radius: float
    inertia: float
    brake: Brake
    tyre: TyreTable

    def __post_init__(self) -> None:
        for name in ("speed", "load", "radius", "inertia"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise InputError("", name, getattr(self, name), "must be above 0")

    @property
    def peak(self) -> float:
        """Largest force (N) of the tyre."""
        *_, grip, slips, mu_x = self.packed
        return max(node_force(k, grip, mu_x) for k in range(slips.size))

    @cached_property
    def packed(self) -> tuple:
        """As compiled functions take it: speed, radius, inertia, brakes, grip, slips, mu_x."""
        tables, (j, q) = stacked([self.tyre]), place(self.tyre.loads, self.load)
        grip = (0, 0, 0.0, 0, 0.0, int(j), float(q), float(self.load))
        return self.speed, self.radius, self.inertia, of_wheels(self.brake), grip, tables.slips, tables.mu_x

    def rolling(self) -> np.ndarray:
        """State (5,) of a wheel that rolls without torque, at time 0."""
        return np.array([0.0, 0.0, self.speed / self.radius, 0.0, 0.0])


@njit(cache=True, error_model="numpy")
def rim(state, wheel):
    """Acceleration (m/s^2) of the wheel's rim."""
    speed, radius, inertia, _, grip, slips, mu_x = wheel
    slip = min(max(1.0 - radius * state[TURNING] / speed, 0.0), 1.0)
    k, share = place(slips, slip)
    low, high = node_force(k, grip, mu_x), node_force(k + 1, grip, mu_x)
    return radius * (radius * (low + share * (high - low)) - state[TORQUE]) / inertia


@njit(cache=True, error_model="numpy")
def go_on(state, rate, time, wheel, after):
    """Fill ``after`` with the state after a time (s) in which pressure moves at a rate (bar/s) and meets no corner."""
    speed, radius, inertia, brakes, grip, slips, mu_x = wheel
    after[PRESSURE] = max(state[PRESSURE] + rate * time, 0.0)
    after[TORQUE] = torque(0, after[PRESSURE], state[TORQUE], brakes)
    after[TURNING], force, _, _ = wheel_step(
        speed, speed, state[TURNING], state[TORQUE], after[TORQUE], time, radius, inertia, grip, slips, mu_x
    )
    after[TIME], after[IMPULSE] = state[TIME] + time, state[IMPULSE] + time * force


@njit(cache=True, error_model="numpy")
def corner(state, rate, brakes):
    """Time (s) to the next corner of the brake's loop, or until there is no pressure; infinite if there is none."""
    first = math.inf
    if rate > 0.0:
        first = (brakes.push_out[0] + state[TORQUE] / brakes.rising[0] - state[PRESSURE]) / rate
        return first if first > 1e-12 else math.inf
    if rate < 0.0:
        for p in (brakes.release[0] + state[TORQUE] / brakes.falling[0], brakes.release[0], 0.0):
            time = (p - state[PRESSURE]) / rate
            if time > 1e-12:
                first = min(first, time)
    return first


@njit(cache=True, error_model="numpy")
def ended(state, sign, level, back, wheel):
    """MET where sign (rim's acceleration - level) is 0 or more, BACK where it is at most ``back`` (m/s^2), else -1."""
    now = rim(state, wheel)
    return MET if sign * (now - level) >= 0.0 else BACK if now <= back else -1


@njit(cache=True, error_model="numpy")
def phase(state, rate, sign, level, back, step, wheel):
    """Move a state on at a rate of pressure (bar/s), by steps (s), until it has ``ended``; how it ended.

    A wheel that locks while pressure falls turns again later; another one does not.
    """
    after, began, end = np.empty(5), state[TIME], ended(state, sign, level, back, wheel)
    while end < 0:
        time = min(step, corner(state, rate, wheel[3]))
        go_on(state, rate, time, wheel, after)
        end = ended(after, sign, level, back, wheel)
        if end >= 0:
            low, high = 0.0, time
            while high - low > 1e-15:
                middle = 0.5 * (low + high)
                go_on(state, rate, middle, wheel, after)
                if ended(after, sign, level, back, wheel) >= 0:
                    high = middle
                else:
                    low = middle
            go_on(state, rate, high, wheel, after)
        state[:] = after
        if end < 0 and not (state[TURNING] > 0.0 or rate < 0.0):
            return LOCKS
        if end < 0 and state[TIME] - began > LONGEST_PHASE:
            return ENDLESS
    return end


@dataclass(frozen=True)
class Cycle:
    """A limit cycle: period (s), durations (5,) of phases 1 to 5 (s), mean force by the tyre's largest one, and the
    slips (6,) at the start of every phase and at the end."""

    period: float
    durations: tuple[float, ...]
    utilisation: float
    slips: tuple[float, ...]


def limit_cycle(frozen: Frozen, controller: FivePhase, step: float = 2e-5, most: int = 60) -> Cycle:
    """Limit cycle of the continuous controller from a rolling wheel, by steps of at most ``step`` (s).

    The brake is applied fast, as the driver does, and so the first release is another one than those of the cycle: a
    phase 2 in which the wheel gains speed no more goes over to phase 5, as the controller does, and a wheel that this
    locks is released.

    Raises RunFailed if a phase does not end, the wheel locks while it is not released, or ``most`` cycles do not close.
    """
    state = frozen.rolling()
    _to_end(state, 0, controller, step, frozen)
    for _ in range(most):
        state[TIME] = state[IMPULSE] = 0.0
        path, number = [state.copy()], RELEASE
        while number <= SLOW:
            end = _to_end(state, number, controller, step, frozen)
            path.append(state.copy())
            number = SLOW if end == BACK else number + 1
        first, last = path[0], path[-1]
        if abs(last[TORQUE] / first[TORQUE] - 1.0) + abs(last[TURNING] / first[TURNING] - 1.0) < CLOSED:
            return _cycle(np.array(path), frozen)
    raise RunFailed("braking", f"{most} cycles of the five phases do not close")


def _cycle(at: np.ndarray, frozen: Frozen) -> Cycle:
    """Of the states (6, 5) at the switches of one."""
    last, slips = at[-1], 1.0 - frozen.radius * at[:, TURNING] / frozen.speed
    return Cycle(
        float(last[TIME]),
        tuple(np.diff(at[:, TIME]).tolist()),
        float(last[IMPULSE] / last[TIME] / frozen.peak),
        tuple(slips.tolist()),
    )


def _to_end(state: np.ndarray, number: int, controller: FivePhase, step: float, frozen: Frozen) -> int:
    """Move a state on to the end of a phase, MET or BACK; raises RunFailed."""
    sign, level = end_of(number, controller)
    back = controller.e4 if number == CLIMB else -math.inf
    end: int = phase(state, rate(number, controller), sign, level, back, step, frozen.packed)
    if end == ENDLESS or (end == LOCKS and number != 0):
        what = f"the wheel locks in phase {number}" if end == LOCKS else f"phase {number} does not end"
        raise RunFailed("braking", what, float(state[TIME]))
    return end


def sampled(frozen: Frozen, controller: FivePhase, cycles: int = 30, substeps: int = 4, skip: int = 5) -> Cycle:
    """Mean of ``cycles`` cycles after ``skip`` others of the controller as it runs; durations and slips are empty.

    Raises RunFailed if it does not cycle.
    """
    state, after, number, falling = frozen.rolling(), np.empty(5), 0, False
    starts: list[np.ndarray] = []
    while len(starts) <= cycles + skip:
        wheels = np.array([frozen.radius * state[TURNING]])
        given = Sample(number, round(number * SAMPLE * 1e9), wheels, True, 1e3, frozen.speed)
        pressure = float(np.asarray(controller.sample(given).pressures)[0])
        if pressure < state[PRESSURE] and not falling:
            starts.append(state.copy())
        falling, number = pressure < state[PRESSURE], number + 1
        state[PRESSURE], state[TORQUE] = pressure, torque(0, pressure, state[TORQUE], frozen.packed[3])
        for _ in range(substeps):
            go_on(state, 0.0, SAMPLE / substeps, frozen.packed, after)
            state[:] = after
        if number * SAMPLE > (cycles + skip) * LONGEST_PHASE:
            raise RunFailed("braking", "the sampled controller does not cycle", float(state[TIME]))
    way = starts[-1] - starts[skip]
    return Cycle(float(way[TIME] / cycles), (), float(way[IMPULSE] / way[TIME] / frozen.peak), ())
