"""Style of all figures: one set of colours, SVG and PNG files, identical bytes from identical results.

Pages show figures ``COLUMN_WIDTH`` inches wide: no figure is wider, so that its letters are read in the size they are
drawn.

Logarithmic axes have decades labelled in plain text, 10⁻³, or few decades by numbers, with marks between them: formulas
in labels and eight marks to every decade are half of what drawing a figure of many panels takes.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from matplotlib.scale import LogScale, register_scale
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullLocator

from models.core.told import Results, figure_remarks
from models.core.whole_files import whole_file

COLUMN_WIDTH = 8.0
"""Width (inches) of the column in which pages show figures: the largest width of a figure."""
TITLE_TEXT, SMALL_TEXT = 9.5, 7.5
"""Font sizes (points) of titles, and of remarks and crowded legends."""
SMALLEST_TEXT = 7.0
"""Font size (points) below which text in a figure cannot be read."""

DARK, BLUE, VERMILION, GREEN = "#222222", "#0072b2", "#d55e00", "#009e73"
PINK, ORANGE, SKY, YELLOW = "#cc79a7", "#e69f00", "#56b4e9", "#f0e442"
GREY, PALE = "#767676", "#b5b5b5"
"""Colours that colour-blind readers can tell apart (Okabe and Ito, 2008); grey and pale are for lines that are no
curves."""
CURVE_COLOURS = (BLUE, VERMILION, GREEN, PINK, ORANGE, SKY, DARK, GREY)
"""Colours of curves without a fixed colour, in turn."""
TRUTH_COLOUR, MEASURED_COLOUR = DARK, PALE
"""Colours of true and of measured quantities, beside computed ones."""
ACCEPTED_COLOUR, DOUBTFUL_COLOUR, REJECTED_COLOUR = "#00795a", "#a86400", "#b00020"
"""Colours of verdicts and bands: accepted or within the limit, doubtful, rejected or beyond the limit."""


class _Colours(dict[str, str]):
    """Colours by engine; green for an engine that has none."""

    def __missing__(self, engine: str) -> str:
        return GREEN


class _Labels(dict[str, str]):
    """Labels by engine; an unknown engine has its own name."""

    def __missing__(self, engine: str) -> str:
        return engine


COLOURS = _Colours({"reference": DARK, "exudyn": BLUE, "mujoco": VERMILION})
"""Colour of each engine in every figure; colour-blind readers can tell them apart."""
LABELS = _Labels({"reference": "reference", "exudyn": "Exudyn", "mujoco": "MuJoCo"})
"""Names of the engines in figures; an engine from outside the tree has its own name."""

rcParams.update(
    {
        "figure.dpi": 110,
        "savefig.dpi": 150,
        "font.size": 8.5,
        "axes.titlesize": TITLE_TEXT,
        "axes.prop_cycle": cycler(color=CURVE_COLOURS),
        "figure.titlesize": 10.5,
        "figure.labelsize": 8.5,
        "legend.fontsize": 8,
        "xtick.labelsize": 8,
        "ytick.labelsize": 8,
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


REMARK_FONT_SIZE = 8
"""Font size (points) of remarks below a figure."""
LETTER_WIDTH_SHARE = 0.6
"""Ratio of a bold letter's mean width to the font size; other letters are a tenth narrower."""


def wrapped_text(text: str, line_width: float, font_size: float) -> str:
    """Text split into lines that fit into a width (inches) at a font size (points)."""
    letters_per_line = max(int(72 * line_width / (LETTER_WIDTH_SHARE * font_size)), 8)
    return "\n".join("\n".join(wrap(line, letters_per_line, break_long_words=False)) for line in text.split("\n"))


