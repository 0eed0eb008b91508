"""Engines and integrators from a file outside the tree, named ``module:Class``.

An integrator has ``integrate(f, times, start, tolerance)``, which returns states (len(times), 8) of y' = f(t, y) from
``start`` (8,) at ``times[0]`` on; it is called for each stretch on which f is smooth. An engine is built with
``(assembly, settings)`` and has ``run()``, which returns something with ``times`` (n,) and ``states`` (n, 8), and
``acceleration(time, state)`` (4,). Either says its ``order``, and ``adaptive = True`` if it keeps a tolerance instead
of taking steps of fixed length. What it returns passes the guard that every run passes and is compared with the
reference (``beside_reference``); what it raises is a failed run.

::

    class Scipy:                                   # mine.py: twinrig run SCENE --engine mine:Scipy
        order, adaptive = 8, True

        def integrate(self, f, times, start, tolerance):
            found = solve_ivp(f, times[[0, -1]], start, "DOP853", times, rtol=tolerance, atol=tolerance)
            return found.y.T
"""

import math
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from models.core.errors import InputError, RunFailed
from models.core.trajectory import Trajectory
from models.engines import protocol
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES, RECOMMENDED, Integrator
from models.engines.model import Model
from models.engines.protocol import check_trajectory
from models.engines.reference import PitchPlaneReference, compiled_derivative

HIGHEST_ORDER = 20
"""Largest order of convergence that an outside integrator may claim."""


def register(engine_name: str) -> None:
    """Import the class that ``module:Class`` names and add it to the catalogue; raises InputError if it cannot be
    used."""
    outside_class = _outside_class(engine_name)
    order = getattr(outside_class, "order", None)
    if isinstance(order, bool) or not isinstance(order, int) or not 1 <= order <= HIGHEST_ORDER:
        raise _unusable_engine(
            engine_name, f"must say its order of convergence: order = a whole number from 1 to {HIGHEST_ORDER}"
        )
    integrates = callable(getattr(outside_class, "integrate", None))
    missing = (
        []
        if integrates
        else [method for method in ("run", "acceleration") if not callable(getattr(outside_class, method, None))]
    )
    if missing:
        raise _unusable_engine(
            engine_name,
            f"has no {' and no '.join(missing)}(): an engine has run() and acceleration(time, "
            "state), an integrator has integrate(f, times, start, tolerance)",
        )
    constrained = bool(getattr(outside_class, "constraints", False))
    CATALOGUE[engine_name] = {engine_name: Integrator(order, "any", constraints=integrates or constrained)}
    RECOMMENDED[engine_name], OUTSIDE_CLASSES[engine_name] = engine_name, outside_class


def _unusable_engine(engine_name: str, reason_text: str) -> InputError:
    """InputError on an outside engine that cannot be used."""
    return InputError("--engine", "", engine_name, reason_text)


def _outside_class(engine_name: str) -> type:
    """The class that ``module:Class`` names, imported; raises InputError if that fails."""
    module, _, attribute = engine_name.partition(":")
    if not all(part.isidentifier() for part in (*module.split("."), attribute)):
        raise _unusable_engine(engine_name, "must read module:Class, for mine.py in this folder for example mine:Scipy")
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        outside_class = getattr(import_module(module), attribute)
    except ModuleNotFoundError as error:
        raise _unusable_engine(
            engine_name, f"there is no module {error.name!r} here, nor among the installed ones"
        ) from None
    except AttributeError:
        raise _unusable_engine(engine_name, f"the module {module} has no {attribute}") from None
    except (Exception, SystemExit) as error:
        raise _unusable_engine(engine_name, f"the module {module} cannot be imported: {_error_text(error)}") from None
    if not isinstance(outside_class, type):
        raise _unusable_engine(engine_name, f"{attribute} is no class")
    return outside_class


def _error_text(exception: BaseException) -> str:
    """Class and message of an exception, as text."""
    return f"{type(exception).__name__}: {exception}".rstrip(": ")


def build(engine_name: str, assembly: Assembly, run_settings: Settings) -> Model:
    """Model of an assembly by an outside class: as an engine, or as an integrator of the reference's equations."""
    outside_class = OUTSIDE_CLASSES[engine_name]
    if callable(getattr(outside_class, "integrate", None)):
        return OutsideIntegrator(
            assembly, run_settings, engine_name, _call_engine(engine_name, "building it", outside_class).integrate
        )
    return OutsideEngine(
        engine_name,
        _call_engine(engine_name, "building it", outside_class, assembly, run_settings),
        assembly,
        run_settings,
    )


