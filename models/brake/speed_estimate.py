"""The vehicle's speed as a controller sees it: estimated from its wheels, or given away by the scene.

The fastest wheel is the vehicle's speed as long as it rolls. While all wheels slip the estimate falls on at a slope,
and this is learnt: between two moments at which the fastest wheel came back and turned fastest, the vehicle has slowed
down by their difference. The principle is that of the reference speed in Robert Bosch GmbH, Automotive Handbook, and
in M. Burckhardt, Radschlupf-Regelsysteme (1993); the rule for the slope is ours.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass
class SpeedEstimate:
    """The speed (m/s) by samples of the wheels' ones.

    sample : s between two of them; first : slope (m/s^2) until one is learnt, chosen: with 10 a slip bang-bang takes
    10 % more way on ice, as the estimate goes down with its wheels, with 4 it takes 8 % more on dry road, as it lets
    them go too early, with 6 neither; steepest : deceleration (m/s^2) that no vehicle exceeds; margin : the slope by
    the deceleration learnt; apart : s at least between the moments from which it is learnt. Wheels that are held at a
    slip and never come back teach it nothing.
    """

    sample: float
    first: float = 6.0
    steepest: float = 10.0
    gentlest: float = 1.0
    margin: float = 1.2
    apart: float = 0.15

    def __post_init__(self) -> None:
        self._speed, self._slope = math.nan, self.first
        self._fastest, self._rising, self._since = 0.0, False, 0.0
        self._peak = math.nan

    def after(self, wheels: Sequence[float]) -> float:
        """Estimate at one more sample of the wheels' speeds (m/s)."""
        fastest = max(wheels)
        if self._speed != self._speed:
            self._speed = self._peak = fastest
        self._learn(fastest)
        self._speed = max(fastest, self._speed - self._slope * self.sample)
        return self._speed

    def _learn(self, fastest: float) -> None:
        """Take the slope from the last two moments at which the fastest wheel turned fastest."""
        self._since += self.sample
        if self._rising and fastest < self._fastest and self._since >= self.apart:
            slope = self.margin * (self._peak - self._fastest) / self._since
            self._slope = min(max(slope, self.gentlest), self.steepest)
            self._peak, self._since = self._fastest, 0.0
        self._rising, self._fastest = fastest > self._fastest, fastest


def speed_of(given: float, wheels: Sequence[float], estimate: SpeedEstimate) -> float:
    """The speed (m/s) that the scene gives, or the estimate if that is not a number."""
    return estimate.after(wheels) if given != given else given
