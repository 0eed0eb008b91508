"""Logarithmic axes of decades labelled in plain text, 10⁻³, with marks between them only where they are few.

Formulas in labels and eight marks to every decade are half of what drawing a figure of many panels takes.
"""

import re
from typing import Any

import numpy as np
from matplotlib.scale import LogScale, register_scale
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MANY = 2.0
"""Decades on an axis from which on only whole powers of ten are marked."""


class _Powers(LogFormatterSciNotation):
    """Labels as matplotlib's own, 10⁻³ or 2 × 10⁻³, in plain text."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        found = re.search(r"(?:([\d.]+)\\times)?10\^\{(-?\d+)\}", text := super().__call__(x, pos))
        if not found:
            return text
        return f"{found[1] + ' × ' if found[1] else ''}10{found[2].translate(RAISED)}"


class _Between(LogLocator):
    """Marks between powers of ten, none on an axis of many decades."""

    def tick_values(self, vmin: float, vmax: float) -> Any:
        if 0 < vmin < vmax and np.log10(vmax / vmin) >= MANY:
            return np.array([])
        return super().tick_values(vmin, vmax)


class PlainLogScale(LogScale):
    """The scale called "log" in every figure; with another base than ten it is matplotlib's."""

    def set_default_locators_and_formatters(self, axis: Any) -> None:
        """As matplotlib asks of a scale; called for every axis that takes it."""
        super().set_default_locators_and_formatters(axis)
        if self.base == 10:
            axis.set_major_formatter(_Powers())
            axis.set_minor_locator(_Between(subs=self.subs))
            axis.set_minor_formatter(_Powers(labelOnlyBase=self.subs is not None))


register_scale(PlainLogScale)