def _call_engine(engine_name: str, action_text: str, engine_function: Callable, *function_arguments: Any) -> Any:
    """Result of a function of an outside engine; raises RunFailed for any exception other than the project's own."""
    try:
        return engine_function(*function_arguments)
    except (InputError, RunFailed):
        raise
    except Exception as error:
        raise RunFailed(engine_name, f"{action_text} raised {_error_text(error)}") from error


def _returned_array(
    engine_name: str, action_text: str, returned_value: Any, wanted_shape: tuple[int, ...]
) -> np.ndarray:
    """The value that an outside engine returned, as an array of this shape; raises RunFailed if it has no such
    shape."""
    try:
        numbers = np.asarray(returned_value if returned_value is not None else "nothing", dtype=float)
    except (TypeError, ValueError):
        raise RunFailed(engine_name, f"{action_text} gave {type(returned_value).__name__} instead of numbers") from None
    if numbers.shape != wanted_shape:
        raise RunFailed(engine_name, f"{action_text} gave the shape {numbers.shape} instead of {wanted_shape}")
    return numbers


@dataclass
class OutsideIntegrator(PitchPlaneReference):
    """The reference's equations with an outside integrator; a prescribed pitch is one of their inputs."""

    name: str
    integrate: Callable

    def run(self) -> Trajectory:
        """Trajectory, integrated piece by piece between the knots of the input; raises RunFailed as every engine
        does."""
        times = self.settings.step * np.arange(self.settings.steps + 1)
        states, calls = self._march(times)
        check_trajectory(self.name, times, states, self.settings.duration)
        self._guide(states)
        enforced = self._enforced(times, states)
        check_trajectory(self.name, times, states, self.settings.duration, enforcing_forces=enforced)
        return Trajectory(times, states, enforced, {"steps": self.settings.steps, "force calls": calls})

    def _march(self, times: np.ndarray) -> tuple[np.ndarray, int]:
        """States (n, 8) at the times (n,) in s, and the number of calls of the right-hand side."""
        states, calls = np.empty((len(times), 8)), [0]
        y = states[0] = self.assembly.initial
        for start, end, inside in self._pieces_between_knots(times, times[-1]):
            within = times[inside]
            last = [] if len(within) and within[-1] > end - 1e-9 * self.settings.step else [end]
            grid = np.array([start, *within, *last])
            asked = (self._rhs(start, end, calls), grid, y.copy(), self.settings.tolerance)
            answer = _call_engine(self.name, "integrate", self.integrate, *asked)
            states_then = _returned_array(self.name, "integrate", answer, (len(grid), 8))
            states[inside], y = states_then[1 : 1 + len(within)], states_then[-1]
            if not np.isfinite(y).all():
                raise RunFailed(self.name, "the state became infinite or not a number", start)
        return states, calls[0]

    def _rhs(
        self, start_time: float, end_time: float, call_counter: list[int]
    ) -> Callable[[float, np.ndarray], np.ndarray]:
        """Right-hand side (t, y) -> y' over one piece between knots, which counts its calls."""
        derivative, p, at = compiled_derivative(*self._key), self._p, self._reader(start_time, end_time)

        def rhs(t: float, y: np.ndarray) -> np.ndarray:
            call_counter[0] += 1
            dy = derivative(np.ascontiguousarray(y, dtype=float), at(t), p)
            if not math.isfinite(dy.sum()):
                raise RunFailed(self.name, "the derivative became infinite or not a number", start_time)
            return dy

        return rhs


