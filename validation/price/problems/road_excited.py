"""Test problem: the pitch-plane vehicle over the study road, nonlinear in pitch.

Quantities of interest: the largest error of a wheel force, which is what durability work reads, and the
largest error of any state, over every instant that an integrator returns. The road fades in over its
first 40 m, so the second half of the 2 s at 20 m/s runs on nearly full roughness.
"""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import OdeSolution, solve_ivp

from models.advice.price.problem import Setting
from models.advice.price.systems.pitch_plane import engine_settings
from models.core.assumptions import with_assumptions
from models.core.result import Channel, Result, result
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE
from models.engines.model import Model
from models.engines.protocol import build
from models.engines.reference import compiled_derivative
from models.systems.pitch_plane.assumptions import assumptions
from models.systems.pitch_plane.run import output_channels
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from validation.price.problems import Curves, curves_of_methods, milliseconds, settings_of_curves

DURATION, SPEED = 2.0, 20.0
REFERENCE_SPACING = 1.25e-4
"""Spacing (s) of the rows of the stored reference solution; every fixed step is a multiple of it."""
STAGES_OF_METHOD = {
    "RK44": 4,
    "RK67": 7,
    "RK33": 3,
    "ExplicitMidpoint": 2,
    "ExplicitEuler": 1,
    "VelocityVerlet": 1,
    "RK4": 4,
    "Euler": 1,
    "implicit": 1,
    "implicitfast": 1,
    "discrete": 1,
}
"""Force evaluations per step by method, from the tableaux; methods with Newton iterations have no fixed number."""
DEFAULT_SETTING_OWNERS = {("exudyn", "GeneralizedAlpha 0.9", 1e-2): "Exudyn", ("mujoco", "Euler", 2e-3): "MuJoCo"}
"""Owner of each default setting, by engine, method and step (s): 10 ms in Exudyn, 2 ms in MuJoCo."""

