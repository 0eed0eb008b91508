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

from models.brake.brake import torque
from models.brake.controller import APPLY, RELEASE, SLOW
from models.core.errors import InputError
from models.machine.compiled import lean

NO_VALUES = np.zeros(0)


class Chambers(NamedTuple):
    """Dynamics of brake chambers (W,): time constants (s) of first-order filling and emptying; supply pressure (bar).

    volumes (W,) : of the chambers with their pistons out, and reservoir : of the supply, in litres; an infinite one
    keeps its pressure and asks for no volumes. delay : of the valves (s). slow (W,) : time constants (s) of filling by
    valves that apply slowly, none where there are no such valves.
    """

    fill_time: np.ndarray
    empty_time: np.ndarray
    supply: float
    volumes: np.ndarray = NO_VALUES
    reservoir: float = math.inf
    delay: float = 0.0
    slow: np.ndarray = NO_VALUES


class Air(NamedTuple):
    """State of the brakes' air system, which is updated in place.

    pressure, torque (W,) : bar, N m, with which the hysteresis remembers; supply (1,) : bar; commands (d + 2, W) :
    states of the valves as they were commanded, the latest last, d the whole samples of the valves' delay.
    """

    pressure: np.ndarray
    torque: np.ndarray
    supply: np.ndarray
    commands: np.ndarray


def resting_chambers(chambers: Chambers, sample: float) -> Air:
    """``Air`` at rest: zero pressure in all chambers, full supply pressure, all valves released; sample : duration
    (s).
    """
    wheels = chambers.fill_time.size
    if math.isfinite(chambers.reservoir) and chambers.volumes.size != wheels:
        raise InputError("", "volumes", chambers.volumes.tolist(), f"a reservoir asks for those of {wheels} chambers")
    rows = int(chambers.delay / sample) + 2
    return Air(
        np.zeros(wheels),
        np.zeros(wheels),
        np.array([float(chambers.supply)]),
        np.full((rows, wheels), RELEASE, dtype=np.int64),
    )


@lean
def chamber_pressure(pressure, valve, time, fill, empty, supply):
    """Pressure (bar) of a brake chamber after a time (s) in which its valve applies, holds or releases."""
    if valve >= APPLY:
        return supply + (pressure - supply) * math.exp(-time / fill) if fill > 0.0 else supply
    if valve == RELEASE:
        return pressure * math.exp(-time / empty) if empty > 0.0 else 0.0
    return pressure


@lean
def press(valves, time, air, chambers, brakes):
    """Update chamber pressures and brake torques over a time (s) with constant valve states (W,). Every pressure
    changes monotonically, as the hysteresis of the torque requires.
    """
    air_used = 0.0
    for i in range(valves.size):
        pressure_before = air.pressure[i]
        fill = chambers.slow[i] if valves[i] == SLOW else chambers.fill_time[i]
        pressure_after = chamber_pressure(pressure_before, valves[i], time, fill, chambers.empty_time[i], air.supply[0])
        air.pressure[i], air.torque[i] = pressure_after, torque(i, pressure_after, air.torque[i], brakes)
        if valves[i] >= APPLY and chambers.reservoir < math.inf:
            air_used += chambers.volumes[i] * (pressure_after - pressure_before)
    if air_used > 0.0:
        air.supply[0] -= air_used / chambers.reservoir


@lean
def by_valves(valves, sample, air, chambers, brakes, torques):
    """Control by valve states (W,) over a sample (s): fill ``torques`` (n + 1, W) in N m at the ends of its n steps."""
    steps, last_command = torques.shape[0] - 1, air.commands.shape[0] - 1
    for i in range(valves.size):
        for k in range(last_command):
            air.commands[k, i] = air.commands[k + 1, i]
        air.commands[last_command, i], torques[0, i] = valves[i], air.torque[i]
    late = chambers.delay - (last_command - 1) * sample
    step = sample / steps
    for n in range(steps):
        wait = min(max(late - n * step, 0.0), step)
        if wait > 0.0:
            press(air.commands[0], wait, air, chambers, brakes)
        if wait < step:
            press(air.commands[1], step - wait, air, chambers, brakes)
        for i in range(valves.size):
            torques[n + 1, i] = air.torque[i]


@lean
def by_pressures(pressures, air, brakes, torques):
    """Control by pressures (W,) in bar, which are reached at once and kept for the sample; fill ``torques`` (n + 1, W)
    in N m.
    """
    for i in range(pressures.size):
        air.pressure[i], air.torque[i] = pressures[i], torque(i, pressures[i], air.torque[i], brakes)
        for n in range(torques.shape[0]):
            torques[n, i] = air.torque[i]
