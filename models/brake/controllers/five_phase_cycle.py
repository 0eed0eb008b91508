"""Limit cycle of one wheel at constant vehicle speed under the five-phase controller, with every switch located.

The vehicle's speed v stays, the wheel obeys J w' = r F(s) - T, and pressure rises and falls at the rates of the phases,
so that the controller is the continuous one of its author: phases end when r w' meets its threshold, not at samples.
Torque between two switches is linear but for the corners of the brake's loop; steps end there too.
``mean_cycle_of_sampled_controller`` is the same wheel under the same controller as it runs, by samples.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from models.brake.brake import Brake, WheelBrakes, brake_torque, brakes_of_wheels
from models.brake.controller import SAMPLING_PERIOD, Sample
from models.brake.controllers.five_phase import FivePhase, phase_end_threshold, pressure_rate_of_phase
from models.brake.wheel_step import BrakedWheel, TyreGrip, WheelStepInput, node_force, wheel_step
from models.core.errors import InputError, RunFailed
from models.machine.compiled import njit
from models.tyre.tyre_table import TableCell, TyreTable, cell_and_share, stacked_tables

LONGEST_PHASE_DURATION = 1.0
"""Time (s) after which a phase is taken never to end."""
CLOSED_CYCLE_TOLERANCE = 1e-9
"""Sum of the relative changes of wheel speed and torque from one cycle to the next below which the limit cycle is
reached.
"""


class CycleWheelState(NamedTuple):
    """State of a wheel in the five-phase cycle: pressure (bar) and torque (N m) of its brake, rotational speed (rad/s),
    time (s), and the integral of the tyre's force over that time (N s).
    """

    pressure: float
    torque: float
    turning: float
    time: float
    impulse: float


class CompiledWheel(NamedTuple):
    """A wheel of a vehicle at a constant speed (m/s), for compiled functions: its radius (m) and inertia (kg m^2), the
    brake (of one wheel) and the grip of its tyre.
    """

    vehicle_speed: float
    radius: float
    inertia: float
    brakes: WheelBrakes
    grip: TyreGrip


LEVEL_MET, OTHER_LEVEL_MET, WHEEL_LOCKS, NEVER_ENDS = range(4)
"""How a phase ends: the rim's acceleration meets the phase's level; it falls to the other level, as in phase 2; the
wheel locks; or the phase never ends.
"""
RELEASE_PHASE, SPEED_UP_PHASE, SLOW_PHASE = 1, 2, 5
"""Numbers of phases: in which pressure falls, in which the wheel gains speed, and which follows if it gains no more
speed.
"""


@dataclass(frozen=True, eq=False)
class WheelAtConstantSpeed:
    """A wheel with its load (N), radius (m), inertia (kg m^2) and brake, on a tyre table, at a constant vehicle speed
    (m/s).
    """

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
        """Largest longitudinal force (N) of the tyre at its load."""
        grip = self.driven.grip
        return max(node_force(k, grip) for k in range(grip.slips.size))

    @cached_property
    def driven(self) -> CompiledWheel:
        """The wheel as a ``CompiledWheel``, the form that compiled functions take."""
        tables, (j, q) = stacked_tables([self.tyre]), cell_and_share(self.tyre.loads, self.load)
        grip = TyreGrip(0, 0, 0.0, TableCell(0, 0.0, int(j), float(q)), float(self.load), tables.slips, tables.mu_x)
        return CompiledWheel(
            float(self.speed), float(self.radius), float(self.inertia), brakes_of_wheels(self.brake), grip
        )

    def rolling(self) -> CycleWheelState:
        """State of the wheel that rolls without torque, at time 0."""
        return CycleWheelState(0.0, 0.0, self.speed / self.radius, 0.0, 0.0)


@njit(cache=True, error_model="numpy")
def rim_acceleration(wheel_state, wheel_at_speed):
    """Acceleration (m/s^2) of the wheel's rim, radius times rotational acceleration."""
    radius, inertia = wheel_at_speed.radius, wheel_at_speed.inertia
    slip = min(max(1.0 - radius * wheel_state.turning / wheel_at_speed.vehicle_speed, 0.0), 1.0)
    k, share = cell_and_share(wheel_at_speed.grip.slips, slip)
    low, high = node_force(k, wheel_at_speed.grip), node_force(k + 1, wheel_at_speed.grip)
    return radius * (radius * (low + share * (high - low)) - wheel_state.torque) / inertia


