"""The limit cycle that a wheelset reaches from a large disturbance, and the branch of cycles over the speed.

Above the critical speed the motion grows until creep forces saturate and flanges touch. Below it, down to a speed of
its own, a large disturbance may end in the same cycle: the branch then begins with cycles that repel.
"""

from collections.abc import Iterator
from itertools import count

import numpy as np

from models.core.errors import RunFailed
from models.rail.equations import Equations, Y
from models.rail.orbit import Orbit, beginning, branch, near, refined, solved

NOTHING = 1e-5
"""Displacement (m) below which a motion has died out."""
MARCH, MARCHES = 2.0, 20
"""Seconds of one march towards the cycle, and how many there are at most."""
STEADY = 2e-3
"""Relative change of the amplitude from cycle to cycle from which Newton's method takes over."""
FIRST = (0.1, 0.2, 0.4)
"""Amplitudes at which a branch may begin, by the clearance of the flanges: of the smallest that leads to an orbit."""
INNER, OUTER = 12, 0.03
"""Amplitudes of a branch up to the clearance; step of those beyond, by the clearance."""
LARGEST = 2.0
"""Amplitude at which a branch ends, by the clearance."""


def attained(equations: Equations, *, start: float = 5e-3, step: float = 5e-4) -> Orbit | None:
    """The limit cycle that a wheelset reaches from a lateral displacement ``start`` (m); None where it dies out.

    The motion is marched in steps (s) of this size until it repeats itself about, and then closed by Newton's method.
    Raises InputError for a step that is too large, RunFailed if the wheelset leaves the track or does not settle.
    """
    state = equations.displaced(start)
    for _ in range(MARCHES):
        path = equations.run(state, MARCH, step)
        y, state = path.states[:, Y], path.states[-1]
        if np.abs(y[-y.size // 4 :]).max() < NOTHING:
            return None
        tops = maxima(y)
        if tops.size > 2 and np.ptp(y[tops[-2:]]) < STEADY * y[tops[-1]]:
            period = float(path.times[tops[-1]] - path.times[tops[-2]])
            return solved(near(equations, path.states[tops[-1]], period, step), "amplitude")
    raise RunFailed("wheelset", f"no steady motion within {MARCHES * MARCH:g} s at {equations.speed:.6g} m/s")


def maxima(values: np.ndarray) -> np.ndarray:
    """Places of the positive maxima."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    return 1 + np.flatnonzero((here > before) & (here >= after) & (here > 0.0))


def bifurcation(equations: Equations, slowest: float, fastest: float, step: float = 5e-4) -> Iterator[Orbit]:
    """Cycles by rising amplitude, from the critical speed on until one leaves a range of speeds (m/s).

    Each at half the step (s), with the changes that halving made: of the speed, and of the frequency. Raises
    NoCriticalSpeed if no branch begins, RunFailed where it cannot be followed.
    """
    clearance = equations.wheelset.flange_clearance
    first = _first(equations, clearance, step)
    inner = np.linspace(first.amplitude, clearance, INNER)[1:]
    outer = (clearance * (1.0 + OUTER * k) for k in count(1))
    yield refined(first, "speed")
    for amplitudes in (inner, outer):
        for orbit in branch(first, amplitudes):
            if not slowest <= orbit.speed <= fastest or orbit.amplitude > LARGEST * clearance:
                return
            first = orbit
            yield refined(orbit, "speed")


def _first(equations: Equations, clearance: float, step: float) -> Orbit:
    for share in FIRST:
        try:
            return beginning(equations, share * clearance, step)
        except RunFailed as error:
            failed = error
    raise failed
