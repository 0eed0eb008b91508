"""Problem D: an anti-lock stop of a quarter vehicle from snow on to a wet road.

The valves are those that a slip controller set in one fine run, replayed to every solver alike: in the loop itself one
valve that changes a sample earlier moves the distance by more than any step, and the error would not be the step's.
The torque is given at the ends of all steps, and linear between them. No method keeps an order above one for sure: the
tyre's table has kinks, friction changes in one place, the wheel locks, and torque has a kink where pressure passes the
push-out. Those above are therefore left open.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from models.advice.price.problem import Setting
from models.brake.brake import PAPER_FRONT, of_wheels
from models.brake.controller import SAMPLE, Command, Controller, Sample
from models.brake.controllers import CONTROLLERS
from models.brake.pressure import Chambers, by_valves, resting_chambers
from models.brake.quarter import braked
from models.brake.surfaces import Stretch, road
from models.core.errors import RunFailed
from models.systems.braking.march import BrakedVehicle, on_tyres
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import stacked_tables
from validation.braking.quarter_stops import FRONT_WHEEL, FrictionChange, FrictionCurve, stop_by_scheme
from validation.braking.sampled_quarter import EMPTY, FILL, SUPPLY, reference_distance_on_stretches

SURFACES, SURFACE_CHANGE, SPEED = ("snow", "wet"), 10.0, 11.11
"""Surfaces, where the second begins (m), speed at the start (m/s)."""
REPLAY_SUBSTEPS = 64
"""Substeps of the run whose valves are replayed."""
EXTRA_SAMPLES = 40
"""Samples for which the last valves are kept: time for schemes that stop late."""
OWN_METHOD, EULER, RK4, LITERAL = "exact wheel", "Euler", "RK4", "literal"
CALLS_PER_STEP = {OWN_METHOD: 2, EULER: 1, RK4: 4, LITERAL: 1}
"""Force calls of a step; of ours, walks from node to node of the tyre's table."""
DEFAULT_METHODS = {(OWN_METHOD, BrakedVehicle.substeps): "twinrig", (LITERAL, 1): "paper"}
"""Whose default a method with so many steps in a sample is."""
SUBSTEPS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)
ORDERS = {EULER: 1, LITERAL: 1}
FULL_STEPS = {OWN_METHOD: SUBSTEPS, EULER: SUBSTEPS, RK4: SUBSTEPS, LITERAL: SUBSTEPS}
QUICK_SUBSTEPS = {OWN_METHOD: (1, 2, 4, 8, 16), EULER: (8, 64), RK4: (8, 64), LITERAL: (1, 16, 64, 256)}
"""The named share of FULL_STEPS that the quick report takes, from half the speed; the paper's own single step is far
from where its order shows."""
SOLVERS = {True: (("DOP853", 1e-10), ("LSODA", 1e-10)), False: (("DOP853", 1e-12), ("LSODA", 1e-11))}
"""Reference solvers with their relative tolerances, by ``quick``: a Runge-Kutta method and a multistep one."""


@dataclass
class TapedController:
    """Wrapper of a controller that records the valve commands."""

    controller: Controller
    valves: list[int]

    def sample(self, sample: Sample) -> Command:
        """Command of the wrapped controller for a sample."""
        command = self.controller.sample(sample)
        self.valves.append(int(np.asarray(command.valves)[0]))
        return Command(valves=np.array(self.valves[-1:]))


@dataclass(frozen=True)
class ReplayedController:
    """A controller that replays recorded valve commands and repeats the last one for ever."""

    valves: np.ndarray

    def sample(self, sample: Sample) -> Command:
        """The recorded valve command of a sample."""
        return Command(valves=self.valves[min(sample.number, self.valves.size - 1), None])


@dataclass(frozen=True)
class StopResult:
    """Stopping distance (m), and counts of steps and calls."""

    distance: float
    counts: dict[str, int]


@dataclass(frozen=True)
class StopSolver:
    """A stop by one method, ready to run."""

    run: Callable[[], StopResult]


