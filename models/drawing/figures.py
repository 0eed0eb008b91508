"""How figures look: one style, SVG and PNG, the same bytes from the same results.

Logarithmic axes have decades labelled in plain text, 10⁻³, or few decades by numbers, with marks between them: formulas
in labels and eight marks to every decade are half of what drawing a figure of many panels takes.
"""

import re
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.scale import LogScale, register_scale
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

from models.core.told import Results, remarks
from models.core.whole_files import whole_file


class _Colours(dict[str, str]):
    def __missing__(self, engine: str) -> str:
        return "#009e73"


class _Labels(dict[str, str]):
    def __missing__(self, engine: str) -> str:
        return engine


COLOURS = _Colours({"reference": "#222222", "exudyn": "#0072b2", "mujoco": "#d55e00"})
"""One colour per implementation in every figure; told apart by people who see colours differently."""
LABELS = _Labels({"reference": "reference", "exudyn": "Exudyn", "mujoco": "MuJoCo"})
"""As figures call them; one from outside the tree by its own name and in a colour of its own."""

plt.rcParams.update(
    {
        "figure.dpi": 110,
        "savefig.dpi": 130,
        "font.size": 9.5,
        "axes.titlesize": 10.5,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.alpha": 0.25,
        "legend.frameon": False,
        "lines.linewidth": 1.1,
        "svg.hashsalt": "twinrig",
        "figure.constrained_layout.use": True,
    }
)


REMARK = 8
"""Size (points) of remarks."""


def heading(figure: Figure, title: str, results: Results | None = None) -> None:
    """Title of a whole figure, above its left edge; below the figure what its results must be doubted for."""
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    if told := remarks(results or {}):
        lines = "\n".join((*told, *[" "] * _lines_of_legends(figure)))
        figure.supxlabel(lines, x=0.01, ha="left", fontsize=REMARK, color="#b00020")


def _lines_of_legends(figure: Figure) -> int:
    """How many lines of a remark the legends take that lie below a figure's axes."""
    if figure.legends:
        figure.draw_without_rendering()
    tops = [legend.get_window_extent().y1 for legend in figure.legends]
    lowest = max((top for top in tops if top < figure.bbox.height / 2), default=0.0)
    return int(np.ceil(lowest / (1.2 * REMARK * figure.dpi / 72)))


def save(figure: Figure, path: Path) -> Path:
    """Write ``path`` (.svg or .png) without a date, close the figure and return the path."""
    metadata = {"Date": None} if path.suffix == ".svg" else {"Software": None}
    with whole_file(path) as part:
        figure.savefig(part, metadata=metadata)
    plt.close(figure)
    return path


RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MANY = 2.0
"""Decades on an axis from which on only whole powers of ten are marked."""


def _narrow(low: float, high: float) -> bool:
    return 0 < low < high and bool(np.log10(high / low) < MANY)


class _Powers(LogFormatterSciNotation):
    """Labels where matplotlib has its own: 10⁻³ or 2 × 10⁻³ in plain text, 20 on an axis of few decades."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of a mark, as matplotlib asks for it."""
        power = re.search(r"(?:([\d.]+)\\times)?10\^\{(-?\d+)\}", text := super().__call__(x, pos))
        if not power:
            return text
        if self.axis and _narrow(*sorted(self.axis.get_view_interval())) and 1e-3 <= x < 1e5:
            return f"{x:g}"
        return f"{power[1] + ' × ' if power[1] else ''}10{power[2].translate(RAISED)}"


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
