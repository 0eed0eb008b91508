"""Problem C: a wheel that rolls with FASTSIM, released from where it slides, along the rail and across.

The creep forces are those of the engines' callback in every solver, so that what differs is the integrator. They have
kinks wherever a cell begins to slip or to stick, so that no method keeps an order above two: the order of the others is
left open. Explicit methods are held to short steps by the contact's own spring, although it is at rest here.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.compiled import njit
from models.contact.inputs import Array
from models.contact.stack import start
from models.engines.contact_bridge import Wheels, check_step, forces
from models.engines.contact_bridge_exudyn import Forces, Rolling
from models.engines.contact_bridge_mujoco import Marcher, model, native_law
from models.engines.mujoco_callback import installed
from models.errors import RunFailed
from validation.price.problems import Setting
from validation.price.problems.road_excited import STAGES, setting

DURATION = 0.1
"""s"""
CELLS = 11
LEVEL = np.array([1.0, 1.0, 0.0, 1.0])
"""The wheel begins at rest on its rail."""
PLACES = 16
"""Evaluations behind one set of slopes."""
MS = 1e-3
SPEED = 20.0
_STEPS = (2 * MS, 1.25 * MS, 1 * MS, 0.5 * MS, 0.25 * MS, 0.125 * MS, 0.05 * MS, 0.025 * MS, 0.0125 * MS)
_LONG = (10 * MS, 5 * MS, 4 * MS, 2 * MS, 1 * MS, 0.5 * MS, 0.25 * MS, 0.125 * MS)
_TIGHT = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
FULL: dict[tuple[str, str], tuple[float, ...]] = {
    ("reference", "RK4"): _STEPS,
    ("reference", "DOP853"): (*_TIGHT, 1e-10),
    ("reference", "Radau"): _TIGHT,
    ("exudyn", "RK44"): _STEPS,
    ("exudyn", "GeneralizedAlpha 0.9"): _LONG,
    ("exudyn", "TrapezoidalIndex2"): _LONG,
    ("mujoco", "RK4"): _STEPS,
    ("mujoco", "Euler"): _STEPS,
}
QUICK: dict[tuple[str, str], tuple[float, ...]] = {
    ("reference", "RK4"): (0.25 * MS, 0.125 * MS),
    ("exudyn", "GeneralizedAlpha 0.9"): (10 * MS, 2 * MS, 1 * MS, 0.5 * MS),
    ("mujoco", "Euler"): (2 * MS, 0.25 * MS, 0.125 * MS, 0.05 * MS),
}
"""The named share of FULL that the quick report takes."""


@dataclass(frozen=True)
class Result:
    """Places and rates at the end (8,), and what they took."""

    state: Array
    counts: dict[str, int]


@dataclass(frozen=True)
class Solver:
    """A run that is ready."""

    run: Callable[[], Result]


@njit(cache=True, error_model="numpy")
def rates(state, numbers, table, out):
    """Fill ``out`` (2 n,) with the rates of places and rates; table (3, n) : masses, springs and dampers."""
    n = table.shape[1]
    out[:n] = state[n:]
    out[n:] = 0.0
    position, rate, force = state[:n].copy(), state[n:].copy(), np.zeros(n)
    forces(start(numbers), start(position), start(rate), start(force))
    for i in range(n):
        out[n + i] = (force[i] - table[1, i] * position[i] - table[2, i] * rate[i]) / table[0, i]


@njit(cache=True, error_model="numpy")
def march(state, numbers, table, step, count):
    """RK4: ``count`` steps (s) from ``state``, which is moved."""
    total, rate = np.empty(state.size), np.empty(state.size)
    for _ in range(count):
        total[:] = 0.0
        for stage in range(4):
            here = state.copy()
            if stage > 0:
                here += (step if stage == 3 else 0.5 * step) * rate
            rates(here, numbers, table, rate)
            total += (1.0 if stage % 3 == 0 else 2.0) * rate
        state += step / 6.0 * total


class RollingWheels:
    """The problem with its reference; see ``validation.price.problems.Problem``."""

    key = "wheels"
    duration = DURATION
    note = f"Every set of slopes that an implicit method asks for counts as {PLACES} force calls."

    def __init__(self, quick: bool) -> None:
        self.title = f"A wheel with FASTSIM at {SPEED:g} m/s, released from sliding, {DURATION:g} s"
        self.wheels, self.units = Wheels(1, cells=CELLS, speed=SPEED), {"place": "m, rad"}
        self.tolerances: tuple[float, ...] = (1e-6, 1e-7, 1e-8)
        self._start = np.concatenate([part * LEVEL for part in self.wheels.state()])
        springs = [np.array(values) for values in (self.wheels.stiffness, self.wheels.damping)]
        self._table = np.array([self.wheels.masses, *springs])
        solvers = (("DOP853", 1e-12), ("DOP853", 1e-11) if quick else ("Radau", 1e-9))
        self.reference = " and ".join(f"{method} at {tolerance:g}" for method, tolerance in solvers)
        self._true, other = (self._by(*one).state[: self.wheels.size] for one in solvers)
        self.uncertainty = {"place": float(np.abs(self._true - other).max())}
        self.bound = 10.0 * float(np.abs(self._start[: self.wheels.size]).max())

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """FULL, or its named share QUICK."""
        chosen = QUICK if quick else FULL
        return tuple(self.setting(*curve, value) for curve, values in chosen.items() for value in values)

    def setting(self, engine: str, method: str, value: float) -> Setting:
        """A setting of this problem by its curve and its step (s) or tolerance."""
        made = setting(engine, method, value)
        return made if made.order <= 2 else replace(made, order=0)

    def build(self, setting: Setting) -> Solver:
        """The wheel in one engine; Refused for a step that the method cannot take."""
        method = setting.method.split()[0]
        if setting.engine == "reference":
            if not setting.adaptive:
                check_step("reference", self.wheels, method, setting.value, round(DURATION / setting.value))
            return Solver(partial(self._by, method, setting.value))
        steps = round(DURATION / setting.value)
        return (self._mujoco if setting.engine == "mujoco" else self._exudyn)(method, steps)

    def errors(self, solution: Result) -> dict[str, float]:
        """Largest error of any place at the end."""
        return {"place": float(np.abs(solution.state[: self.wheels.size] - self._true).max())}

    def _by(self, method: str, value: float) -> Result:
        """The written equations by RK4 in steps, or by scipy at a relative tolerance."""
        state, numbers = self._start.copy(), self.wheels.numbers
        if method == "RK4":
            steps = round(DURATION / value)
            march(state, numbers, self._table, DURATION / steps, steps)
            return Result(state, {"steps": steps, "force calls": 4 * steps})
        out = np.empty(state.size)

        def derivative(t: float, y: Array) -> Array:
            rates(y, numbers, self._table, out)
            return out.copy()

        done = solve_ivp(derivative, (0.0, DURATION), state, method, rtol=value, atol=1e-6 * value)
        if not done.success:
            raise RunFailed("reference", done.message)
        return Result(done.y[:, -1], {"steps": done.t.size - 1, "force calls": int(done.nfev)})

    def _mujoco(self, method: str, steps: int) -> Solver:
        marcher = Marcher(model(self.wheels, DURATION / steps, method))

        def run() -> Result:
            with installed(native_law()):
                state = marcher.run(self._start[None], steps)[0, -1]
            return Result(state, {"steps": steps, "force calls": STAGES[method] * steps})

        return Solver(run)

    def _exudyn(self, method: str, steps: int) -> Solver:
        calls, law, implicit = [0], Forces(self.wheels), method not in STAGES

        def of(q: Any, v: Any) -> Any:
            calls[0] += 1
            return law.of(q, v)

        def slopes(q: Any, v: Any, by_q: float, by_v: float) -> Array:
            calls[0] += PLACES
            return law.slopes(q, v, by_q, by_v)

        rolling, n = Rolling(self.wheels, of, slopes=slopes if implicit else None), self.wheels.size

        def run() -> Result:
            calls[0] = 0
            state = rolling.run(self._start[:n], self._start[n:], steps, DURATION / steps, method)
            return Result(state, {"steps": steps, "force calls": calls[0]})

        return Solver(run)


@cache
def problem(quick: bool) -> RollingWheels:
    """The problem, its reference computed once per process."""
    return RollingWheels(quick)
