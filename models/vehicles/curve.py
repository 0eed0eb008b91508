"""A force given as a curve through points: a digressive damper, a bump stop, an asymmetric strut."""

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise


@dataclass(frozen=True)
class Curve:
    """Force (N) over travel (m) or over its rate (m/s): straight between points, the outer pieces go on beyond.

    ``arguments`` rise strictly, at least two; the curve passes through (0, 0), so that it changes no equilibrium.
    """

    arguments: tuple[float, ...]
    forces: tuple[float, ...]

    def __call__(self, argument: float) -> float:
        """Force (N) at a travel or rate."""
        i = self._piece(argument)
        return self.forces[i] + self._slopes[i] * (argument - self.arguments[i])

    def slope_at_rest(self) -> float:
        """Slope at 0; in a corner the mean of its two sides, which is what a central difference sees."""
        slopes, at = self._slopes, self._piece(0.0)
        if self.arguments[at] == 0.0 and at > 0:
            return 0.5 * (slopes[at - 1] + slopes[at])
        return slopes[at]

    def hinges(self) -> tuple[float, float, tuple[float, ...], tuple[float, ...]]:
        """Offset (N), first slope, corners and bends of force = offset + slope x + sum of bend max(x - corner, 0)."""
        slopes, x = self._slopes, self.arguments
        bends = tuple(after - before for before, after in pairwise(slopes))
        return self.forces[0] - slopes[0] * x[0], slopes[0], x[1:-1], bends

    @cached_property
    def _slopes(self) -> list[float]:
        x, f = self.arguments, self.forces
        return [(f[i + 1] - f[i]) / (x[i + 1] - x[i]) for i in range(len(x) - 1)]

    def _piece(self, argument: float) -> int:
        """Index of the piece that holds the argument, the outer ones for all beyond."""
        return bisect_right(self.arguments, argument, 1, len(self.arguments) - 1) - 1
