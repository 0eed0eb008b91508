"""Pressures in the brake chambers over one controller sample, and the brake torques that follow them through the
hysteresis.

Mode V: the controller sets valves. A chamber then fills from the supply or empties to the air, each by a first-order
law, exact over a step; a valve that can apply slowly, by a throttle or by pulses too short to be told apart, fills it
with a longer time constant; a change of a valve takes effect after the valves' delay, also between two samples. The
supply is a reservoir: what a chamber takes in, p V, it gives. Mode P: the controller sets the pressures themselves, as
the paper measured them, and each is held over the sample.
"""

import math
from typing import NamedTuple

import numpy as np

from models.brake.brake import brake_torque
from models.brake.controller import APPLY, RELEASE, SLOW
from models.core.errors import InputError
from models.machine.compiled import lean

EMPTY_ARRAY = np.zeros(0)


class BrakeChambers(NamedTuple):
    """Dynamics of brake chambers (W,): time constants (s) of first-order filling and emptying; supply pressure (bar).

    volumes (W,) : of the chambers with their pistons out, and reservoir : of the supply, in litres; an infinite one
    keeps its pressure and asks for no volumes. delay : of the valves (s). slow (W,) : time constants (s) of filling by
    valves that apply slowly, none where there are no such valves.
    """

    fill_time: np.ndarray
    empty_time: np.ndarray
    supply: float
    volumes: np.ndarray = EMPTY_ARRAY
    reservoir: float = math.inf
    delay: float = 0.0
    slow: np.ndarray = EMPTY_ARRAY


class AirState(NamedTuple):
    """State of the brakes' air system, which is updated in place.

    pressure, torque (W,) : bar, N m, with which the hysteresis remembers; supply (1,) : bar; commands (d + 2, W) :
    states of the valves as they were commanded, the latest last, d the whole samples of the valves' delay.
    """

    pressure: np.ndarray
    torque: np.ndarray
    supply: np.ndarray
    commands: np.ndarray


def air_at_rest(chambers: BrakeChambers, sampling_period: float) -> AirState:
    """``AirState`` at rest: zero pressure in all chambers, full supply pressure, all valves released; sampling_period :
    duration (s).
    """
    wheels = chambers.fill_time.size
    if math.isfinite(chambers.reservoir) and chambers.volumes.size != wheels:
        raise InputError("", "volumes", chambers.volumes.tolist(), f"a reservoir asks for those of {wheels} chambers")
    rows = int(chambers.delay / sampling_period) + 2
    return AirState(
        np.zeros(wheels),
        np.zeros(wheels),
        np.array([float(chambers.supply)]),
        np.full((rows, wheels), RELEASE, dtype=np.int64),
    )


@lean
def chamber_pressure(pressure, valve_state, duration, fill_time, empty_time, supply_pressure):
    """Pressure (bar) of a brake chamber after a time (s) in which its valve applies, holds or releases."""
    if valve_state >= APPLY:
        return (
            supply_pressure + (pressure - supply_pressure) * math.exp(-duration / fill_time)
            if fill_time > 0.0
            else supply_pressure
        )
    if valve_state == RELEASE:
        return pressure * math.exp(-duration / empty_time) if empty_time > 0.0 else 0.0
    return pressure


@lean
def advance_pressures(valve_states, duration, air_state, chambers, brakes):
    """Update chamber pressures and brake torques over a time (s) with constant valve states (W,). Every pressure
    changes monotonically, as the hysteresis of the torque requires.
    """
    air_used = 0.0
    for i in range(valve_states.size):
        pressure_before = air_state.pressure[i]
        fill = chambers.slow[i] if valve_states[i] == SLOW else chambers.fill_time[i]
        pressure_after = chamber_pressure(
            pressure_before, valve_states[i], duration, fill, chambers.empty_time[i], air_state.supply[0]
        )
        air_state.pressure[i], air_state.torque[i] = (
            pressure_after,
            brake_torque(i, pressure_after, air_state.torque[i], brakes),
        )
        if valve_states[i] >= APPLY and chambers.reservoir < math.inf:
            air_used += chambers.volumes[i] * (pressure_after - pressure_before)
    if air_used > 0.0:
        air_state.supply[0] -= air_used / chambers.reservoir


@lean
def advance_by_valves(valve_states, sampling_period, air_state, chambers, brakes, brake_torques):
    """Control by valve states (W,) over a sampling_period (s): fill ``brake_torques`` (n + 1, W) in N m at the ends of
    its n steps.
    """
    steps, last_command = brake_torques.shape[0] - 1, air_state.commands.shape[0] - 1
    for i in range(valve_states.size):
        for k in range(last_command):
            air_state.commands[k, i] = air_state.commands[k + 1, i]
        air_state.commands[last_command, i], brake_torques[0, i] = valve_states[i], air_state.torque[i]
    late = chambers.delay - (last_command - 1) * sampling_period
    step = sampling_period / steps
    for n in range(steps):
        wait = min(max(late - n * step, 0.0), step)
        if wait > 0.0:
            advance_pressures(air_state.commands[0], wait, air_state, chambers, brakes)
        if wait < step:
            advance_pressures(air_state.commands[1], step - wait, air_state, chambers, brakes)
        for i in range(valve_states.size):
            brake_torques[n + 1, i] = air_state.torque[i]


@lean
def advance_by_pressures(pressures, air_state, brakes, brake_torques):
    """Control by pressures (W,) in bar, which are reached at once and kept for the sample; fill ``brake_torques`` (n +
    1, W) in N m.
    """
    for i in range(pressures.size):
        air_state.pressure[i], air_state.torque[i] = (
            pressures[i],
            brake_torque(i, pressures[i], air_state.torque[i], brakes),
        )
        for n in range(brake_torques.shape[0]):
            brake_torques[n, i] = air_state.torque[i]
