"""Cost of accuracy for a user's own model: the engine, integrator and step that keep a coordinate within a
tolerance.

The search is that of ``models.advice.price``. Exudyn marches the description, MuJoCo the file's own model, so that what
its integrators do with joint damping is what the user would have. Coordinates are those of hinges, slides and the
places of free bodies, from the design position.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.advice.price import PricedRun, SettingLadder
from models.advice.price.meshed import checked_quantity
from models.advice.price.problem import Setting
from models.advice.price.recommendation import Recommendation, recommend
from models.core.errors import InputError, RunFailed
from models.engines.catalogue import CATALOGUE
from models.own_model.builds import plain_tree
from models.own_model.path import LARGEST_STATE, PATH_DURATION, file_path
from models.own_model.reading import TwinModel
from models.own_model.states import random_states

ALL_COORDINATES = "all"
"""Name of the quantity that comprises all coordinates of the model."""
STEPS_PER_SECOND = (40, 50, 80, 100, 160, 200, 250, 400, 500, 800, 1000, 1600, 2000, 4000, 8000, 16000, 32000)
TRIED_STEPS = tuple(1.0 / n for n in STEPS_PER_SECOND)
"""Step sizes (s) that are tried with every integration method."""
METHODS_OF_ENGINE = {
    "exudyn": ("RK44", "RK33", "ExplicitMidpoint", "ExplicitEuler", "GeneralizedAlpha", "TrapezoidalIndex2"),
    "mujoco": ("RK4", "Euler", "implicit", "implicitfast"),
}
FORCE_CALLS_PER_STEP = {"RK44": 4, "RK4": 4, "RK33": 3, "ExplicitMidpoint": 2}
REFERENCE_METHOD, REFERENCE_TOLERANCE = "DOP853", 1e-10
"""Integration method of scipy that checks the reference with the plain equations of motion, and its relative tolerance.
"""
ASSUMED_EXUDYN_STEP = 5e-3
"""Step size (s) assumed for Exudyn's default method, as Exudyn itself has no default step."""


