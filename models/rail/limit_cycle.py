"""Limit cycles of a wheelset by the shooting method, stable and unstable ones, and their branch over the speed.

An orbit begins where the lateral displacement is at its maximum, the amplitude. It is marched with a whole number of
steps to the period, so that halving the step asks the same question again. Newton's method makes the state come back;
besides state and period, either the amplitude or the speed is unknown. With a given amplitude, branches can be
followed that stand upright over the speed or turn back.

Where an ``executor`` is given, it computes the marches that linearise the return, two by two; no bit depends on it.

Floquet multipliers are those of the return map of the section without lateral rate: beyond 1 the orbit repels.

Above the critical speed a motion grows until creep forces saturate and flanges touch. Below it, down to a speed of
its own, a large disturbance may end in the same cycle: the branch then begins with cycles that repel.
"""

import math
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from typing import Literal

import numpy as np

from models.contact.inputs import Array
from models.core.errors import InputError, RunFailed
from models.ensemble.runner import block_results
from models.rail.equations import ANGLE, STATE_COUNT, Y_RATE, WheelsetEquations, WheelsetPath, Y
from models.rail.linear import critical_speed
from models.rail.wheelset import Wheelset

SoughtQuantity = Literal["amplitude", "speed"]
TYPICAL_STATE_SIZES = np.array([1e-3, 1e-4, 1e-4, 1e-3, 1.0, 1e-2, 1e-2, 1e-2, 1e-2, 1.0])
"""Typical sizes of the states (m, rad, m/s, rad/s), by which differences of the states are scaled."""
CLOSURE_TOLERANCE = 1e-9
"""Largest scaled difference between the start and end of a period at which the orbit counts as closed."""
DIFFERENCE_SHARE = 1e-2
"""Steps of the central differences that linearise the return map, as a share of the typical sizes, of 1 m/s and of the
period. They are wide enough to reach over the kinks that FASTSIM's cells make where they begin to slide."""
MOST_NEWTON_STEPS, LEAST_GAIN = 15, 0.3
"""Largest count of Newton corrections; share of the mismatch that a correction may leave before the return map is
linearised anew."""
DISPLACED_GUESS = 0.01
"""Share by which a guess for other equations is displaced, so that they find the orbit independently."""
AMPLITUDE_HALVINGS = 5
"""Largest count of halvings of the interval to the next amplitude, where Newton's method does not reach it at once."""
RETURNING_STATES = [k for k in range(STATE_COUNT) if k != ANGLE]
"""Indices of the states that must return after a period; the angle of spin does not."""
SPEED_COLUMN, PERIOD_COLUMN = len(RETURNING_STATES), len(RETURNING_STATES) + 1
"""Columns of the slopes with respect to speed and period, after those of the states."""
AMPLITUDE_INDEX, RATE_INDEX = RETURNING_STATES.index(Y), RETURNING_STATES.index(Y_RATE)
SECTION_COORDINATES = [k for k in range(len(RETURNING_STATES)) if k != RATE_INDEX]
"""Indices of the coordinates that span the Poincaré section."""
DECAYED_DISPLACEMENT = 1e-5
"""Lateral displacement (m) below which a motion counts as decayed."""
MARCH_DURATION, MOST_MARCHES = 2.0, 20
"""Duration (s) of one integration towards the cycle, and largest count of integrations."""
AMPLITUDE_CHANGE = 2e-3
"""Relative change of the amplitude from cycle to cycle below which Newton's method takes over."""
FIRST_AMPLITUDES = (0.1, 0.2, 0.4)
"""Ratios of amplitude to flange clearance at which a branch may begin; the smallest that leads to an orbit is taken."""
INNER_AMPLITUDES, OUTER_STEP = 12, 0.03
"""Count of amplitudes of a branch up to the flange clearance; step of the ratio of amplitude to clearance beyond."""
LARGEST_AMPLITUDE = 2.0
"""Ratio of amplitude to flange clearance at which a branch ends."""


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion of a wheelset. state (10,) : at a maximum of y; period : s, with the number of steps in it.

    return_slopes (9, 11) : derivatives of the state after a period (without the angle of spin) with respect to the
    state before, the speed and the period, in units of STATE_SIZES, 1 m/s and the period. error : change of the unknown
    when the step is halved, frequency_error : Hz; both NaN where the step was not halved."""

    equations: WheelsetEquations
    state: Array
    period: float
    step_count: int
    return_slopes: Array
    error: float = math.nan
    frequency_error: float = math.nan

    @property
    def speed(self) -> float:
        """Speed of the wheelset (m/s)."""
        return self.equations.speed

    @property
    def amplitude(self) -> float:
        """Amplitude of the lateral displacement (m)."""
        return float(self.state[Y])

    @property
    def frequency(self) -> float:
        """Frequency of the periodic motion (Hz)."""
        return 1.0 / self.period

    @property
    def multiplier(self) -> float:
        """Largest magnitude of the Floquet multipliers of the orbit; it is stable below 1."""
        by_states, back = self.return_slopes[:, : len(RETURNING_STATES)], self.return_slopes[:, PERIOD_COLUMN]
        returned = by_states - np.outer(back, by_states[RATE_INDEX]) / back[RATE_INDEX]
        return float(np.abs(np.linalg.eigvals(returned[np.ix_(SECTION_COORDINATES, SECTION_COORDINATES)])).max())

    @property
    def stable(self) -> bool:
        """Whether neighbouring motions approach this orbit."""
        return self.multiplier < 1.0

    def path(self) -> WheelsetPath:
        """Motion of the wheelset over one period, including both ends."""
        return self.equations.run(self.state, self.period, self.period / self.step_count)


def guess_near_state(
    equations: WheelsetEquations,
    start_state: Array,
    orbit_period: float,
    time_step: float,
    executor: Executor | None = None,
) -> Orbit:
    """Initial guess for ``solved_orbit``: a state (10,) near a maximum of y, and a period (s) divided into steps of at
    most ``time_step`` (s)."""
    start = start_state.copy()
    start[Y_RATE] = 0.0
    return _with_return_slopes(
        Orbit(equations, start, orbit_period, math.ceil(orbit_period / time_step), np.empty(0)), executor
    )


def orbit_of_small_amplitude(
    equations: WheelsetEquations, amplitude: float, time_step: float, executor: Executor | None = None
) -> Orbit:
    """Orbit of a small amplitude (m), found from the linear motion that neither grows nor decays at the critical speed.

    time_step : s, about. Raises NoCriticalSpeed if there is no such motion, RunFailed if it leads to no orbit, as where
    the amplitude is so small that cells of FASTSIM begin to slide one by one.
    """

    def growth(_equations_type: Wheelset, speed: float) -> float:
        return float(np.linalg.eigvals(replace(equations, speed=speed).state_matrix).real.max())

    critical_equations = replace(equations, speed=critical_speed(equations.wheelset, growth))
    values, vectors = np.linalg.eig(critical_equations.state_matrix)
    k = np.where(values.imag > 0.0, values.real, -math.inf).argmax()
    state = critical_equations.rest.copy()
    state[RETURNING_STATES] += amplitude * (vectors[:, k] / vectors[AMPLITUDE_INDEX, k]).real
    guess = guess_near_state(critical_equations, state, 2.0 * math.pi / values[k].imag, time_step, executor)
    return solved_orbit(guess, "speed", executor=executor)


def guess_from_orbit(known_orbit: Orbit, equations: WheelsetEquations) -> Orbit:
    """Initial guess for the orbit of changed equations: the known orbit, with its distance from rest enlarged by the
    share DISPLACED_GUESS."""
    rest_state = known_orbit.equations.rest
    return replace(
        known_orbit, equations=equations, state=rest_state + (1.0 + DISPLACED_GUESS) * (known_orbit.state - rest_state)
    )


def branch_of_orbits(
    first_orbit: Orbit, amplitudes: Iterable[float], executor: Executor | None = None
) -> Iterator[Orbit]:
    """Orbits of successive amplitudes (m), each continued from the two before; the speed of each is solved for.

    Raises RunFailed where the branch cannot be followed.
    """
    earlier_orbit, latest_orbit = replace(first_orbit, state=first_orbit.equations.rest), first_orbit
    for amplitude in amplitudes:
        earlier_orbit, latest_orbit = (
            latest_orbit,
            _continued_orbit(earlier_orbit, latest_orbit, amplitude, AMPLITUDE_HALVINGS, executor),
        )
        yield latest_orbit


def _continued_orbit(
    earlier_orbit: Orbit, latest_orbit: Orbit, amplitude: float, halvings: int, executor: Executor | None
) -> Orbit:
    """Orbit of an amplitude (m), predicted on the straight line through two earlier orbits; the interval is halved if
    this fails."""
    amplitude_change = latest_orbit.amplitude - earlier_orbit.amplitude
    share = (amplitude - latest_orbit.amplitude) / amplitude_change
    state = latest_orbit.state + share * (latest_orbit.state - earlier_orbit.state)
    state[Y] = amplitude
    predicted_equations = replace(
        latest_orbit.equations, speed=latest_orbit.speed + share * (latest_orbit.speed - earlier_orbit.speed)
    )
    guess = replace(
        latest_orbit,
        equations=predicted_equations,
        state=state,
        period=latest_orbit.period + share * (latest_orbit.period - earlier_orbit.period),
    )
    try:
        return solved_orbit(guess, "speed", executor=executor)
    except RunFailed:
        if halvings == 0:
            raise
    middle = _continued_orbit(
        earlier_orbit, latest_orbit, (latest_orbit.amplitude + amplitude) / 2.0, halvings - 1, executor
    )
    return _continued_orbit(latest_orbit, middle, amplitude, halvings - 1, executor)


def solved_orbit(
    orbit_guess: Orbit, sought_quantity: SoughtQuantity, *, is_precise: bool = True, executor: Executor | None = None
) -> Orbit:
    """Orbit near a guess. ``sought_quantity`` is solved for: speed or amplitude; the other keeps the guess's value. A
    precise orbit gets slopes computed about itself.

    The slopes of the guess lead there as long as they do; what is asked of the orbit is that it comes back.
    Raises RunFailed if none is found.
    """
    orbit, fresh, left = orbit_guess, False, math.inf
    for _ in range(MOST_NEWTON_STEPS):
        try:
            end = _state_after(orbit.equations, orbit.state, orbit.period, orbit.step_count)
        except (InputError, RunFailed):  # a correction that led away: off the track, to a speed or period that is none
            break
        missed = ((end - orbit.state) / TYPICAL_STATE_SIZES)[RETURNING_STATES]
        size = float(np.abs(missed).max())
        if size < CLOSURE_TOLERANCE:
            return orbit if fresh or not is_precise else _with_return_slopes(orbit, executor)
        if not fresh and size > LEAST_GAIN * left:
            orbit, fresh = _with_return_slopes(orbit, executor), True
        orbit, left, fresh = _newton_corrected(orbit, missed, sought_quantity), size, False
    raise RunFailed(
        "wheelset", f"no periodic motion was found near {orbit_guess.speed:.6g} m/s and {orbit_guess.amplitude:.3g} m"
    )


def refined_orbit(known_orbit: Orbit, sought_quantity: SoughtQuantity, executor: Executor | None = None) -> Orbit:
    """Orbit computed with half the step, with the changes of its speed or amplitude and of its frequency as errors."""
    half = solved_orbit(
        replace(known_orbit, step_count=2 * known_orbit.step_count),
        sought_quantity,
        is_precise=False,
        executor=executor,
    )
    return replace(
        half,
        error=abs(getattr(half, sought_quantity) - getattr(known_orbit, sought_quantity)),
        frequency_error=abs(half.frequency - known_orbit.frequency),
    )


def _state_after(equations: WheelsetEquations, start_state: Array, orbit_period: float, step_count: int) -> Array:
    return equations.run(start_state, orbit_period, orbit_period / step_count, step_count).states[-1]


OrbitGuess = tuple[WheelsetEquations, Array, float]
"""Start of an orbit: equations, state (10,) and period (s)."""


def _with_return_slopes(known_orbit: Orbit, executor: Executor | None) -> Orbit:
    """The orbit with the derivatives of its return map computed about itself."""
    eq, T, state, signs = known_orbit.equations, known_orbit.period, known_orbit.state, (-1.0, 1.0)
    pairs: list[list[OrbitGuess]] = [
        *(
            [
                (eq, state + sign * DIFFERENCE_SHARE * TYPICAL_STATE_SIZES[k] * np.eye(STATE_COUNT)[k], T)
                for sign in signs
            ]
            for k in RETURNING_STATES
        ),
        [(replace(eq, speed=eq.speed + sign * DIFFERENCE_SHARE), state, T) for sign in signs],
        [(eq, state, T * (1.0 + sign * DIFFERENCE_SHARE)) for sign in signs],
    ]
    ends = block_results(partial(_ends_of_period, step_count=known_orbit.step_count), pairs, executor)
    columns = [
        ((end_after - end_before) / (2.0 * DIFFERENCE_SHARE * TYPICAL_STATE_SIZES))[RETURNING_STATES]
        for end_before, end_after in ends
    ]
    return replace(known_orbit, return_slopes=np.array(columns).T)


def _ends_of_period(guess_pair: list[OrbitGuess], step_count: int) -> list[Array]:
    return [_state_after(*guess, step_count) for guess in guess_pair]


def _newton_corrected(known_orbit: Orbit, period_mismatch: Array, sought_quantity: SoughtQuantity) -> Orbit:
    """The orbit after a Newton correction with its slopes; the lateral rate stays zero."""
    returned = known_orbit.return_slopes.copy()
    returned[:, : len(RETURNING_STATES)] -= np.eye(len(RETURNING_STATES))
    free = [k for k in SECTION_COORDINATES if k != AMPLITUDE_INDEX]
    columns = [*free, AMPLITUDE_INDEX if sought_quantity == "amplitude" else SPEED_COLUMN, PERIOD_COLUMN]
    *section, change, longer = -np.linalg.solve(returned[:, columns], period_mismatch)
    state, speed = known_orbit.state.copy(), known_orbit.speed
    state_indices = [RETURNING_STATES[k] for k in free]
    state[state_indices] += section * TYPICAL_STATE_SIZES[state_indices]
    if sought_quantity == "amplitude":
        state[Y] += change * TYPICAL_STATE_SIZES[Y]
    else:
        speed += change
    period = known_orbit.period * (1.0 + longer)
    return replace(known_orbit, equations=replace(known_orbit.equations, speed=speed), state=state, period=period)


def attained_limit_cycle(
    equations: WheelsetEquations,
    *,
    initial_displacement: float = 5e-3,
    time_step: float = 5e-4,
    executor: Executor | None = None,
) -> Orbit | None:
    """Limit cycle that a wheelset reaches from a lateral displacement ``initial_displacement`` (m); None if the motion
    decays.

    The motion is marched in steps (s) of this size until it repeats itself about, and then closed by Newton's method.
    Raises InputError for a step that is too large, RunFailed if the wheelset leaves the track or does not settle.
    """
    state = equations.displaced_state(initial_displacement)
    for _ in range(MOST_MARCHES):
        path = equations.run(state, MARCH_DURATION, time_step)
        y, state = path.states[:, Y], path.states[-1]
        if np.abs(y[-y.size // 4 :]).max() < DECAYED_DISPLACEMENT:
            return None
        tops = positive_maxima(y)
        if tops.size > 2 and np.ptp(y[tops[-2:]]) < AMPLITUDE_CHANGE * y[tops[-1]]:
            period = float(path.times[tops[-1]] - path.times[tops[-2]])
            guess = guess_near_state(equations, path.states[tops[-1]], period, time_step, executor)
            return solved_orbit(guess, "amplitude", executor=executor)
    raise RunFailed(
        "wheelset", f"no steady motion within {MOST_MARCHES * MARCH_DURATION:g} s at {equations.speed:.6g} m/s"
    )


def positive_maxima(displacement_samples: Array) -> np.ndarray:
    """Indices of the positive local maxima."""
    previous_values, middle_values, next_values = (
        displacement_samples[:-2],
        displacement_samples[1:-1],
        displacement_samples[2:],
    )
    return 1 + np.flatnonzero(
        (middle_values > previous_values) & (middle_values >= next_values) & (middle_values > 0.0)
    )


def bifurcation_orbit(
    equations: WheelsetEquations,
    lowest_speed: float,
    highest_speed: float,
    time_step: float = 5e-4,
    executor: Executor | None = None,
) -> Iterator[Orbit]:
    """Limit cycles of increasing amplitude, from the critical speed on until the speed of a cycle leaves a range (m/s).

    Each at half the step (s), with the changes that halving made: of the speed, and of the frequency. Raises
    NoCriticalSpeed if no branch begins, RunFailed where it cannot be followed.
    """
    clearance = equations.wheelset.flange_clearance
    for share in FIRST_AMPLITUDES:
        try:
            first = orbit_of_small_amplitude(equations, share * clearance, time_step, executor)
            break
        except RunFailed:
            if share == FIRST_AMPLITUDES[-1]:
                raise
    inner = np.linspace(first.amplitude, clearance, INNER_AMPLITUDES)[1:]
    outer = (clearance * (1.0 + OUTER_STEP * k) for k in count(1))
    yield refined_orbit(first, "speed", executor)
    for amplitudes in (inner, outer):
        for orbit in branch_of_orbits(first, amplitudes, executor):
            if not lowest_speed <= orbit.speed <= highest_speed or orbit.amplitude > LARGEST_AMPLITUDE * clearance:
                return
            first = orbit
            yield refined_orbit(orbit, "speed", executor)
