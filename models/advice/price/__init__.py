"""The price of accuracy of a user's own scene: ``twinrig price SCENE --tolerance T``.

scene -> PricedScene (by a file of ``systems``) -> truth -> search -> recommendation -> text
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from models.advice.price.problem import Setting


@dataclass(frozen=True)
class SettingLadder:
    """Settings of one engine's method, from coarse to fine.

    values : steps in s, relative tolerances where ``adaptive``, or shares of a contact where ``cells``; order :
    declared, 0 if it varies; default : what the engine itself, or the scene, would take, 0 where the method is not its
    default; sure : a reference is known where a finer rung changes it by less than this part of the tolerance; said :
    what that rung is, before the change, where it is not half the step, or cells and steps together
    """

    engine: str
    method: str
    values: tuple[float, ...]
    order: int
    adaptive: bool = False
    default: float = 0.0
    cells: bool = False
    sure: float = 20.0
    said: str = ""

    def setting(self, i: int) -> Setting:
        """The setting on a rung."""
        owner, kind = self.engine if self.default else "", InCells if self.cells else Setting
        return kind(self.engine, self.method, self.values[i], self.order, self.adaptive, default=owner)

    def work(self, old_value: float, new_value: float) -> float:
        """Ratio of the work at one setting's value to that at another: cells lie along and across."""
        return 1.0 if self.adaptive else (old_value / new_value) ** (2 if self.cells else 1)


class InCells(Setting):
    """One whose value is the share of a contact's length that a cell has."""

    def label(self) -> str:
        """Number of cells along the contact, as text."""
        return f"{round(1.0 / self.value)} cells"


@dataclass(frozen=True)
class PricedRun:
    """times (n,) in s from 0; values (n, k) of the quantity's channels, in its unit; counts of what it took."""

    times: np.ndarray
    values: np.ndarray
    counts: dict[str, int]


class PricedScene(Protocol):
    """Protocol of a priced scene, which the search for settings uses."""

    @property
    def title(self) -> str:
        """Title of the scene."""
        ...

    @property
    def quantity(self) -> str:
        """The quantity that the tolerance is set on."""
        ...

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        ...

    @property
    def whole(self) -> float:
        """Length of the scene's run, s."""
        ...

    @property
    def first(self) -> float:
        """Length (s) of the first part of the run, in which settings are searched."""
        ...

    @property
    def kink_period(self) -> float:
        """Time between kinks of the quantity, s; 0 where there are none."""
        ...

    @property
    def note(self) -> str:
        """Text on what the price leaves out, "" if nothing."""
        ...

    @property
    def counted(self) -> str:
        """Name among the counts of what work is counted in."""
        ...

    def ladders(self) -> list[SettingLadder]:
        """Ladders of settings, one for each method of each requested engine."""
        ...

    def reference(self) -> SettingLadder:
        """Settings that are refined until the truth is known; each step is half the one before."""
        ...

    def second(self, reference_setting: Setting) -> Setting | None:
        """A setting of another family that must agree with the reference's last one; None where there is none."""
        ...

    def solve(self, setting: Setting, duration: float) -> Any:
        """Build and run; InputError or RunFailed where that cannot be done."""
        ...

    def answer(self, solution: Any) -> PricedRun:
        """The quantity in what ``solve`` gave."""
        ...

    def lines(self, setting: Setting) -> list[str]:
        """The setting as a scene file holds it."""
        ...
