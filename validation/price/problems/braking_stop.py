"""Test problem: an anti-lock braking stop of a quarter vehicle that rolls from snow on to a wet road.

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
from models.brake.brake import PAPER_FRONT_BRAKE, brakes_of_wheels
from models.brake.controller import SAMPLING_PERIOD, Command, Controller, Sample
from models.brake.controllers import CONTROLLERS
from models.brake.pressure import BrakeChambers, advance_by_valves, air_at_rest
from models.brake.quarter import stop_of_quarter_vehicle
from models.brake.surfaces import RoadStretch, road_of_stretches
from models.core.errors import RunFailed
from models.systems.braking.march import BrakedVehicle, braked_vehicle_on_tyres
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import stacked_tables
from validation.braking.quarter_stops import FRONT_WHEEL, FrictionChange, FrictionCurve, stop_by_scheme
from validation.braking.sampled_quarter import EMPTY, FILL, SUPPLY, reference_distance_on_stretches

SURFACES, SURFACE_CHANGE, SPEED = ("snow", "wet"), 10.0, 11.11
"""Surfaces of the road, distance (m) at which the second begins, and initial speed (m/s)."""
REPLAY_SUBSTEPS = 64
"""Substeps per sample of the run whose valve commands are replayed."""
EXTRA_SAMPLES = 40
"""Number of samples for which the last valve command is repeated, for schemes that stop late."""
EXACT_WHEEL_METHOD, EULER, RK4, LITERAL = "exact wheel", "Euler", "RK4", "literal"
CALLS_PER_STEP = {EXACT_WHEEL_METHOD: 2, EULER: 1, RK4: 4, LITERAL: 1}
"""Force calls per step by method; those of the exact wheel are walks from node to node of the tyre's table."""
DEFAULT_METHODS = {(EXACT_WHEEL_METHOD, BrakedVehicle.substeps): "twinrig", (LITERAL, 1): "paper"}
"""For a (method, number of steps per sample), the owner whose default it is."""
ALL_SUBSTEPS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)
METHOD_ORDERS = {EULER: 1, LITERAL: 1}
FULL_SUBSTEPS = {EXACT_WHEEL_METHOD: ALL_SUBSTEPS, EULER: ALL_SUBSTEPS, RK4: ALL_SUBSTEPS, LITERAL: ALL_SUBSTEPS}
QUICK_SUBSTEPS = {EXACT_WHEEL_METHOD: (1, 2, 4, 8, 16), EULER: (8, 64), RK4: (8, 64), LITERAL: (1, 16, 64, 256)}
"""Substeps per sample, by method, of the quick report, whose stop begins at half the speed; the paper's single step
is far from where its order shows."""
REFERENCE_SOLVERS = {True: (("DOP853", 1e-10), ("LSODA", 1e-10)), False: (("DOP853", 1e-12), ("LSODA", 1e-11))}
"""Reference solvers with their relative tolerances, by ``quick``: a Runge-Kutta method and a multistep one."""


@dataclass
class RecordingController:
    """Controller that passes samples on to another controller and records its valve commands."""

    controller: Controller
    valves: list[int]

    def sample(self, sample: Sample) -> Command:
        """Valve command of the wrapped controller for a sample."""
        command = self.controller.sample(sample)
        self.valves.append(int(np.asarray(command.valves)[0]))
        return Command(valves=np.array(self.valves[-1:]))


@dataclass(frozen=True)
class ReplayedController:
    """Controller that replays recorded valve commands (n,), one per sample, and then repeats the last one."""

    valves: np.ndarray

    def sample(self, sample: Sample) -> Command:
        """The recorded valve command of a sample."""
        return Command(valves=self.valves[min(sample.number, self.valves.size - 1), None])


@dataclass(frozen=True)
class StopResult:
    """Result of a stop: stopping distance (m), and counts of steps and force calls."""

    distance: float
    counts: dict[str, int]


@dataclass(frozen=True)
class StopSolver:
    """A braking stop by one integration method, ready to run."""

    run: Callable[[], StopResult]