@dataclass
class OutsideEngine:
    """An outside engine whose runs are checked as those of every engine."""

    name: str
    model: Any
    assembly: Assembly
    settings: Settings

    def run(self) -> Trajectory:
        """The trajectory of the outside engine, after checks."""
        answer = _call_engine(self.name, "run", self.model.run)
        if not (hasattr(answer, "times") and hasattr(answer, "states")):
            raise RunFailed(self.name, f"run gave {type(answer).__name__}, which has no times and states")
        count = np.size(answer.times)
        times = _returned_array(self.name, "run, as times,", answer.times, (count,))
        states = _returned_array(self.name, "run, as states,", answer.states, (count, 8))
        enforced = getattr(answer, "enforced", None)
        if self.assembly.guided:
            enforced = _returned_array(self.name, "run, as enforced,", enforced, (count, len(self.assembly.guided)))
        check_trajectory(self.name, times, states, self.settings.duration, enforcing_forces=enforced)
        return Trajectory(times, states, enforced, dict(getattr(answer, "counts", {})))

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (4,) at a time (s), from coordinates and rates (4,), which the outside class receives as one
        state (8,)."""
        answer = _call_engine(self.name, "acceleration", self.model.acceleration, time, np.concatenate((q, v)))
        return _returned_array(self.name, "acceleration", answer, (4,))

    def plan(self) -> dict[str, int]:
        """Counts of the items that an outside engine built, as far as it states them."""
        blank = {"degrees of freedom": 4 - len(self.assembly.guided), "native items": 0, "callbacks": 0}
        return blank | dict(getattr(self.model, "plan", dict)())


REFERENCE_TOLERANCE = 1e-10
"""Tolerance of the reference run with which an outside engine is compared."""
ERROR_MARGIN, SMALLEST_BOUND, LARGEST_BOUND = 100.0, 1e-5, 0.1
"""A run fails if its error exceeds ERROR_MARGIN times the expected error. The bound, relative to the largest motion, is
at least SMALLEST_BOUND (methods interpolate between steps to 3e-6) and at most LARGEST_BOUND."""


def beside_reference(engine: str, assembly: Assembly, run_settings: Settings, outside_trajectory: Trajectory) -> str:
    """Text on the difference of a run from the reference; raises RunFailed where the run's order and step cannot
    explain the difference."""
    try:
        truth = _reference_run(assembly, replace(run_settings, integrator="DOP853", tolerance=REFERENCE_TOLERANCE))
    except (InputError, RunFailed) as error:
        return f"nothing was compared with it: the reference gives no run of this scene ({error})"
    gap, where = relative_gap(outside_trajectory, truth)
    allowed = min(
        max(ERROR_MARGIN * _expected_error(engine, assembly, run_settings, truth), SMALLEST_BOUND), LARGEST_BOUND
    )
    if not gap <= allowed:
        raise RunFailed(
            engine,
            f"its states are {100 * gap:.3g} % of the largest motion away from the reference at "
            f"{where:.3g} s, where its order and step explain at most {100 * allowed:.3g} %: "
            f"`twinrig validate --engine {engine}` says what is wrong",
        )
    return f"states within {gap:.1e} of the largest motion from the reference"


def relative_gap(trajectory: Trajectory, reference_trajectory: Trajectory) -> tuple[float, float]:
    """Largest difference of the states (n, 8) between two runs, divided by the largest motion in
    ``reference_trajectory`` of the same kind, and the time (s) at which it occurs.

    Kinds are heights, pitch, and the rates of each; where nothing moves, a millimetre or milliradian counts.
    """
    states = CubicSpline(reference_trajectory.times, reference_trajectory.states)(trajectory.times)
    motion = np.abs(reference_trajectory.states - reference_trajectory.states[0]).max(axis=0)
    sizes = np.concatenate([np.full(3, motion[:3].max()), motion[3:4], np.full(3, motion[4:7].max()), motion[7:]])
    gaps = (np.abs(trajectory.states - states) / np.maximum(sizes, 1e-3)).max(axis=1)
    worst = int(gaps.argmax())
    return float(gaps[worst]), float(trajectory.times[worst])


def _reference_run(assembly: Assembly, run_settings: Settings) -> Trajectory:
    """Trajectory of an assembly by the reference."""
    return protocol.build("reference", assembly, run_settings).run()


def _expected_error(engine: str, assembly: Assembly, run_settings: Settings, reference_trajectory: Trajectory) -> float:
    """Relative error that the stated order and step of an outside engine make likely; its tolerance if it is
    adaptive."""
    if getattr(OUTSIDE_CLASSES[engine], "adaptive", False):
        return run_settings.tolerance
    try:
        gap, _ = relative_gap(_reference_run(assembly, replace(run_settings, integrator="RK4")), reference_trajectory)
    except (InputError, RunFailed):
        return LARGEST_BOUND  # too coarse for RK4: only what no step explains is told
    return float(gap ** (min(CATALOGUE[engine][run_settings.integrator].order, 4) / 4))
