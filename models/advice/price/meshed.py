"""Base of priced scenes whose contacts are divided into cells: settings are time steps and cell numbers of any engine's
RK4.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from models.advice.price import PricedRun, SettingLadder
from models.advice.price.problem import Setting
from models.core.errors import InputError

CELLS_TRIED = (3, 5, 7, 9, 11, 15, 21, 31, 45, 63, 91, 127, 200)
"""Numbers of cells along a contact that are tried, beside the scene's number."""
STEP_FACTORS = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
"""Tried steps as multiples of the scene's step; without cells, halvings of the shortest are tried too."""
STEP_HALVINGS = 8
FIRST_CELLS, REFERENCE_RUNGS, CONFIRMATION_DIVISOR = 12, 5, 6.0
"""Number of cells on the reference's first rung, number of its rungs, and the divisor of the tolerance that limits the
change by the last rung: the remaining error is a third of that change.
"""
REFINED_TOGETHER, SECOND_METHOD = "RK4 with cells and steps refined together", "DOP853"
"""Names of the method of the reference, and of a second method from another family."""
SECOND_SOLVER_TOLERANCE = 1e-8
"""Relative tolerance of the second solver, which picks its steps itself."""


def duration_of_first_part(duration: float, longest_part: float) -> float:
    """Duration (s) of the first part of a run: at most ``longest_part`` (s), and a whole fraction of ``duration``
    (s).
    """
    return duration / math.ceil(duration / longest_part * (1 - 1e-9))


@dataclass(frozen=True)
class MeshedScene(ABC):
    """A priced scene with contact cells, see ``models.advice.price.PricedScene``. reference_engine : engine of the
    reference; step : the scene's (s); longest_reference_step : (s), on the reference's first rung; cells : the scene's
    number along a contact, 0 where its contacts have none.
    """

    title: str
    quantity: str
    unit: str
    note: str
    full_duration: float
    searched_duration: float
    engines: tuple[str, ...]
    reference_engine: str
    step: float
    longest_reference_step: float
    cells: int
    kink_period = 0.0

    @abstractmethod
    def run(self, engine: str, cell_count: int, step: float, duration: float) -> Any:
        """Run the scene in an engine with this number of contact cells and this step (s)."""

    @abstractmethod
    def exact_run(self, cell_count: int, step: float, duration: float) -> Any:
        """Run the scene by the solver DOP853 with accelerations of ``reference_engine``; output rows are ``step`` (s)
        apart.
        """

    @abstractmethod
    def quantity_along_run(self, run: Any) -> tuple[np.ndarray, np.ndarray, int]:
        """Times (n,) in s and values (n, k) of the quantity along a run, and the number of contact force calls; the
        run's assumptions are judged.
        """

    @abstractmethod
    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that select the solver setting."""

    @property
    def work_count_name(self) -> str:
        """Name of the count that measures the work: contact cells if there are any, else force calls."""
        return "contact cells" if self.cells else "force calls"

    @cached_property
    def steps(self) -> dict[str, float]:
        """Time steps (s) by the name of the method; each is a whole fraction of ``searched_duration``."""
        steps = dict.fromkeys(self._longest_fraction(self.step * k) for k in STEP_FACTORS)
        return {f"RK4 at {1e3 * step:.3g} ms": step for step in steps}

    def setting_ladders(self) -> list[SettingLadder]:
        """A ladder of cell numbers for every engine and step or, without cells, a ladder of steps for every engine."""
        if not self.cells:
            steps = (*self.steps.values(), *(min(self.steps.values()) / 2**k for k in range(1, STEP_HALVINGS)))
            return [
                SettingLadder(engine, "RK4", steps, 4, default=self._longest_fraction(self.step))
                for engine in self.engines
            ]
        values = tuple(1.0 / n for n in sorted({*CELLS_TRIED, self.cells}))
        usual = f"RK4 at {1e3 * self._longest_fraction(self.step):.3g} ms"
        return [
            SettingLadder(engine, method, values, 2, default=1.0 / self.cells if method == usual else 0.0, cells=True)
            for engine in self.engines
            for method in self.steps
        ]

    def reference_ladder(self) -> SettingLadder:
        """Ladder of the reference: twice the cells on every rung and half the step on every second rung; without cells,
        half the step on every rung.
        """
        if not self.cells:
            return SettingLadder(
                self.reference_engine,
                "RK4",
                tuple(self._longest_fraction(self.longest_reference_step) / 2**k for k in range(16)),
                4,
            )
        return SettingLadder(
            self.reference_engine,
            REFINED_TOGETHER,
            tuple(1.0 / (FIRST_CELLS * 2**k) for k in range(REFERENCE_RUNGS)),
            2,
            cells=True,
            confirmation_divisor=CONFIRMATION_DIVISOR,
        )

    def second_setting(self, reference_setting: Setting) -> Setting | None:
        """DOP853 as the setting that checks the reference; None where there are cells, since all solvers share the
        error of the cells.
        """
        return None if self.cells else Setting("reference", SECOND_METHOD, reference_setting.value, 0)

    def solve(self, setting: Setting, duration: float) -> Any:
        """Run the scene with a setting for a duration (s); returns the number of cells, 0 without cells, and the
        run.
        """
        cells = round(1.0 / setting.value) if self.cells else 0
        rung = round(math.log2(cells / FIRST_CELLS)) if self.cells else 0
        if setting.method == SECOND_METHOD:
            return cells, self.exact_run(cells, self._step_of_rung(rung) if self.cells else setting.value, duration)
        if setting.method == REFINED_TOGETHER:
            return cells, self.run(setting.engine, cells, self._step_of_rung(rung), duration)
        return cells, self.run(setting.engine, cells, self.steps.get(setting.method, setting.value), duration)

    def priced_run(self, solution: Any) -> PricedRun:
        """The quantity along a run, with the numbers of force calls and of evaluated contact cells."""
        cells, run = solution
        times, values, calls = self.quantity_along_run(run)
        return PricedRun(times, values, {"force calls": calls, "contact cells": calls * cells**2})

    def _step_of_rung(self, rung_index: int) -> float:
        return self._longest_fraction(self.longest_reference_step) / 2 ** (max(0, rung_index) // 2)

    def _longest_fraction(self, step: float) -> float:
        """The longest whole fraction (s) of ``searched_duration`` that is at most ``step`` (s)."""
        return self.searched_duration / math.ceil(self.searched_duration / step * (1 - 1e-9))


def checked_quantity(quantity_name: str, known_names: dict[str, Any]) -> str:
    """The name of a quantity, unchanged; InputError where the scene has no quantity of this name."""
    if quantity_name not in known_names:
        raise InputError(
            "--quantity", "", quantity_name, "is no quantity of this scene: one of them", tuple(known_names)
        )
    return quantity_name


def run_and_quantity(
    quantity: str | None, default_quantity: str, runs_by_name: dict[str, Any], run_kind: str
) -> tuple[str, str]:
    """Names of the run and of the quantity, which a user gives as RUN.QUANTITY; the first run where none is named."""
    name, _, quantity_name = (quantity or default_quantity).rpartition(".")
    name = name or next(iter(runs_by_name))
    if name not in runs_by_name:
        raise InputError("--quantity", "", quantity, f"names no {run_kind} of this scene", tuple(runs_by_name))
    return name, quantity_name
