"""Test problems: a wheel rolls at 1, 5 or 20 m/s with creep forces by FASTSIM, and is released from a sliding state.

The creep forces are those of the engines' callback in every solver, so that what differs is the integrator. They have
kinks wherever a cell begins to slip or to stick, so that no method keeps an order above two, and at low speed not even
that: the order of the others is left open. They damp like 1 / speed: the slower the wheel, the shorter the steps of
explicit methods, although nothing moves fast any more. The reference is a Runge-Kutta method beside a stiff multistep
one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy.integrate import solve_ivp

from models.advice.price.problem import Setting
from models.contact.inputs import Array
from models.core.errors import Refused, RunFailed
from models.engines.catalogue import UNAVAILABLE_INTEGRATORS
from models.engines.contact_bridge import FREEDOMS, RailWheels, add_forces, check_step, forces, linearised_wheels
from models.engines.contact_bridge_exudyn import RailWheelSystem, WheelForceFunctions
from models.engines.contact_bridge_mujoco import rail_wheel_model
from models.engines.exudyn_system import solver_counts
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_march import Marcher
from models.engines.mujoco_quiet import installed_callback
from models.engines.stability import LONG_RUN, longest_stable_step
from models.machine.compiled import njit
from models.machine.stack import start
from validation.contact.slow_wheels import counting_calls
from validation.price.force_calls import START_FORCE_CALLS
from validation.price.problems.road_excited import STAGES_OF_METHOD, setting

DURATION = 0.1
"""s"""
CONTACT_CELLS = 11
START_FACTORS = np.array([1.0, 1.0, 0.0, 1.0])
"""Factors (4,) on the start coordinates and rates of the wheel; the third is 0: it starts in balance on its rail."""
SMOOTH_SPEED = 20.0
"""Speed (m/s) from which the observed order of second-order methods is judged."""
JACOBIAN_EVALUATIONS = 16
"""Force evaluations that one Jacobian of the creep forces counts as."""
MILLISECOND = 1e-3
REFERENCE_SOLVERS = (("DOP853", 1e-12), ("LSODA", 1e-12))
"""Reference solvers with their relative tolerances."""
STEP_RATIOS = (0.5, 1, 1.5, 2, 3, 5, 8)
"""Number of steps of an explicit method divided by the fewest with which it is stable; the first is to be refused."""
JACOBIAN_SUFFIX = "with slopes"
"""Suffix of Exudyn's implicit methods that get the Jacobian of the linear creep theory; without it, Exudyn computes
the Jacobian by differences of the forces."""
EXPLICIT_METHODS = {
    "reference": ("RK4",),
    "exudyn": ("RK44", "RK67", "RK33", "ExplicitMidpoint", "ExplicitEuler", "VelocityVerlet"),
    "mujoco": ("RK4", "Euler", "implicit", "implicitfast", "discrete"),
}
_LONG_STEPS = (
    10 * MILLISECOND,
    5 * MILLISECOND,
    4 * MILLISECOND,
    2 * MILLISECOND,
    1 * MILLISECOND,
    0.5 * MILLISECOND,
    0.25 * MILLISECOND,
    0.125 * MILLISECOND,
    0.0625 * MILLISECOND,
    0.02 * MILLISECOND,
)
_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
OTHER_CURVES: dict[tuple[str, str], tuple[float, ...]] = {
    ("reference", "DOP853"): _TOLERANCES[:6],
    ("reference", "Radau"): (1e-1, 3e-2, *_TOLERANCES[:4]),
    ("reference", "LSODA"): _TOLERANCES,
    ("exudyn", "GeneralizedAlpha 0.9"): _LONG_STEPS,
    ("exudyn", f"GeneralizedAlpha {JACOBIAN_SUFFIX}"): _LONG_STEPS,
    ("exudyn", "TrapezoidalIndex2"): _LONG_STEPS,
    ("exudyn", f"TrapezoidalIndex2 {JACOBIAN_SUFFIX}"): _LONG_STEPS,
    ("exudyn", "DOPRI5"): _TOLERANCES,
    ("exudyn", "ODE23"): _TOLERANCES,
    ("exudyn", "DVERK6"): (1e-6,),
    ("mujoco", "Euler"): (2 * MILLISECOND,),
}
"""Steps (s) or tolerances, by engine and method, that are not chosen by stability; MuJoCo's step is its default."""
LARGEST_STEP = 5 * MILLISECOND
"""Largest step (s) of Exudyn's adaptive methods."""
QUICK_STEPS: dict[tuple[str, str], tuple[float, ...]] = {
    ("reference", "RK4"): (0.25 * MILLISECOND, 0.125 * MILLISECOND),
    ("exudyn", "GeneralizedAlpha 0.9"): (10 * MILLISECOND, 2 * MILLISECOND, 1 * MILLISECOND, 0.5 * MILLISECOND),
    ("mujoco", "Euler"): (2 * MILLISECOND, 0.25 * MILLISECOND, 0.125 * MILLISECOND, 0.05 * MILLISECOND),
}
"""Steps (s), by engine and method, that the quick report takes."""


