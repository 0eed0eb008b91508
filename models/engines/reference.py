"""The hand-written reference of the pitch plane: the paper's equations, a compiled fixed-step Runge-Kutta method,
scipy's adaptive solvers."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
from numba.extending import register_jitable

from models.core.errors import RunFailed
from models.core.signals import StackedSignal
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE
from models.engines.protocol import check_landings, check_trajectory
from models.machine.compiled import closure_with_unique_name, njit
from models.vehicles.pitch_plane_equations import ADDED_TERMS, RIGHT_HAND_SIDES, parameter_numbers

FLAT_ROAD_INPUT = np.zeros((1, 4))
"""Input of a vehicle on a flat road: one row of zeros."""


def compiled_closure(closure: Any, cache_key: tuple) -> Any:
    """A compiled closure with its own index in numba's cache, which closures of one factory would otherwise share."""
    closure = closure_with_unique_name(closure, *cache_key)
    return njit(cache=True, nogil=True, error_model="numpy")(closure)  # no check for masses of zero: there are none


def _compile_fixed(right_hand_side, cache_key):
    """Compiled march with fixed classical Runge-Kutta steps for one right-hand side."""

    def march(start_state, time_step, step_count, input_table, row_offsets, parameters, states):
        """March with classical Runge-Kutta steps. ``row_offsets`` gives the distances to the rows of the input at the
        middle, at the end and at the next step."""
        k1, k2, k3, k4 = np.empty(8), np.empty(8), np.empty(8), np.empty(8)
        stage = np.empty(8)
        for j in range(8):  # a row assigned at once takes seconds to compile
            states[0, j] = start_state[j]
        to_middle, to_end, to_next = row_offsets
        for i in range(step_count):
            row = i * to_next
            middle, end = input_table[row + to_middle], input_table[row + to_end]
            right_hand_side(start_state, input_table[row], parameters, k1)
            for j in range(8):
                stage[j] = start_state[j] + 0.5 * time_step * k1[j]
            right_hand_side(stage, middle, parameters, k2)
            for j in range(8):
                stage[j] = start_state[j] + 0.5 * time_step * k2[j]
            right_hand_side(stage, middle, parameters, k3)
            for j in range(8):
                stage[j] = start_state[j] + time_step * k3[j]
            right_hand_side(stage, end, parameters, k4)
            for j in range(8):
                start_state[j] += time_step / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j])
                states[i + 1, j] = start_state[j]

    return compiled_closure(march, cache_key)


def _compile_single(right_hand_side, cache_key):
    """Compiled function (y, u, p) -> dy (8,) for one right-hand side."""

    def derivative(state, inputs, parameters):
        dy, copy = np.empty(8), state.copy()
        right_hand_side(copy, inputs, parameters, dy)
        return dy

    return compiled_closure(derivative, cache_key)


def _summed_right_hand_side(right_hand_side, added_terms):
    """Right-hand side with the terms of ``added_terms`` added to those of ``right_hand_side``."""

    def total(state, inputs, parameters, state_rates):
        right_hand_side(state, inputs, parameters, state_rates)
        added_terms(state, inputs, parameters, state_rates)

    return register_jitable(closure_with_unique_name(total, right_hand_side.__name__, added_terms.__name__))