class BrakingStop:
    """Test problem: a braking stop with its reference solution; see ``validation.price.problems.Problem``."""

    key = "braking"
    note = (
        f"Steps are those of {1e3 * SAMPLE:g} ms, the paper's, and its parts. The exact wheel walks twice in one, "
        "from node to node; literal is the paper's scheme as it is written. An engine that carries the chassis "
        "leaves wheel and tyre with the exact step, and gives its digits."
    )

    def __init__(self, quick: bool) -> None:
        self.speed, self.change = (SPEED / 2, SURFACE_CHANGE / 4) if quick else (SPEED, SURFACE_CHANGE)
        self.title = (
            f"Anti-lock stop of a quarter vehicle from {self.speed:.4g} m/s, {SURFACES[0]} and from "
            f"{self.change:g} m on {SURFACES[1]}, valves replayed"
        )
        self.units, self.bound = {"stopping distance": "m"}, 10.0
        self.tolerances: tuple[float, ...] = (1e-2, 1e-3) if quick else (1e-2, 1e-3, 1e-4)
        self._tables = [table_of_surface(name) for name in SURFACES]
        self.slips = np.unique(np.concatenate([table.slips for table in self._tables]))
        self.mu = np.array([np.interp(self.slips, table.slips, table.mu_x[0, 0]) for table in self._tables])
        self._road = road([Stretch(0.0, 0, 0), Stretch(self.change, 1, 1)])
        self._chambers, self._brakes = Chambers(np.array([FILL]), np.array([EMPTY]), SUPPLY), of_wheels(PAPER_FRONT)
        self.valves = self._taped_commands()
        self.duration = self.valves.size * SAMPLE
        solvers = SOLVERS[quick]
        self.reference = " and ".join(f"{method} at {tolerance:g}" for method, tolerance in solvers)
        self.true, other_distance = (self._distance_by_scipy(*solver_arguments) for solver_arguments in solvers)
        self.uncertainty = {"stopping distance": abs(self.true - other_distance)}

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """FULL_STEPS, or its named share QUICK."""
        chosen = QUICK_SUBSTEPS if quick else FULL_STEPS
        return tuple(
            self.setting("reference", method, SAMPLE / n)
            for method, substep_counts in chosen.items()
            for n in substep_counts
        )

    def setting(self, engine: str, method: str, step_or_tolerance: float) -> Setting:
        """A setting: curve, and the longest step (s) up to ``step_or_tolerance`` that divides a sample."""
        substeps = math.ceil(SAMPLE / step_or_tolerance * (1 - 1e-9))
        return Setting(
            engine,
            method,
            SAMPLE / substeps,
            ORDERS.get(method, 0),
            default=DEFAULT_METHODS.get((method, substeps), ""),
        )

    def build(self, setting: Setting) -> StopSolver:
        """The stop by one method in steps."""
        substeps = round(SAMPLE / setting.value)
        run = self._stop_by_twinrig if setting.method == OWN_METHOD else partial(self._stop_by_method, setting.method)
        return StopSolver(partial(run, substeps))

    def errors(self, solution: StopResult) -> dict[str, float]:
        """Errors of a solution's stopping distance."""
        return {"stopping distance": abs(solution.distance - self.true)}

    def _taped_commands(self) -> np.ndarray:
        """Valve commands (n,) of the controller's own run, one per sample, with the last one repeated for some
        samples."""
        tape = TapedController(CONTROLLERS["slip_bang_bang"](1), [])
        vehicle = on_tyres(
            FRONT_WHEEL.plane, self._tables, self._brakes, self._chambers, self._road, substeps=REPLAY_SUBSTEPS
        )
        vehicle.run(tape, self.speed)
        return np.array(tape.valves + [tape.valves[-1]] * EXTRA_SAMPLES)

    def _distance_by_scipy(self, method: str, tolerance: float) -> float:
        """Stopping distance (m) by scipy, where changes of friction, locking and release are events."""
        stretches = [(begin, partial(self._friction, i)) for i, begin in enumerate((0.0, self.change))]
        return reference_distance_on_stretches(
            FRONT_WHEEL, PAPER_FRONT, stretches, ReplayedController(self.valves), self.speed, tolerance, method
        )

    def _friction(self, i: int, slip: float) -> float:
        return float(np.interp(slip, self.slips, self.mu[i]))

    def _torques(self, substeps: int) -> np.ndarray:
        """Brake torque (N m) at the ends of all steps."""
        air, substep_torques = resting_chambers(self._chambers, SAMPLE), np.zeros((substeps + 1, 1))
        torques = [np.zeros(1)]
        for valve in self.valves:
            by_valves(np.array([valve]), SAMPLE, air, self._chambers, self._brakes, substep_torques)
            torques.append(substep_torques[1:, 0].copy())
        return np.concatenate(torques)

    def _stop_by_twinrig(self, substeps: int) -> StopResult:
        stop = braked(
            FRONT_WHEEL,
            stacked_tables(self._tables),
            self._road,
            self._torques(substeps),
            SAMPLE / substeps,
            self.speed,
        )
        if stop.step_of_rest < 0:
            raise RunFailed("reference", "it does not stop", self.duration)
        return StopResult(
            stop.distance, {"steps": stop.step_of_rest, "force calls": CALLS_PER_STEP[OWN_METHOD] * stop.step_of_rest}
        )

    def _stop_by_method(self, method: str, substeps: int) -> StopResult:
        number = (EULER, RK4, LITERAL).index(method)
        torques, step = self._torques(substeps), SAMPLE / substeps
        friction = FrictionChange(
            FrictionCurve(self.slips, self.mu[0]), FrictionCurve(self.slips, self.mu[1]), self.change
        )
        distance, steps, _ = stop_by_scheme(number, FRONT_WHEEL, torques, friction, self.speed, step)
        if steps < 0:
            raise RunFailed("reference", "it does not stop", self.duration)
        return StopResult(distance, {"steps": steps, "force calls": CALLS_PER_STEP[method] * steps})


@cache
def problem(quick: bool) -> BrakingStop:
    """The problem, its reference computed once per process."""
    return BrakingStop(quick)