@dataclass(frozen=True)
class WheelsetResult:
    """Result of a run: final coordinates and rates (8,) of the wheel, and counts of work."""

    state: Array
    counts: dict[str, int]


@dataclass(frozen=True)
class WheelsetSolver:
    """A run of the rolling wheel by one method, ready to start."""

    run: Callable[[], WheelsetResult]


@njit(cache=True, error_model="numpy")
def rates(wheel_state, creep_table, suspension_table, state_rate):
    """Fill ``state_rate`` (2 n,) with the time derivatives of coordinates and rates (2 n,) of rolling wheels;
    suspension_table (3, n) : masses, stiffnesses and dampings."""
    n = suspension_table.shape[1]
    state_rate[:n] = wheel_state[n:]
    state_rate[n:] = 0.0
    position, rate, force = wheel_state[:n].copy(), wheel_state[n:].copy(), np.zeros(n)
    forces(start(creep_table), 0.0, start(position), start(rate), start(force))
    for i in range(n):
        state_rate[n + i] = (
            force[i] - suspension_table[1, i] * position[i] - suspension_table[2, i] * rate[i]
        ) / suspension_table[0, i]


@njit(cache=True, error_model="numpy")
def march(wheel_state, creep_table, suspension_table, time_step, step_count):
    """Advance ``wheel_state`` (2 n,) in place by ``step_count`` steps of ``time_step`` s by RK4."""
    total, rate = np.empty(wheel_state.size), np.empty(wheel_state.size)
    for _ in range(step_count):
        total[:] = 0.0
        for stage in range(4):
            stage_state = wheel_state.copy()
            if stage > 0:
                stage_state += (time_step if stage == 3 else 0.5 * time_step) * rate
            rates(stage_state, creep_table, suspension_table, rate)
            total += (1.0 if stage % 3 == 0 else 2.0) * rate
        wheel_state += time_step / 6.0 * total