MUJOCO_METHODS = ("RK4", "Euler", "implicit", "implicitfast", "discrete")
_STEPS = milliseconds(5, 4, 2.5, 2, 1, 0.5, 0.25, 0.125)
_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
FULL_STEPS: Curves = {
    ("reference", "RK4"): _STEPS,
    ("reference", "DOP853"): (1e-2, *_TOLERANCES[:-1]),
    ("reference", "Radau"): (1e-1, 1e-2, *_TOLERANCES[:-2]),
    ("reference", "LSODA"): _TOLERANCES,
    ("exudyn", "RK44"): _STEPS,
    ("exudyn", "RK67"): milliseconds(5, 4, 2.5, 2, 1.25, 1, 0.625),
    ("exudyn", "RK33"): milliseconds(5, 4, 2.5, 2, 1.25, 1, 0.5, 0.25),
    **curves_of_methods("exudyn", _STEPS, "ExplicitMidpoint", "ExplicitEuler", "VelocityVerlet"),
    **curves_of_methods(
        "exudyn", (*milliseconds(10), *_STEPS), "GeneralizedAlpha 0.9", "GeneralizedAlpha 0.6", "TrapezoidalIndex2"
    ),
    ("exudyn", "DOPRI5"): (1e-2, *_TOLERANCES),
    ("exudyn", "DVERK6"): (1e-6,),
    ("exudyn", "ODE23"): (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
    **curves_of_methods("mujoco", _STEPS, *MUJOCO_METHODS),
}
QUICK_STEPS: Curves = {
    ("reference", "RK4"): milliseconds(4, 2, 1, 0.5, 0.25),
    ("reference", "LSODA"): (1e-3, 1e-4, 1e-6),
    ("exudyn", "RK44"): milliseconds(5, 4, 2, 1, 0.5, 0.25),
    ("exudyn", "ExplicitEuler"): milliseconds(5, 1, 0.5, 0.25),
    ("exudyn", "GeneralizedAlpha 0.9"): milliseconds(10, 2, 1, 0.5),
    ("exudyn", "DOPRI5"): (1e-3, 1e-4),
    ("exudyn", "DVERK6"): (1e-6,),
    ("mujoco", "RK4"): milliseconds(4, 2, 1, 0.5, 0.25),
    ("mujoco", "Euler"): milliseconds(5, 2, 1, 0.5, 0.25),
    **curves_of_methods("mujoco", milliseconds(2, 1, 0.5), "implicit", "implicitfast"),
}
"""Steps (s) or tolerances of the quick report, by engine and method: each engine's default, a fourth-order method, one
adaptive solver, one that is unstable, one that is refused."""

REFERENCE_SOLVERS = {True: (("DOP853", 1e-11), ("LSODA", 1e-12)), False: (("DOP853", 1e-13), ("LSODA", 1e-13))}
"""Reference solvers with their relative tolerances, by ``quick``: an explicit Runge-Kutta method and a multistep
one."""


def scene(duration: float = DURATION):
    """The scene of a pitch-plane vehicle on the study road, which lasts ``duration`` s."""
    return build_scene(
        {
            "title": "pitch-plane vehicle on the study road",
            "vehicle": {"parameters": "itwm_drift"},
            "run": {"duration": duration, "step": 1e-3},
            "effects": {"road": {"source": "study", "speed": SPEED}},
        }
    )


def result_with_assumptions(assembly: Assembly, finished_run: Trajectory) -> Result:
    """Result of a run, with the assumptions of the assembly that the run broke."""
    channels = output_channels(replace(assembly, sensors=()), finished_run)
    labelled = {name: Channel("time", values, unit, meaning) for name, (unit, meaning, values) in channels.items()}
    time_axis = {"time": Channel("time", finished_run.times, "s")}
    return with_assumptions(result(assembly.scene, labelled, time_axis, mode=assembly.mode), assumptions(assembly))


def settings_of(setting: Setting, duration: float = DURATION) -> Settings:
    """Engine settings of a setting, for a run of ``duration`` s."""
    return engine_settings(setting, duration)


def setting(engine: str, method: str, step_or_tolerance: float) -> Setting:
    """Setting of an engine and a method, with the order, stages and default that the catalogue declares."""
    known = CATALOGUE[engine][method.split()[0]]
    order = 0 if method == "LSODA" else known.order
    default = DEFAULT_SETTING_OWNERS.get((engine, method, step_or_tolerance), "")
    return Setting(engine, method, step_or_tolerance, order, known.adaptive, STAGES_OF_METHOD.get(method, 0), default)


def settings(is_quick: bool) -> tuple[Setting, ...]:
    """Settings of FULL_STEPS, or for the quick report of QUICK_STEPS."""
    return settings_of_curves(QUICK_STEPS if is_quick else FULL_STEPS, setting)


def continuous_solution(assembly: Assembly, method_name: str, tolerance: float) -> OdeSolution:
    """Continuous solution of the paper's equations by a method of scipy, which restarts where the road is only twice
    differentiable."""
    derivative, p = compiled_derivative("road", assembly.vehicle.geometry), assembly.parameters.array()
    assert assembly.input is not None
    road_at = assembly.input.at
    edges = [0.0, *assembly.input.knots(DURATION), DURATION]
    piece_times, pieces, y = [0.0], list[Any](), assembly.initial
    for start, end in pairwise(edges):
        piece_solution = solve_ivp(
            lambda t, y: derivative(y, road_at(t), p),
            (start, end),
            y,
            method=method_name,
            dense_output=True,
            rtol=tolerance,
            atol=1e-2 * tolerance,
        )
        piece_times += list(piece_solution.t[1:])
        pieces += piece_solution.sol.interpolants
        y = piece_solution.y[:, -1]
    return OdeSolution(piece_times, pieces)


class RoadExcited:
    """Test problem: a vehicle on a road, with its reference solution; a
    ``models.advice.price.problem.WorkPrecisionProblem``.
    """

    key, duration = "road", DURATION
    tolerances: tuple[float, ...] = (100.0, 10.0, 1.0, 0.1, 0.01)
    settings, setting = staticmethod(settings), staticmethod(setting)
    note = (
        "Exudyn's RK33, RK67 and adaptive methods read the road anew at every stage, in Python: their seconds show "
        "it, their force calls do not."
    )

    def __init__(self, is_quick: bool) -> None:
        steps = [1e3 * setting.value for setting in self.settings(is_quick) if not setting.adaptive]
        self.title = (
            f"Pitch-plane vehicle on the study road, {DURATION:g} s at {SPEED:g} m/s, "
            f"fixed steps of {min(steps):g} to {max(steps):g} ms"
        )
        self.units = {"wheel force": "N", "state": "m, rad, m/s, rad/s"}
        self.assembly = assembly_of_scene(scene())
        solvers = REFERENCE_SOLVERS[is_quick]
        self.reference = " and ".join(f"{method} at {tolerance:g}" for method, tolerance in solvers)
        self._solution = continuous_solution(self.assembly, *solvers[0])
        grid_times = REFERENCE_SPACING * np.arange(round(DURATION / REFERENCE_SPACING) + 1)
        self._states = self._solution(grid_times).T
        other_solutions = [continuous_solution(self.assembly, *solver)(grid_times).T for solver in solvers[1:]]
        differences = [self._largest_errors(other_solution - self._states) for other_solution in other_solutions]
        self.uncertainty = {name: max(gaps[name] for gaps in differences) for name in self.units}
        signal, p = self.assembly.input, self.assembly.parameters
        assert signal is not None
        deflections = self._states[:, [0, 1, 4, 5]] - signal.sample(0.0, REFERENCE_SPACING, len(grid_times))
        self.bound = 10 * float(np.abs(deflections[:, :2] * [p.k1, p.k2] + deflections[:, 2:] * [p.d1, p.d2]).max())

    def build(self, setting: Setting) -> Model:
        """The vehicle in the engine of a setting, ready to run."""
        return build(setting.engine, self.assembly, settings_of(setting))

    def errors(self, solution: Trajectory) -> dict[str, float]:
        """Largest errors of a wheel force (N) and of a state at the rows of a run; assumptions that the run
        breaks are reported."""
        result_with_assumptions(self.assembly, solution)
        return self._largest_errors(solution.states - self._reference_states(solution.times))

    def _reference_states(self, times: np.ndarray) -> np.ndarray:
        """Reference states (n, 8) at times (n,) in s: from the stored grid if the times lie on it, else by the solver's
        interpolant."""
        index = np.rint(times / REFERENCE_SPACING).astype(int)
        if np.abs(times - REFERENCE_SPACING * index).max() < 1e-12:
            return self._states[index]
        return self._solution(times).T

    def _largest_errors(self, state_errors: np.ndarray) -> dict[str, float]:
        """Largest errors of a wheel force (N) and of a state, from state differences (n, 8); the road height cancels in
        the difference of the forces."""
        p = self.assembly.parameters
        forces = state_errors[:, :2] * [p.k1, p.k2] + state_errors[:, 4:6] * [p.d1, p.d2]
        return {"wheel force": float(np.abs(forces).max()), "state": float(np.abs(state_errors).max())}


@cache
def problem(is_quick: bool) -> RoadExcited:
    """The test problem of a vehicle on a road; its reference solution is computed once per process."""
    return RoadExcited(is_quick)