def add_heading(figure: Figure, title: str, results: Results | None = None) -> None:
    """Add a title above the figure's left edge, and below the figure the warnings about its results."""
    size, wide = rcParams["figure.titlesize"], figure.get_figwidth()
    figure.suptitle(wrapped_text(title, wide, size), x=0.01, ha="left", fontweight="bold")
    if remarks := figure_remarks(results or {}):
        broken = wrapped_text("\n".join(remarks), 1.12 * wide, REMARK_FONT_SIZE)
        figure.set_figheight(
            figure.get_figheight() + 1.2 * REMARK_FONT_SIZE / 72 * (1 + broken.count("\n"))
        )  # panels keep theirs
        lines = "\n".join((broken, *[" "] * _lines_of_legends(figure)))
        figure.supxlabel(lines, x=0.01, ha="left", fontsize=REMARK_FONT_SIZE, color=REJECTED_COLOUR)


def empty_figure(figure_size: tuple[float, float] | None = None) -> Figure:
    """An empty figure of a size in inches, or of matplotlib's default size, made without pyplot, which is slow to
    import and keeps every figure open."""
    figure = Figure(figsize=figure_size)
    FigureCanvasAgg(figure)
    return figure


def subplots(
    row_count: int = 1, column_count: int = 1, figsize: tuple[float, float] | None = None, **options_of_figure: Any
) -> tuple[Figure, Any]:
    """A figure with panels in rows and columns; figsize : inches; options_of_figure : as for matplotlib's
    ``Figure.subplots``.
    """
    figure = empty_figure(figsize)
    return figure, figure.subplots(row_count, column_count, **options_of_figure)


def subplot_mosaic(
    panel_names: Sequence[Sequence[str]], figsize: tuple[float, float] | None = None, **options_of_figure: Any
) -> tuple[Figure, dict[str, Axes]]:
    """A figure with panels by their names in rows of ``panel_names``; options_of_figure : as for
    ``Figure.subplot_mosaic``.
    """
    figure = empty_figure(figsize)
    return figure, figure.subplot_mosaic([list(row) for row in panel_names], **options_of_figure)