@njit(cache=True, error_model="numpy")
def state_after(wheel_state, pressure_rate, duration, wheel_at_speed):
    """Wheel state after a time (s) in which pressure changes at a constant rate (bar/s) and reaches no corner of the
    hysteresis loop.
    """
    pressure = max(wheel_state.pressure + pressure_rate * duration, 0.0)
    torque_after = brake_torque(0, pressure, wheel_state.torque, wheel_at_speed.brakes)
    drive = WheelStepInput(
        wheel_at_speed.vehicle_speed, wheel_at_speed.vehicle_speed, wheel_state.torque, torque_after, duration
    )
    rolled = wheel_step(
        drive, BrakedWheel(wheel_at_speed.radius, wheel_at_speed.inertia, wheel_state.turning), wheel_at_speed.grip
    )
    return CycleWheelState(
        pressure,
        torque_after,
        rolled.turning,
        wheel_state.time + duration,
        wheel_state.impulse + duration * rolled.force,
    )


@njit(cache=True, error_model="numpy")
def time_to_corner(wheel_state, pressure_rate, brakes):
    """Time (s) until the pressure reaches the next corner of the brake's hysteresis loop, or zero pressure; else
    infinite.
    """
    first = math.inf
    if pressure_rate > 0.0:
        first = (brakes.push_out[0] + wheel_state.torque / brakes.rising[0] - wheel_state.pressure) / pressure_rate
        return first if first > 1e-12 else math.inf
    if pressure_rate < 0.0:
        for p in (brakes.release[0] + wheel_state.torque / brakes.falling[0], brakes.release[0], 0.0):
            time = (p - wheel_state.pressure) / pressure_rate
            if time > 1e-12:
                first = min(first, time)
    return first


@njit(cache=True, error_model="numpy")
def phase_end_status(wheel_state, crossing_sign, end_acceleration, alternative_acceleration, wheel_at_speed):
    """LEVEL_MET if the rim's acceleration has passed ``end_acceleration`` in the direction ``crossing_sign``,
    OTHER_LEVEL_MET if it is at most ``alternative_acceleration`` (m/s^2), else -1.
    """
    acceleration = rim_acceleration(wheel_state, wheel_at_speed)
    return (
        LEVEL_MET
        if crossing_sign * (acceleration - end_acceleration) >= 0.0
        else OTHER_LEVEL_MET
        if acceleration <= alternative_acceleration
        else -1
    )


@njit(cache=True, error_model="numpy")
def integrate_phase(
    wheel_state, pressure_rate, crossing_sign, end_acceleration, alternative_acceleration, time_step, wheel_at_speed
):
    """Wheel state at the end of a phase with a constant rate of pressure (bar/s), integrated in steps (s), and how the
    phase ended.

    A wheel that locks while pressure falls turns again later; another one does not.
    """
    began, end = (
        wheel_state.time,
        phase_end_status(wheel_state, crossing_sign, end_acceleration, alternative_acceleration, wheel_at_speed),
    )
    while end < 0:
        time = min(time_step, time_to_corner(wheel_state, pressure_rate, wheel_at_speed.brakes))
        next_state = state_after(wheel_state, pressure_rate, time, wheel_at_speed)
        end = phase_end_status(next_state, crossing_sign, end_acceleration, alternative_acceleration, wheel_at_speed)
        if end >= 0:
            low, high = 0.0, time
            while high - low > 1e-15:
                middle = 0.5 * (low + high)
                if (
                    phase_end_status(
                        state_after(wheel_state, pressure_rate, middle, wheel_at_speed),
                        crossing_sign,
                        end_acceleration,
                        alternative_acceleration,
                        wheel_at_speed,
                    )
                    >= 0
                ):
                    high = middle
                else:
                    low = middle
            next_state = state_after(wheel_state, pressure_rate, high, wheel_at_speed)
        wheel_state = next_state
        if end < 0 and not (wheel_state.turning > 0.0 or pressure_rate < 0.0):
            return wheel_state, WHEEL_LOCKS
        if end < 0 and wheel_state.time - began > LONGEST_PHASE_DURATION:
            return wheel_state, NEVER_ENDS
    return wheel_state, end


@dataclass(frozen=True)
class LimitCycle:
    """A limit cycle of a braked wheel: period (s), durations (5,) of phases 1 to 5 (s), ratio of the mean tyre force to
    the largest one, and slips (6,) at the start of each phase and at the end of the cycle.
    """

    period: float
    durations: tuple[float, ...]
    utilisation: float
    slips: tuple[float, ...]