class BrakingStop:
    """Test problem: a braking stop with its reference solution; a
    ``models.advice.price.problem.WorkPrecisionProblem``.
    """

    key = "braking"
    note = (
        f"Steps are those of {1e3 * SAMPLING_PERIOD:g} ms, the paper's, and its parts. The exact wheel walks "
        "twice in one, from node to node; literal is the paper's scheme as it is written. An engine that carries "
        "the chassis leaves wheel and tyre with the exact step, and gives its digits."
    )

    def __init__(self, is_quick: bool) -> None:
        self.speed, self.change = (SPEED / 2, SURFACE_CHANGE / 4) if is_quick else (SPEED, SURFACE_CHANGE)
        self.title = (
            f"Anti-lock stop of a quarter vehicle from {self.speed:.4g} m/s, {SURFACES[0]} and from "
            f"{self.change:g} m on {SURFACES[1]}, valves replayed"
        )
        self.units, self.bound = {"stopping distance": "m"}, 10.0
        self.tolerances: tuple[float, ...] = (1e-2, 1e-3) if is_quick else (1e-2, 1e-3, 1e-4)
        self._tables = [table_of_surface(name) for name in SURFACES]
        self.slips = np.unique(np.concatenate([table.slips for table in self._tables]))
        self.mu = np.array([np.interp(self.slips, table.slips, table.mu_x[0, 0]) for table in self._tables])
        self._road = road_of_stretches([RoadStretch(0.0, 0, 0), RoadStretch(self.change, 1, 1)])
        self._chambers, self._brakes = (
            BrakeChambers(np.array([FILL]), np.array([EMPTY]), SUPPLY),
            brakes_of_wheels(PAPER_FRONT_BRAKE),
        )
        self.valves = self._recorded_commands()
        self.duration = self.valves.size * SAMPLING_PERIOD
        solvers = REFERENCE_SOLVERS[is_quick]
        self.reference = " and ".join(f"{method} at {tolerance:g}" for method, tolerance in solvers)
        self.true, other_distance = (self._distance_by_scipy(*solver_arguments) for solver_arguments in solvers)
        self.uncertainty = {"stopping distance": abs(self.true - other_distance)}

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """Settings of FULL_SUBSTEPS, or for the quick report of QUICK_SUBSTEPS."""
        chosen = QUICK_SUBSTEPS if quick else FULL_SUBSTEPS
        return tuple(
            self.setting("reference", method, SAMPLING_PERIOD / n)
            for method, substep_counts in chosen.items()
            for n in substep_counts
        )

    def setting(self, engine: str, method: str, step_or_tolerance: float) -> Setting:
        """Setting of an engine and a method with the longest step (s) up to ``step_or_tolerance`` that divides a
        sample."""
        substeps = math.ceil(SAMPLING_PERIOD / step_or_tolerance * (1 - 1e-9))
        return Setting(
            engine,
            method,
            SAMPLING_PERIOD / substeps,
            METHOD_ORDERS.get(method, 0),
            default=DEFAULT_METHODS.get((method, substeps), ""),
        )

    def build(self, setting: Setting) -> StopSolver:
        """The braking stop by the method and step of a setting, ready to run."""
        substeps = round(SAMPLING_PERIOD / setting.value)
        run = (
            self._stop_by_twinrig
            if setting.method == EXACT_WHEEL_METHOD
            else partial(self._stop_by_method, setting.method)
        )
        return StopSolver(partial(run, substeps))

    def errors(self, solution: StopResult) -> dict[str, float]:
        """Error (m) of a solution's stopping distance, by the name of the quantity."""
        return {"stopping distance": abs(solution.distance - self.true)}

    def _recorded_commands(self) -> np.ndarray:
        """Valve commands (n,), one per sample, of a run with the controller; the last one is repeated EXTRA_SAMPLES
        times."""
        tape = RecordingController(CONTROLLERS["slip_bang_bang"](1), [])
        vehicle = braked_vehicle_on_tyres(
            FRONT_WHEEL.plane, self._tables, self._brakes, self._chambers, self._road, substeps=REPLAY_SUBSTEPS
        )
        vehicle.run(tape, self.speed)
        return np.array(tape.valves + [tape.valves[-1]] * EXTRA_SAMPLES)

    def _distance_by_scipy(self, method_name: str, tolerance: float) -> float:
        """Stopping distance (m) by an adaptive method of scipy; changes of friction, locking and release are events."""
        stretches = [(begin, partial(self._friction, i)) for i, begin in enumerate((0.0, self.change))]
        return reference_distance_on_stretches(
            FRONT_WHEEL,
            PAPER_FRONT_BRAKE,
            stretches,
            ReplayedController(self.valves),
            self.speed,
            tolerance,
            method_name,
        )

    def _friction(self, surface_number: int, wheel_slip: float) -> float:
        return float(np.interp(wheel_slip, self.slips, self.mu[surface_number]))

    def _torques(self, substep_count: int) -> np.ndarray:
        """Brake torques (n, 1) in N m at the start and at the end of every step."""
        air, substep_torques = air_at_rest(self._chambers, SAMPLING_PERIOD), np.zeros((substep_count + 1, 1))
        torques = [np.zeros(1)]
        for valve in self.valves:
            advance_by_valves(np.array([valve]), SAMPLING_PERIOD, air, self._chambers, self._brakes, substep_torques)
            torques.append(substep_torques[1:, 0].copy())
        return np.concatenate(torques)

    def _stop_by_twinrig(self, substep_count: int) -> StopResult:
        stop = stop_of_quarter_vehicle(
            FRONT_WHEEL,
            stacked_tables(self._tables),
            self._road,
            self._torques(substep_count),
            SAMPLING_PERIOD / substep_count,
            self.speed,
        )
        if stop.step_of_rest < 0:
            raise RunFailed("reference", "it does not stop", self.duration)
        return StopResult(
            stop.distance,
            {"steps": stop.step_of_rest, "force calls": CALLS_PER_STEP[EXACT_WHEEL_METHOD] * stop.step_of_rest},
        )

    def _stop_by_method(self, method_name: str, substep_count: int) -> StopResult:
        number = (EULER, RK4, LITERAL).index(method_name)
        torques, step = self._torques(substep_count), SAMPLING_PERIOD / substep_count
        friction = FrictionChange(
            FrictionCurve(self.slips, self.mu[0]), FrictionCurve(self.slips, self.mu[1]), self.change
        )
        distance, steps, _ = stop_by_scheme(number, FRONT_WHEEL, torques, friction, self.speed, step)
        if steps < 0:
            raise RunFailed("reference", "it does not stop", self.duration)
        return StopResult(distance, {"steps": steps, "force calls": CALLS_PER_STEP[method_name] * steps})


@cache
def problem(is_quick: bool) -> BrakingStop:
    """The test problem of the braking stop; its reference solution is computed once per process."""
    return BrakingStop(is_quick)
