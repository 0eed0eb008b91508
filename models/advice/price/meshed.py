"""Common part of scenes whose contacts are cut into cells: settings are steps and cells of any engine's RK4."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from models.advice.price import PricedRun, SettingLadder
from models.advice.price.problem import Setting
from models.core.errors import InputError

CELLS = (3, 5, 7, 9, 11, 15, 21, 31, 45, 63, 91, 127, 200)
"""Cells along a contact that are tried, and those of the scene."""
STEP_FACTORS = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
"""Steps that are tried, by the scene's own; without cells, halvings of the shortest too."""
HALVINGS = 8
FIRST_CELLS, RUNGS, SURE = 12, 5, 6.0
"""Cells of the reference's first rung, how many rungs there are, and the part of a tolerance that the last one may
change: the error that is left is a third of that."""
REFINED_TOGETHER, OTHER_METHOD = "RK4 with cells and steps refined together", "DOP853"
"""Methods of the reference, and of another family."""
OTHER_TOLERANCE = 1e-8
"""Relative tolerance of the second solver, which has its own steps."""


def first_part(duration: float, longest: float) -> float:
    """A whole part of a run (s), at most so long (s)."""
    return duration / math.ceil(duration / longest * (1 - 1e-9))


@dataclass(frozen=True)
class MeshedScene(ABC):
    """See ``models.advice.price.PricedScene``. reference_engine : that runs the reference; step : the scene's (s);
    longest : step (s) of the reference's first rung; cells : the scene's, 0 where its contacts have none."""

    title: str
    quantity: str
    unit: str
    note: str
    whole: float
    first: float
    engines: tuple[str, ...]
    reference_engine: str
    step: float
    longest: float
    cells: int
    kink_period = 0.0

    @abstractmethod
    def run(self, engine: str, cells: int, step: float, duration: float) -> Any:
        """A run in an engine."""

    @abstractmethod
    def exact(self, cells: int, step: float, duration: float) -> Any:
        """A run by DOP853 about the accelerations of ``reference_engine``, with rows every ``step`` (s)."""

    @abstractmethod
    def read(self, run: Any) -> tuple[np.ndarray, np.ndarray, int]:
        """Times (n,) in s, values (n, k), how often contacts were asked for their forces; the run is judged."""

    @abstractmethod
    def lines(self, setting: Setting) -> list[str]:
        """The setting as the scene file holds it."""

    @property
    def counted(self) -> str:
        """Work is counted in cells where there are any."""
        return "contact cells" if self.cells else "force calls"

    @cached_property
    def steps(self) -> dict[str, float]:
        """Methods with their steps (s), each a part of ``first``."""
        steps = dict.fromkeys(self._part(self.step * k) for k in STEP_FACTORS)
        return {f"RK4 at {1e3 * step:.3g} ms": step for step in steps}

    def ladders(self) -> list[SettingLadder]:
        """Every step of every engine over the cells, or the steps alone."""
        if not self.cells:
            steps = (*self.steps.values(), *(min(self.steps.values()) / 2**k for k in range(1, HALVINGS)))
            return [SettingLadder(engine, "RK4", steps, 4, default=self._part(self.step)) for engine in self.engines]
        values = tuple(1.0 / n for n in sorted({*CELLS, self.cells}))
        usual = f"RK4 at {1e3 * self._part(self.step):.3g} ms"
        return [
            SettingLadder(engine, method, values, 2, default=1.0 / self.cells if method == usual else 0.0, cells=True)
            for engine in self.engines
            for method in self.steps
        ]

    def reference(self) -> SettingLadder:
        """Twice the cells on every rung and half the step on every second; or half the step alone."""
        if not self.cells:
            return SettingLadder(
                self.reference_engine, "RK4", tuple(self._part(self.longest) / 2**k for k in range(16)), 4
            )
        return SettingLadder(
            self.reference_engine,
            REFINED_TOGETHER,
            tuple(1.0 / (FIRST_CELLS * 2**k) for k in range(RUNGS)),
            2,
            cells=True,
            sure=SURE,
        )

    def second(self, reference_setting: Setting) -> Setting | None:
        """DOP853; None where there are cells, for all solvers share the error that these have."""
        return None if self.cells else Setting("reference", OTHER_METHOD, reference_setting.value, 0)

    def solve(self, setting: Setting, duration: float) -> Any:
        """Number of cells, 0 where the scene has none, and the run with a setting for a duration (s)."""
        cells = round(1.0 / setting.value) if self.cells else 0
        rung = round(math.log2(cells / FIRST_CELLS)) if self.cells else 0
        if setting.method == OTHER_METHOD:
            return cells, self.exact(cells, self._tied(rung) if self.cells else setting.value, duration)
        if setting.method == REFINED_TOGETHER:
            return cells, self.run(setting.engine, cells, self._tied(rung), duration)
        return cells, self.run(setting.engine, cells, self.steps.get(setting.method, setting.value), duration)

    def answer(self, solution: Any) -> PricedRun:
        """The quantity, with the cells that it took."""
        cells, run = solution
        times, values, asked = self.read(run)
        return PricedRun(times, values, {"force calls": asked, "contact cells": asked * cells**2})

    def _tied(self, rung: int) -> float:
        return self._part(self.longest) / 2 ** (max(0, rung) // 2)

    def _part(self, step: float) -> float:
        """The longest part (s) of ``first`` up to a step (s)."""
        return self.first / math.ceil(self.first / step * (1 - 1e-9))


def chosen(quantity: str, known: dict[str, Any]) -> str:
    """A quantity that a scene has; InputError for one that it has not."""
    if quantity not in known:
        raise InputError("--quantity", "", quantity, "is no quantity of this scene: one of them", tuple(known))
    return quantity


def run_and_quantity(quantity: str | None, usual: str, runs: dict[str, Any], kind: str) -> tuple[str, str]:
    """The run and the quantity of a scene that a user names: RUN.QUANTITY, of the first run where none is named."""
    name, _, asked = (quantity or usual).rpartition(".")
    name = name or next(iter(runs))
    if name not in runs:
        raise InputError("--quantity", "", quantity, f"names no {kind} of this scene", tuple(runs))
    return name, asked