def limit_cycle(
    wheel_at_speed: WheelAtConstantSpeed, controller: FivePhase, time_step: float = 2e-5, cycle_limit: int = 60
) -> LimitCycle:
    """Limit cycle of a wheel under the continuous five-phase controller, from a freely rolling wheel on, in steps of at
    most ``time_step`` (s).

    The driver applies the brake fast, so the first release differs from later ones. If the wheel stops gaining speed in
    phase 2, phase 5 follows, as in the controller; a wheel that locks by this is released.

    Raises RunFailed if a phase does not end, a wheel locks while it is not released, or no cycle closes among
    ``cycle_limit``.
    """
    state, _ = _state_at_phase_end(wheel_at_speed.rolling(), 0, controller, time_step, wheel_at_speed)
    for _ in range(cycle_limit):
        state = state._replace(time=0.0, impulse=0.0)
        path, number = [state], RELEASE_PHASE
        while number <= SLOW_PHASE:
            state, end = _state_at_phase_end(state, number, controller, time_step, wheel_at_speed)
            path.append(state)
            number = SLOW_PHASE if end == OTHER_LEVEL_MET else number + 1
        first = path[0]
        if abs(state.torque / first.torque - 1.0) + abs(state.turning / first.turning - 1.0) < CLOSED_CYCLE_TOLERANCE:
            return _cycle_from_switches(path, wheel_at_speed)
    raise RunFailed("braking", f"{cycle_limit} cycles of the five phases do not close")


def _cycle_from_switches(switch_states: list[CycleWheelState], wheel_at_speed: WheelAtConstantSpeed) -> LimitCycle:
    """Limit cycle computed from the wheel's states at the six switches between phases."""
    last_state, slips = (
        switch_states[-1],
        [1.0 - wheel_at_speed.radius * state.turning / wheel_at_speed.speed for state in switch_states],
    )
    durations = tuple(np.diff([state.time for state in switch_states]).tolist())
    return LimitCycle(
        last_state.time, durations, last_state.impulse / last_state.time / wheel_at_speed.peak, tuple(slips)
    )


def _state_at_phase_end(
    wheel_state: CycleWheelState,
    phase_number: int,
    controller: FivePhase,
    time_step: float,
    wheel_at_speed: WheelAtConstantSpeed,
) -> tuple[CycleWheelState, int]:
    """Wheel state at the end of a phase, and whether it ended as LEVEL_MET or as OTHER_LEVEL_MET; raises RunFailed
    where the wheel locks or the phase does not end.
    """
    sign, level = phase_end_threshold(phase_number, controller)
    other_level = controller.e4 if phase_number == SPEED_UP_PHASE else -math.inf
    wheel_state, end = integrate_phase(
        wheel_state,
        pressure_rate_of_phase(phase_number, controller),
        sign,
        level,
        other_level,
        time_step,
        wheel_at_speed.driven,
    )
    if end == NEVER_ENDS or (end == WHEEL_LOCKS and phase_number != 0):
        failure = (
            f"the wheel locks in phase {phase_number}" if end == WHEEL_LOCKS else f"phase {phase_number} does not end"
        )
        raise RunFailed("braking", failure, wheel_state.time)
    return wheel_state, end


def mean_cycle_of_sampled_controller(
    wheel_at_speed: WheelAtConstantSpeed,
    controller: FivePhase,
    cycle_count: int = 30,
    substep_count: int = 4,
    skipped_cycle_count: int = 5,
) -> LimitCycle:
    """Mean over ``cycle_count`` cycles of the sampled five-phase controller, after the first ``skipped_cycle_count``
    ones; durations and slips are left empty.

    Raises RunFailed if it does not cycle.
    """
    state, driven, number, falling = wheel_at_speed.rolling(), wheel_at_speed.driven, 0, False
    starts: list[CycleWheelState] = []
    while len(starts) <= cycle_count + skipped_cycle_count:
        wheels = np.array([wheel_at_speed.radius * state.turning])
        sample = Sample(number, round(number * SAMPLING_PERIOD * 1e9), wheels, True, 1e3, wheel_at_speed.speed)
        pressure = float(np.asarray(controller.sample(sample).pressures)[0])
        if pressure < state.pressure and not falling:
            starts.append(state)
        falling, number = pressure < state.pressure, number + 1
        state = state._replace(pressure=pressure, torque=brake_torque(0, pressure, state.torque, driven.brakes))
        for _ in range(substep_count):
            state = state_after(state, 0.0, SAMPLING_PERIOD / substep_count, driven)
        if number * SAMPLING_PERIOD > (cycle_count + skipped_cycle_count) * LONGEST_PHASE_DURATION:
            raise RunFailed("braking", "the sampled controller does not cycle", state.time)
    first_start, last_start = starts[skipped_cycle_count], starts[-1]
    time, impulse = last_start.time - first_start.time, last_start.impulse - first_start.impulse
    return LimitCycle(time / cycle_count, (), impulse / time / wheel_at_speed.peak, ())
