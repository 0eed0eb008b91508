"""Limit cycle of a wheelset: lateral amplitude and frequency in the steady oscillation, with their own errors.

Above the critical speed the motion grows until creep forces saturate and flanges touch. Below it, down to a speed of
its own, a large disturbance may end in the same cycle: where two answers exist, the one of the given start is found.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from models.errors import InputError
from models.rail.equations import YAW, Equations, Y

CYCLES = 4
"""Last cycles over which amplitude and frequency are means."""
STEADY = 1e-3
"""Relative change of the amplitude over the last cycles up to which a motion counts as a limit cycle."""
NOTHING = 1e-6
"""Amplitude (m) below which a motion has died out."""


@dataclass(frozen=True)
class Cycle:
    """amplitude, yaw : of y (m) and of yaw (rad); frequency : Hz; steady : whether the amplitude no longer changes.

    A motion that has died out has the amplitude and frequency 0. amplitude_error, frequency_error : changes by halving
    the step, NaN where it was not halved.
    """

    speed: float
    amplitude: float
    yaw: float
    frequency: float
    steady: bool
    amplitude_error: float = float("nan")
    frequency_error: float = float("nan")


def cycle(equations: Equations, *, start: float = 5e-3, duration: float = 8.0, step: float = 5e-4) -> Cycle:
    """The cycle that a wheelset reaches from a lateral displacement ``start`` (m) after ``duration`` (s).

    step : s. Raises InputError for a step that is too large, or a motion too short to show its cycles, and RunFailed
    if the wheelset leaves the track.
    """
    path = equations.run(equations.displaced(start), duration, step)
    y, yaw = path.states[:, Y], path.states[:, YAW]
    if np.abs(y[-y.size // 8 :]).max() < NOTHING:
        return Cycle(equations.speed, 0.0, 0.0, 0.0, True)
    tops, crossings = maxima(y), upward(path.times, y)
    if min(tops.size, crossings.size) < CYCLES + 2:
        raise InputError("", "duration", duration, f"s must hold {CYCLES + 2} cycles or more")
    last = tops[-CYCLES:]
    period = (crossings[-1] - crossings[-1 - CYCLES]) / CYCLES
    return Cycle(equations.speed, float(last.mean()), float(maxima(yaw)[-CYCLES:].mean()), float(1.0 / period),
                 bool(np.ptp(last) < STEADY * last.mean()))  # fmt: skip


def maxima(values: np.ndarray) -> np.ndarray:
    """The positive maxima of evenly spaced values, each by the parabola through its three highest points."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    k = np.flatnonzero((here > before) & (here >= after) & (here > 0.0))
    rise, bend = (after[k] - before[k]) / 2.0, before[k] - 2.0 * here[k] + after[k]
    return here[k] - 0.5 * rise**2 / bend


def upward(times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Times at which values go from negative to positive, by the cubic through four points around."""
    k = np.flatnonzero((values[1:-2] < 0.0) & (values[2:-1] >= 0.0)) + 1
    step = times[1] - times[0]
    found = []
    for i in k:
        cubic = np.polyfit(np.arange(-1.0, 3.0), values[i - 1 : i + 3], 3)
        roots = np.roots(cubic)
        real = roots[np.abs(roots.imag) < 1e-9].real
        found.append(times[i] + step * real[np.argmin(np.abs(real - 0.5))])
    return np.array(found)


def cycle_with_error(equations: Equations, *, start: float = 5e-3, duration: float = 8.0, step: float = 5e-4) -> Cycle:
    """``cycle`` at half the step, with the differences that halving made."""
    whole = cycle(equations, start=start, duration=duration, step=step)
    half = cycle(equations, start=start, duration=duration, step=step / 2.0)
    return Cycle(half.speed, half.amplitude, half.yaw, half.frequency, half.steady,
                 abs(half.amplitude - whole.amplitude), abs(half.frequency - whole.frequency))  # fmt: skip


def bifurcation(equations: Equations, speeds: Iterable[float], *, start: float = 5e-3, duration: float = 8.0,
                step: float = 5e-4) -> list[Cycle]:  # fmt: skip
    """Cycles over speed (m/s), each from the same start."""
    return [cycle(Equations(equations.wheelset, speed, equations.law, equations.cells), start=start, duration=duration,
                  step=step) for speed in speeds]  # fmt: skip