class RollingWheels:
    """Test problem: a rolling wheel with FASTSIM, with its reference solution; a
    ``models.advice.price.problem.WorkPrecisionProblem``."""

    duration = DURATION
    note = (
        f"Errors at the end. Every set of slopes that is given to an implicit method counts as {JACOBIAN_EVALUATIONS} "
        "force "
        "calls; Exudyn's own differences count by themselves."
    )
    tolerances: tuple[float, ...] = (10.0, 1.0, 0.1, 0.01)

    def __init__(self, speed: float) -> None:
        self.units = {"creep force": "N", "displacement": "m"}
        self.key = f"wheel-{speed:g}"
        self.title = f"A wheel with FASTSIM at {speed:g} m/s, released from sliding, {DURATION:g} s"
        self.wheels = RailWheels(1, cells=CONTACT_CELLS, speed=speed)
        self._start = np.concatenate([state_part * START_FACTORS for state_part in self.wheels.state()])
        self._table = np.array([self.wheels.masses, self.wheels.stiffness, self.wheels.damping])
        self.reference = " and ".join(f"{method} at {tolerance:g}" for method, tolerance in REFERENCE_SOLVERS)
        self._true, other_solution = (self.read(self._run_by_method(*solver).state) for solver in REFERENCE_SOLVERS)
        self.uncertainty = self._channel_errors(other_solution)
        self.bound = self.wheels.mu * self.wheels.load

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """Settings of all curves, or for the quick report of QUICK_STEPS."""
        chosen = [*QUICK_STEPS.items()] if quick else [*self._explicit_curves(), *OTHER_CURVES.items()]
        return tuple(self.setting(*curve, value) for curve, values in chosen for value in values)

    def _explicit_curves(self) -> list[tuple[tuple[str, str], tuple[float, ...]]]:
        """Pairs of a curve (engine, method) and its steps (s), chosen by the stability limit of each explicit
        method."""
        curves = []
        for engine, method in ((engine, method) for engine, methods in EXPLICIT_METHODS.items() for method in methods):
            like = "Euler" if method == "discrete" else method
            fewest = math.ceil(
                1.02
                * DURATION
                / longest_stable_step(like, 10 * MILLISECOND, LONG_RUN * MILLISECOND, linearised_wheels(self.wheels))
            )
            curves.append(
                ((engine, method), tuple(DURATION / round(step_ratio * fewest) for step_ratio in STEP_RATIOS))
            )
        return curves

    def setting(self, engine: str, method: str, step_or_tolerance: float) -> Setting:
        """Setting of an engine and a method with a step (s) or tolerance; without an order if the forces are not smooth
        enough for it."""
        made_setting = setting(engine, method, step_or_tolerance)
        keeps_order = made_setting.order <= (2 if self.wheels.speed >= SMOOTH_SPEED else 1)
        return made_setting if keeps_order else replace(made_setting, order=0, nominal=made_setting.order)

    def build(self, setting: Setting) -> WheelsetSolver:
        """The wheel in the engine of a setting, ready to run; raises Refused for an unstable step or a missing
        method."""
        method = setting.method.split()[0]
        if (setting.engine, method) in UNAVAILABLE_INTEGRATORS:
            raise Refused(setting.engine, UNAVAILABLE_INTEGRATORS[setting.engine, method])
        if setting.engine == "exudyn":
            return self._solver_in_exudyn(setting, method)
        steps = round(DURATION / setting.value)
        if setting.engine == "mujoco":
            return self._solver_in_mujoco(method, steps)
        if not setting.adaptive:
            check_step("reference", self.wheels, method, setting.value, steps)
        return WheelsetSolver(partial(self._run_by_method, method, setting.value))

    def errors(self, solution: WheelsetResult) -> dict[str, float]:
        """Largest errors at the end of the run: of a creep force (N), and of a displacement (m)."""
        return self._channel_errors(self.read(solution.state))

    def read(self, state: Array) -> dict[str, Array]:
        """Creep forces (2,) in N and displacements (2,) in m of a state (8,), longitudinal and lateral."""
        force = np.zeros(FREEDOMS)
        add_forces(self.wheels.numbers, state[:FREEDOMS].copy(), state[FREEDOMS:].copy(), force)
        return {"creep force": force[:2], "displacement": state[:2]}

    def _channel_errors(self, computed_channels: dict[str, Array]) -> dict[str, float]:
        return {name: float(np.abs(values - self._true[name]).max()) for name, values in computed_channels.items()}

    def _run_by_method(self, method_name: str, step_or_tolerance: float) -> WheelsetResult:
        """Final state by the hand-written equations: with RK4 at a step (s), or with scipy at a relative tolerance."""
        state, numbers = self._start.copy(), self.wheels.numbers
        if method_name == "RK4":
            steps = round(DURATION / step_or_tolerance)
            march(state, numbers, self._table, DURATION / steps, steps)
            return WheelsetResult(state, {"steps": steps, "force calls": 4 * steps})

        def derivative(t: float, y: Array) -> Array:
            rates(y, numbers, self._table, state_rate := np.empty(y.size))
            return state_rate

        solution = solve_ivp(
            derivative, (0.0, DURATION), state, method_name, rtol=step_or_tolerance, atol=1e-6 * step_or_tolerance
        )
        if not solution.success:
            raise RunFailed("reference", solution.message)
        return WheelsetResult(solution.y[:, -1], {"steps": solution.t.size - 1, "force calls": int(solution.nfev)})

    def _solver_in_mujoco(self, method_name: str, step_count: int) -> WheelsetSolver:
        marcher = Marcher(rail_wheel_model(self.wheels, DURATION / step_count, method_name))

        def run() -> WheelsetResult:
            with installed_callback(kernel_law(forces)):
                state = marcher.run(self._start[None], step_count)[0, -1]
            return WheelsetResult(
                state, {"steps": step_count, "force calls": STAGES_OF_METHOD[method_name] * step_count}
            )

        return WheelsetSolver(run)

    def _solver_in_exudyn(self, setting: Setting, method_name: str) -> WheelsetSolver:
        calls, law = [0], WheelForceFunctions(self.wheels)
        slopes = (
            counting_calls(law.slopes, calls, JACOBIAN_EVALUATIONS)
            if setting.method.endswith(JACOBIAN_SUFFIX)
            else None
        )
        rolling = RailWheelSystem(self.wheels, counting_calls(law.of, calls), force_slopes=slopes)
        steps = round(DURATION / (LARGEST_STEP if setting.adaptive else setting.value))
        tolerance = setting.value if setting.adaptive else 0.0

        def run() -> WheelsetResult:
            calls[0] = 0
            q, v = np.split(self._start, 2)
            state = rolling.run(q, v, steps, DURATION / steps, method_name, tolerance)
            return WheelsetResult(
                state, {**solver_counts(rolling.mbs), "force calls": calls[0] - START_FORCE_CALLS.get(method_name, 0)}
            )

        return WheelsetSolver(run)


@cache
def problem(is_quick: bool, speed: float) -> RollingWheels:
    """The test problem of a wheel that rolls at a speed (m/s); its reference is computed once per process."""
    return RollingWheels(speed)
