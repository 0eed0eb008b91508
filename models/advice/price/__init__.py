"""The price of accuracy of a user's own scene: which engine, method and step are the cheapest (``twinrig price SCENE
--tolerance T``).

scene -> PricedScene (by a file of ``systems``) -> truth -> search -> recommendation -> text
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from models.advice.price.problem import Setting


@dataclass(frozen=True)
class SettingLadder:
    """Settings of one method of an engine, ordered from coarse to fine; each setting is a rung of the ladder.

    values : steps in s, relative tolerances where ``adaptive``, or a cell's share of the contact where ``cells``; order
    : declared, 0 if it varies; default : what the engine itself, or the scene, would take, 0 where the method is not
    its default; confirmation_divisor : a reference is known where a finer rung changes it by less than the tolerance
    divided by this; change_text : text on what that rung is, before the change, where it is not half the step, or cells
    and steps together
    """

    engine: str
    method: str
    values: tuple[float, ...]
    order: int
    adaptive: bool = False
    default: float = 0.0
    cells: bool = False
    confirmation_divisor: float = 20.0
    change_text: str = ""

    def setting(self, rung_index: int) -> Setting:
        """The solver setting on rung ``rung_index`` of the ladder, counted from the coarsest."""
        owner, kind = self.engine if self.default else "", InCells if self.cells else Setting
        return kind(self.engine, self.method, self.values[rung_index], self.order, self.adaptive, default=owner)

    def work(self, old_value: float, new_value: float) -> float:
        """Ratio of the work with the new value of a setting (step, or cell share) to the work with the old one. Cells
        count along and across the contact.
        """
        return 1.0 if self.adaptive else (old_value / new_value) ** (2 if self.cells else 1)


class InCells(Setting):
    """A setting of contact cells: its value is the ratio of a cell's length to that of the contact."""

    def label(self) -> str:
        """Number of cells along the contact, as text."""
        return f"{round(1.0 / self.value)} cells"


@dataclass(frozen=True)
class PricedRun:
    """Result of a run whose accuracy is priced. times (n,) : s, from 0; values (n, k) : of the quantity's channels, in
    its unit; counts : of the work that the run took.
    """

    times: np.ndarray
    values: np.ndarray
    counts: dict[str, int]


class PricedScene(Protocol):
    """Protocol of a scene whose accuracy can be priced: what the search for the cheapest solver settings needs."""

    @property
    def title(self) -> str:
        """Title of the scene."""
        ...

    @property
    def quantity(self) -> str:
        """Name of the quantity to which the tolerance applies."""
        ...

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        ...

    @property
    def full_duration(self) -> float:
        """Duration (s) of the scene's run."""
        ...

    @property
    def searched_duration(self) -> float:
        """Duration (s) of the first part of the run, in which settings are searched."""
        ...

    @property
    def kink_period(self) -> float:
        """Time (s) between points where the quantity is not smooth; 0 where there are none."""
        ...

    @property
    def note(self) -> str:
        """Text on what the price leaves out, "" if nothing."""
        ...

    @property
    def work_count_name(self) -> str:
        """Name of the count that measures the work, such as force calls."""
        ...

    def setting_ladders(self) -> list[SettingLadder]:
        """Ladders of solver settings, one for each method of each requested engine."""
        ...

    def reference_ladder(self) -> SettingLadder:
        """Ladder of the reference's settings, which are refined until the true quantity is known well enough; each step
        is half the previous one.
        """
        ...

    def second_setting(self, reference_setting: Setting) -> Setting | None:
        """Setting of another family of methods whose run must agree with the finest reference; None where there is
        none.
        """
        ...

    def solve(self, setting: Setting, duration: float) -> Any:
        """Build and run the scene with a solver setting over ``duration`` (s); InputError or RunFailed where this is
        impossible.
        """
        ...

    def priced_run(self, solution: Any) -> PricedRun:
        """The quantity along a run, read from what ``solve`` returned."""
        ...

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that select the solver setting."""
        ...