@dataclass
class PitchPlaneReference:
    """The pitch-plane vehicle as compiled equations of motion, marched by fixed steps or by an adaptive solver."""

    assembly: Assembly
    settings: Settings

    def __post_init__(self) -> None:
        assembly = self.assembly
        terms = {"springs": assembly.vehicle.pitch_springs, "moment": assembly.moment is not None}
        lifts = any(strut.pushes_only for strut in assembly.vehicle.struts)
        equations = (
            "lift-off" if lifts else "road" if assembly.mode == "free" else assembly.mode
        )  # a flat road is a road, too
        self._key = (equations, assembly.vehicle.geometry, *(term for term, there in terms.items() if there))
        self._input = (
            assembly.input
            if assembly.input is None or assembly.moment is None
            else StackedSignal((assembly.input, assembly.moment))
        )
        self._p = parameter_numbers(assembly.parameters, assembly.vehicle)

    def run(self) -> Trajectory:
        """Trajectory over the whole duration; raises RunFailed unless it is complete and finite."""
        adaptive = CATALOGUE["reference"][self.settings.integrator].adaptive
        times, states, counts = self._march_adaptively() if adaptive else self._march_fixed()
        check_trajectory("reference", times, states, self.settings.duration)
        check_landings("reference", self.assembly, self.settings, times, states)
        enforced = self._enforced(times, states)
        check_trajectory("reference", times, states, self.settings.duration, enforcing_forces=enforced)
        return Trajectory(times, states, enforced, counts)

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (4,) in m/s^2 and rad/s^2 at a time (s), from coordinates and rates (4,)."""
        return compiled_derivative(*self._key)(np.concatenate((q, v)), self._input_at(time), self._p)[4:]

    def plan(self) -> dict[str, int]:
        """Counts of built items: coordinates, and no native items or callbacks."""
        return {"degrees of freedom": 4 - len(self.assembly.guided), "native items": 0, "callbacks": 0}

    def _input_at(self, time: float) -> np.ndarray:
        """Values of the input at a time (s)."""
        return FLAT_ROAD_INPUT[0] if self._input is None else self._input.at(time)

    def _inputs(self) -> tuple[np.ndarray, tuple[int, int, int]]:
        """The input table, and the numbers of rows from a step's start to its middle, to its end and to the next
        step."""
        signal, h, n = self._input, self.settings.step, self.settings.steps
        if signal is None:
            return FLAT_ROAD_INPUT, (0, 0, 0)
        if not signal.held:
            return signal.sample(0.0, h / 2, 2 * n + 1), (1, 2, 2)
        if signal.channels == 2:
            return signal.sample(0.0, h, n), (0, 0, 1)
        stages = signal.sample(0.0, h / 2, 2 * n + 1)
        table = np.stack([stages[0:-1:2], stages[1::2], stages[2::2]], axis=1)
        table[:, 1:, :2] = table[:, :1, :2]
        return table.reshape(3 * n, -1), (1, 2, 3)

    def _march_fixed(self) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
        """Times (n,), states (n, 8) and counts of a march in fixed steps."""
        n = self.settings.steps
        states = np.empty((n + 1, 8))
        inputs, rows = self._inputs()
        march = compiled_march(*self._key)
        march(self.assembly.initial.copy(), self.settings.step, n, inputs, rows, self._p, states)
        self._guide(states)
        return self.settings.step * np.arange(n + 1), states, {"steps": n, "force calls": 4 * n}

    def _guide(self, states: np.ndarray) -> None:
        """Write the prescribed coordinates and their rates, if any, into the states (n, 8)."""
        guided = self.assembly.guided
        if guided and self.assembly.input is not None:
            inputs = self.assembly.input.sample(0.0, self.settings.step, len(states))
            states[:, [*guided, *(4 + i for i in guided)]] = inputs[:, 2 : 2 + 2 * len(guided)]

    def _march_adaptively(self) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
        """Times (n,), states (n, 8) and counts of an adaptive integration from knot to knot of the input, which is
        smooth between knots."""
        h, n = self.settings.step, self.settings.steps
        times, states = h * np.arange(n + 1), np.empty((n + 1, 8))
        y = states[0] = self.assembly.initial
        steps = calls = 0
        for start, end, inside in self._pieces_between_knots(times, self.settings.duration):
            within = times[inside]
            dense = bool(len(within)) and within[0] < end - 1e-9 * h  # else a row at the end at most, which is y there
            solution = self._march_piece(start, end, y, dense)
            y = solution.y[:, -1]
            if len(within):
                states[inside] = solution.sol(np.minimum(within, end)).T if dense else y
            steps, calls = steps + len(solution.t) - 1, calls + solution.nfev
        states[-1] = y
        self._guide(states)
        return times, states, {"steps": steps, "force calls": calls}

    def _pieces_between_knots(self, times: np.ndarray, last_time: float) -> Iterator[tuple[float, float, slice]]:
        """Start and end (s) of each piece between knots of the input, and the slice of ``times`` (n,) within it."""
        knots = np.empty(0) if self._input is None else self._input.knots(self.settings.duration)
        small = 1e-9 * self.settings.step
        for start, end in pairwise((0.0, *knots, last_time)):
            yield start, end, slice(*np.searchsorted(times, (start + small, end + small)))

    def _march_piece(self, start_time: float, end_time: float, start_state: np.ndarray, with_dense_output: bool):
        """Solution by scipy's adaptive solver between two knots of the input, from the state y (8,)."""
        from scipy.integrate import solve_ivp

        derivative, p, at = compiled_derivative(*self._key), self._p, self._reader(start_time, end_time)

        def rhs(t, y):
            dy = derivative(y, at(t), p)
            if not math.isfinite(dy.sum()):  # scipy's explicit solvers would halve their step for ever
                raise RunFailed("reference", "the derivative became infinite or not a number", start_time)
            return dy

        tolerance = max(self.settings.tolerance, 3e-14)
        longest = math.inf if self._input is None else self._input.resolution
        solution = solve_ivp(
            rhs,
            (start_time, end_time),
            start_state,
            method=self.settings.integrator,
            dense_output=with_dense_output,
            rtol=tolerance,
            atol=tolerance * 1e-2,
            max_step=longest,
        )
        if not solution.success:
            raise RunFailed("reference", solution.message, solution.t[-1], solution.y[:, -1])
        return solution

    def _reader(self, start_time: float, end_time: float) -> Callable[[float], np.ndarray]:
        """Function of time (s) that reads the input within one piece between knots. Held forces keep their value in its
        middle; other inputs vary."""
        middle = self._input_at(0.5 * (start_time + end_time))
        if self._input is None or (self._input.held and self._input.channels == 2):
            return lambda t: middle
        if self._input.held:
            return lambda t: np.concatenate((middle[:2], self._input_at(t)[2:]))
        return self._input_at

    def _enforced(self, times: np.ndarray, states: np.ndarray) -> np.ndarray | None:
        """Moment A = I beta'' - cos(beta) (b f3 - a f4), below eq. (34), and force m3 (z3'' - g) + f3 + f4, that
        enforce a prescribed motion."""
        guided = self.assembly.guided
        if not guided or self.assembly.input is None:
            return None
        inertia = np.array([self.assembly.parameters.m3, self.assembly.parameters.I])[-len(guided) :]
        free = compiled_derivative("force", *self._key[1:])
        inputs = self.assembly.input.sample(0.0, self.settings.step, len(times))
        without = np.array([free(y, u[:2].copy(), self._p) for y, u in zip(states, inputs, strict=True)])
        return inertia * (inputs[:, -len(guided) :] - without[:, [4 + i for i in guided]])