@dataclass(frozen=True, eq=False)
class PricedModel:
    """The user's own model as a scene whose accuracy is priced, see ``models.advice.price.PricedScene``: 1 s of motion
    from a random state.
    """

    own_model: TwinModel
    quantity: str
    where = "in the engine"
    full_duration = searched_duration = PATH_DURATION
    kink_period = 0.0
    work_count_name = "force calls"

    @property
    def title(self) -> str:
        """Name of the model."""
        return self.own_model.name

    @cached_property
    def coordinate_indices(self) -> list[int]:
        """Indices of the model's coordinates that make up the quantity."""
        index_by_name = named_coordinates(self.own_model)
        return [i for name, i in index_by_name.items() if self.quantity in (ALL_COORDINATES, name)]

    @property
    def unit(self) -> str:
        """Unit of the quantity: rad, m, or both."""
        kinds = {unit_of_coordinate(self.own_model, i) for i in self.coordinate_indices}
        return kinds.pop() if len(kinds) == 1 else "rad or m"

    @property
    def note(self) -> str:
        """Text on the start state of the run, and on the model that each engine integrates."""
        return "from the random state of the paths; MuJoCo marches the file's own model, Exudyn the description"

    def setting_ladders(self) -> list[SettingLadder]:
        """Series of step sizes for every integration method; MuJoCo's default step is the one of the model's file."""
        return [
            SettingLadder(
                engine, method, TRIED_STEPS, CATALOGUE[engine][method].order, default=self._default_step(engine, method)
            )
            for engine, methods in METHODS_OF_ENGINE.items()
            for method in methods
        ]

    def _default_step(self, engine: str, method: str) -> float:
        defaults = {
            ("mujoco", "Euler"): float(self.own_model.model.opt.timestep),
            ("exudyn", "GeneralizedAlpha"): ASSUMED_EXUDYN_STEP,
        }
        wanted = defaults.get((engine, method), 0.0)
        return min(TRIED_STEPS, key=lambda step: abs(step - wanted)) if wanted else 0.0

    def reference_ladder(self) -> SettingLadder:
        """Series of halved steps of MuJoCo's RK4, the fastest method, with which the reference is computed."""
        return SettingLadder("mujoco", "RK4", tuple(0.01 / 2**k for k in range(14)), 4)

    def second_setting(self, reference_setting: Setting) -> Setting | None:
        """Setting whose run must agree with the reference: a Runge-Kutta method of order 8 with the plain equations of
        motion.
        """
        return Setting("reference", REFERENCE_METHOD, reference_setting.value, 0)

    def solve(self, setting: Setting, duration: float) -> tuple[np.ndarray, np.ndarray, int]:
        """Run the model: times (s), values of the priced coordinates, and number of force calls. RunFailed if the
        method stops or the motion blows up."""
        steps, (q,), (v,) = round(duration / setting.value), *random_states(self.own_model, 1)
        path = self._coordinate_path(setting, (q, v), steps)
        if not (np.isfinite(path).all() and np.abs(path).max() < LARGEST_STATE):
            raise RunFailed(setting.engine, "the motion blows up at this step")
        calls = steps * FORCE_CALLS_PER_STEP.get(setting.method, 1)
        return setting.value * np.arange(steps + 1), path, calls

    def _coordinate_path(self, setting: Setting, start_state: tuple[np.ndarray, np.ndarray], steps: int) -> np.ndarray:
        """Coordinates (steps + 1, k) of the quantity along a run of the model."""
        twin, step = self.own_model, setting.value
        if setting.engine == "mujoco":
            states = file_path(twin, start_state, (steps, step), setting.method)
            return twin.coordinates.positions(states)[:, self.coordinate_indices]
        if setting.engine == "exudyn":
            from models.engines.free_vehicle_exudyn import FreeExudyn

            path: np.ndarray = FreeExudyn(twin.driven).march(*start_state, steps, step, setting.method)[
                :, self.coordinate_indices
            ]
            return path
        return self._reference_path(start_state, steps, step)

    def _reference_path(self, start_state: tuple[np.ndarray, np.ndarray], steps: int, step: float) -> np.ndarray:
        """Coordinates of the quantity along a run by the reference method, with the plain equations of motion."""
        tree, n = plain_tree(self.own_model), self.own_model.size

        def rates(t: float, state: np.ndarray) -> np.ndarray:
            return np.concatenate((state[n:], tree.acceleration(t, state[:n], state[n:])))

        times = step * np.arange(steps + 1)
        span, rows = (0.0, float(times[-1])), times[:: max(1, steps // 200)]
        solved = solve_ivp(
            rates,
            span,
            np.concatenate(start_state),
            REFERENCE_METHOD,
            rows,
            dense_output=True,
            rtol=REFERENCE_TOLERANCE,
            atol=REFERENCE_TOLERANCE,
        )
        if not solved.success:
            raise RunFailed("reference", solved.message)
        states: np.ndarray = solved.sol(times).T
        return states[:, self.coordinate_indices]

    def priced_run(self, solution: Any) -> PricedRun:
        """Coordinates of the quantity along a run, with the number of force calls."""
        times, values, calls = solution
        return PricedRun(times, values, {"force calls": calls})

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """The solver setting in the syntax of the engine."""
        if setting.engine == "mujoco":
            return [f'<option integrator="{setting.method}" timestep="{setting.value:g}"/>']
        return [f"exudyn.DynamicSolverType.{setting.method}, steps of {setting.value:g} s"]


def recommended_settings(own_model: TwinModel, tolerance: float, quantity: str | None) -> Recommendation:
    """The cheapest solver settings of a user's own model that meet a tolerance (rad or m); InputError for an unknown
    quantity or an impossible tolerance.
    """
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise InputError("--tolerance", "", tolerance, "must be a finite number above 0, in rad or m")
    if own_model.driven.tied or own_model.driven.frictions:
        refusal = "has no price here: dry friction and constraints are soft in MuJoCo and rigid elsewhere"
        raise InputError("--tolerance", "", tolerance, refusal)
    index_by_name = named_coordinates(own_model)
    if not index_by_name:
        raise InputError(
            own_model.name, "", None, "has no hinge and no slide whose coordinate could be held to a tolerance"
        )
    return recommend(
        PricedModel(own_model, checked_quantity(quantity or ALL_COORDINATES, {ALL_COORDINATES: None, **index_by_name})),
        tolerance,
    )


def named_coordinates(own_model: TwinModel) -> dict[str, int]:
    """Indices of the coordinates that MuJoCo has as well, by the names of their joints; angles of free and ball joints
    are left out.
    """
    names, angles = (
        own_model.names,
        {turning.first_coordinate + i for turning in own_model.coordinates.turnings for i in range(3)},
    )
    return {_joint_name(name): i for i, name in enumerate(names) if i not in angles}


def _joint_name(quoted_name: str) -> str:
    """Name of a joint as a user types it, without the prefix "joint" and quotes."""
    return quoted_name.removeprefix("joint ").replace("'", "")


def unit_of_coordinate(own_model: TwinModel, coordinate_index: int) -> str:
    """Unit of a coordinate of the model: "rad" or "m"."""
    _, freedom = own_model.driven.vehicle.coordinates()[coordinate_index]
    return "rad" if freedom.startswith("r") else "m"
