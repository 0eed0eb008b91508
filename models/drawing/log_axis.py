"""Logarithmic axes of decades labelled in plain text, 10⁻³, or of few decades by numbers, with marks between them.

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


def _narrow(low: float, high: float) -> bool:
    return 0 < low < high and bool(np.log10(high / low) < MANY)


class _Powers(LogFormatterSciNotation):
    """Labels where matplotlib has its own: 10⁻³ or 2 × 10⁻³ in plain text, 20 on an axis of few decades."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of a mark, as matplotlib asks for it."""
        found = re.search(r"(?:([\d.]+)\\times)?10\^\{(-?\d+)\}", text := super().__call__(x, pos))
        if not found:
            return text
        if self.axis and _narrow(*sorted(self.axis.get_view_interval())) and 1e-3 <= x < 1e5:
            return f"{x:g}"
        return f"{found[1] + ' × ' if found[1] else ''}10{found[2].translate(RAISED)}"


class _Between(LogLocator):
    """Marks between powers of ten, none on an axis of many decades."""

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """Marks of an axis, as matplotlib asks for them."""
        return super().tick_values(vmin, vmax) if _narrow(vmin, vmax) else np.array([])


class PlainLogScale(LogScale):
    """The scale called "log" in every figure; with another base than ten it is matplotlib's."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)

    def set_default_locators_and_formatters(self, axis: Any) -> None:
        """As matplotlib asks of a scale; called for every axis that takes it."""
        super().set_default_locators_and_formatters(axis)
        if self.base == 10:
            axis.set_major_formatter(_Powers())
            axis.set_minor_locator(_Between(subs=None if self.subs is None else list(self.subs)))
            axis.set_minor_formatter(_Powers(labelOnlyBase=self.subs is not None))


register_scale(PlainLogScale)
