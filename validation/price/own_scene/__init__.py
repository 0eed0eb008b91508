"""The price of accuracy of a user's own scene: ``twinrig price SCENE --tolerance T``.

    scene -> OwnScene (a file per system) -> truth -> search -> recommendation -> text

A system joins by a module with ``own(scene, quantity, engines) -> OwnScene`` and its name in
``recommendation.SYSTEMS``.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from validation.price.problems import Setting


@dataclass(frozen=True)
class Ladder:
    """Settings of one engine's method, from coarse to fine.

    values : steps in s, or relative tolerances where ``adaptive``; order : declared, 0 if it varies; default : what the
    engine itself would take (a step in s), 0 where the method is not its default
    """

    engine: str
    method: str
    values: tuple[float, ...]
    order: int
    adaptive: bool = False
    default: float = 0.0

    def setting(self, i: int) -> Setting:
        """The setting on a rung."""
        owner = self.engine if self.default else ""
        return Setting(self.engine, self.method, self.values[i], self.order, self.adaptive, default=owner)


@dataclass(frozen=True)
class Answer:
    """times (n,) in s from 0; values (n, k) of the quantity's channels, in its unit; counts of what it took."""

    times: np.ndarray
    values: np.ndarray
    counts: dict[str, int]


class OwnScene(Protocol):
    """What the search asks of a scene."""

    @property
    def title(self) -> str:
        """Of the scene."""
        ...

    @property
    def quantity(self) -> str:
        """What the tolerance is set on."""
        ...

    @property
    def unit(self) -> str:
        """Of the quantity."""
        ...

    @property
    def whole(self) -> float:
        """Length of the scene's run, s."""
        ...

    @property
    def first(self) -> float:
        """Length of the part that is searched, s."""
        ...

    @property
    def cell(self) -> float:
        """Time between kinks of the quantity, s; 0 where there are none."""
        ...

    @property
    def note(self) -> str:
        """What is left out, "" if nothing is."""
        ...

    def ladders(self) -> list[Ladder]:
        """Every method of every engine that was asked for."""
        ...

    def reference(self) -> Ladder:
        """Settings that are refined until the truth is known; each step is half the one before."""
        ...

    def second(self) -> Setting | None:
        """A setting of another family that must agree with the truth; None where there is none."""
        ...

    def solve(self, setting: Setting, duration: float) -> Any:
        """Build and run; InputError or RunFailed where that cannot be done."""
        ...

    def answer(self, solution: Any) -> Answer:
        """The quantity in what ``solve`` gave."""
        ...

    def lines(self, setting: Setting) -> list[str]:
        """The setting as a scene file holds it."""
        ...
