"""The price of accuracy of a user's own scene: ``twinrig price SCENE --tolerance T``.

scene -> PricedScene (by a file of ``systems``) -> truth -> search -> recommendation -> text
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from models.advice.price.problem import Setting


@dataclass(frozen=True)
class SettingLadder:
    """Settings of one method of an engine, ordered from coarse to fine; each is a rung.

    values : steps in s, relative tolerances where ``adaptive``, or a cell's share of the contact where ``cells``;
    order : declared, 0 if it varies; default : what the engine itself, or the scene, would take, 0 where the method is
    not its default; confirmation_divisor : a reference is known where a finer rung changes it by less than the
    tolerance divided by this; said : text on what that rung is, before the change, where it is not half the step, or
    cells and steps together
    """

    engine: str
    method: str
    values: tuple[float, ...]
    order: int
    adaptive: bool = False
    default: float = 0.0
    cells: bool = False
    confirmation_divisor: float = 20.0
    said: str = ""

    def setting(self, i: int) -> Setting:
        """The setting on rung ``i`` of the ladder."""
        owner, kind = self.engine if self.default else "", InCells if self.cells else Setting
        return kind(self.engine, self.method, self.values[i], self.order, self.adaptive, default=owner)

    def work(self, old_value: float, new_value: float) -> float:
        """Ratio of the work with one setting's value to that with another. Cells count along and across the contact."""
        return 1.0 if self.adaptive else (old_value / new_value) ** (2 if self.cells else 1)


class InCells(Setting):
    """A setting whose value is the ratio of a cell's length to that of the contact."""

    def label(self) -> str:
        """Number of cells along the contact, as text."""
        return f"{round(1.0 / self.value)} cells"


@dataclass(frozen=True)
class PricedRun:
    """Result of a run. times (n,) : s, from 0; values (n, k) : of the quantity's channels, in its unit; counts : of the
    work that the run took.
    """

    times: np.ndarray
    values: np.ndarray
    counts: dict[str, int]


class PricedScene(Protocol):
    """Protocol of a scene that can be priced: what the search for the cheapest settings needs."""

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
    def whole(self) -> float:
        """Duration (s) of the scene's run."""
        ...

    @property
    def first(self) -> float:
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
    def counted(self) -> str:
        """Name of the count that measures the work, such as force calls."""
        ...

    def ladders(self) -> list[SettingLadder]:
        """Ladders of settings, one for each method of each requested engine."""
        ...

    def reference(self) -> SettingLadder:
        """Ladder of the settings that are refined until the truth is known; each step is half the one before."""
        ...

    def second(self, reference_setting: Setting) -> Setting | None:
        """A setting of another family of methods that must agree with the reference's finest one; None where there is
        none.
        """
        ...

    def solve(self, setting: Setting, duration: float) -> Any:
        """Build and run the scene with a setting; InputError or RunFailed where this is impossible."""
        ...

    def answer(self, solution: Any) -> PricedRun:
        """The quantity, read from what ``solve`` returned."""
        ...

    def lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that contain the setting."""
        ...