def panels(
    panel_count: int, column_count: int, height: float, figure_width: float = COLUMN_WIDTH, **options_of_figure: Any
) -> tuple[Figure, list[Axes]]:
    """A figure of ``panel_count`` panels in rows of ``column_count``, without empty panels, each ``height`` inches
    high.

    options_of_figure : as for ``subplots``; panels that share an axis show its numbers once.
    """
    row_count = -(-panel_count // column_count)
    figure, axes = subplots(
        row_count, column_count, figsize=(figure_width, height * row_count), squeeze=False, **options_of_figure
    )
    for empty_panel, axis in enumerate(axes.flat[panel_count:], panel_count):
        axes.flat[empty_panel - column_count].xaxis.set_tick_params(labelbottom=True)
        axis.remove()
    return figure, list(axes.flat[:panel_count])


def legend_below(figure: Figure, *axes: Axes, column_count: int = 4) -> None:
    """Add one legend for all panels below them; a name that occurs in several panels is listed once."""
    handles: dict[str, Any] = {}
    for axis in axes:
        lines, names = axis.get_legend_handles_labels()
        handles |= dict(zip(names, lines, strict=True))
    figure.legend([*handles.values()], [*handles], loc="outside lower center", ncols=column_count)


def _lines_of_legends(figure: Figure) -> int:
    """Height of the legends below a figure's axes, in lines of a remark."""
    tops = [legend.get_window_extent().y1 for legend in figure.legends]
    lowest = max((top for top in tops if top < figure.bbox.height / 2), default=0.0)
    return int(np.ceil(lowest / (1.2 * REMARK_FONT_SIZE * figure.dpi / 72)))


def save(figure: Figure, figure_path: Path) -> Path:
    """Write a figure to ``figure_path`` (.svg or .png) without a date, and return the path. The figure is drawn once,
    while ``savefig`` draws it twice."""
    with whole_file(figure_path) as partial_path:
        if figure_path.suffix == ".svg":
            from matplotlib.backends.backend_svg import FigureCanvasSVG

            FigureCanvasSVG(figure).print_svg(partial_path, metadata={"Date": None})
        else:
            figure.set_dpi(rcParams["savefig.dpi"])
            FigureCanvasAgg(figure).print_png(partial_path, metadata={"Software": None})
    return figure_path


RATIO_SCALE_SHARPNESS = 0.05
"""Ratios are drawn as asinh(ln(ratio) / RATIO_SCALE_SHARPNESS): linear about 1, where differences of 10 % are visible,
and logarithmic far from 1."""


def scale_about_one(axis: Axes, axis_name: str, marked_ratios: Sequence[float]) -> None:
    """Scale an axis ("x" or "y") for ratios, so that both 5 % and several decades are visible; ``marked_ratios`` are
    the ratios to be marked."""
    scale = (
        lambda x: np.arcsinh(np.log(np.maximum(x, 1e-12)) / RATIO_SCALE_SHARPNESS),
        lambda u: np.exp(RATIO_SCALE_SHARPNESS * np.sinh(u)),
    )
    getattr(axis, f"set_{axis_name}scale")("function", functions=scale)
    getattr(axis, f"set_{axis_name}ticks")(marked_ratios, [f"{tick:g}" for tick in marked_ratios])
    getattr(axis, f"{axis_name}axis").set_minor_locator(NullLocator())


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Translation of a minus sign and digits to superscripts."""
PLAIN_LABEL_DECADES = 2.0
"""Number of decades on an axis from which on only whole powers of ten are labelled."""
DECADE_MARKS = ("", "2", "4")
"""Leading digits that are labelled on an axis of one decade to ``PLAIN_LABEL_DECADES``; empty for the power of ten
itself.
"""


def _spans_few_decades(lower_end: float, upper_end: float) -> bool:
    """Whether an axis range is positive and shorter than ``PLAIN_LABEL_DECADES``."""
    return 0 < lower_end < upper_end and bool(np.log10(upper_end / lower_end) < PLAIN_LABEL_DECADES)


class _PlainTickLabels(LogFormatterSciNotation):
    """Tick labels in plain text such as 10⁻³ or 2 × 10⁻³, and 20 on an axis with few decades."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Label of a tick mark; called by matplotlib."""
        power = re.search(r"(?:([\d.]+)\\times)?10\^\{(-?\d+)\}", text := super().__call__(x, pos))
        if not power:
            return text
        low, high = sorted(self.axis.get_view_interval()) if self.axis else (0.0, 0.0)
        if _spans_few_decades(low, high) and high > 10 * low and (power[1] or "") not in DECADE_MARKS:
            return ""
        if _spans_few_decades(low, high) and 1e-3 <= x < 1e5:
            return f"{x:g}"
        return f"{power[1] + ' × ' if power[1] else ''}10{power[2].translate(SUPERSCRIPTS)}"


class _MinorTicks(LogLocator):
    """Positions of minor ticks between powers of ten; none on an axis with many decades."""

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """Positions of the ticks on an axis; called by matplotlib."""
        return super().tick_values(vmin, vmax) if _spans_few_decades(vmin, vmax) else np.array([])


class PlainLogScale(LogScale):
    """Logarithmic scale with plain labels, which replaces matplotlib's "log" in every figure; with a base other than
    ten it behaves as matplotlib's."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)

    def set_default_locators_and_formatters(self, axis: Any) -> None:
        """Set tick marks and labels of an axis; called by matplotlib for every axis with this scale."""
        super().set_default_locators_and_formatters(axis)
        if self.base == 10:
            axis.set_major_formatter(_PlainTickLabels())
            axis.set_minor_locator(_MinorTicks(subs=None if self.subs is None else list(self.subs)))
            axis.set_minor_formatter(_PlainTickLabels(labelOnlyBase=self.subs is not None))


register_scale(PlainLogScale)