_FIXED: dict[tuple, Any] = {}
"""Compiled marches by mode, geometry and added terms."""
_SINGLE: dict[tuple, Any] = {}
"""Compiled right-hand sides by mode, geometry and added terms."""


def _right_hand_side(input_mode: str, geometry: str, *added_terms: str):
    """Right-hand side of the equations for one mode and geometry, with the added terms."""
    return reduce(
        _summed_right_hand_side, (ADDED_TERMS[name] for name in added_terms), RIGHT_HAND_SIDES[input_mode, geometry]
    )


def compiled_march(input_mode: str, geometry: str, *added_terms: str):
    """The compiled fixed-step march for one mode and geometry with the terms ``added_terms``, compiled at the first
    request."""
    key = (input_mode, geometry, *added_terms)
    if key not in _FIXED:
        _FIXED[key] = _compile_fixed(_right_hand_side(*key), key)
    return _FIXED[key]


def compiled_derivative(input_mode: str, geometry: str, *added_terms: str):
    """The compiled right-hand side (y, u, p) -> dy (8,) for one mode and geometry with the terms ``added_terms``,
    compiled at the first request."""
    key = (input_mode, geometry, *added_terms)
    if key not in _SINGLE:
        _SINGLE[key] = _compile_single(_right_hand_side(*key), key)
    return _SINGLE[key]


def build(assembly: Assembly, run_settings: Settings) -> PitchPlaneReference:
    """The reference model of a pitch-plane assembly."""
    return PitchPlaneReference(assembly, run_settings)
