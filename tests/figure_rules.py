"""What every figure must keep to: letters large enough where it is shown, no empty panel, axes that say what they are,
nothing written over anything else. Each figure that a test saves is held to it (conftest.py)."""

import re
from itertools import combinations

import numpy as np
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from models.drawing.figures import COLUMN_WIDTH, SMALLEST_TEXT

TOUCH = 1.5
"""Pixels by which boxes of letters may lie on one another: a box is larger than what stands in it."""


def faults(figure: Figure) -> list[str]:
    """What is wrong with a figure, in words; empty if nothing is."""
    figure.draw_without_rendering()
    texts = _texts(figure)
    return [*_sizes(figure, texts), *_panels(figure), *_places(figure, texts)]


def _texts(figure: Figure) -> list[Text]:
    """All that is written, without marks of axes beyond their ends."""
    every = [panel for axes in figure.axes for panel in (axes, *axes.child_axes)]
    beyond = {id(label) for axes in every for axis in (axes.xaxis, axes.yaxis) for label in _beyond(axis)}
    written = [text for text in figure.findobj(Text) if text.get_text().strip() and id(text) not in beyond]
    return [text for text in written if _visible(text)]


def _beyond(axis) -> list[Text]:
    """Labels of marks that are not drawn."""
    low, high = sorted(axis.get_transform().transform(axis.get_view_interval()))
    slack = 1e-6 * (high - low)
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    places = [float(axis.get_transform().transform([tick.get_loc()])[0]) for tick in ticks]
    hidden = [not low - slack <= place <= high + slack or not axis.axes.axison for place in places]
    return [label for tick, off in zip(ticks, hidden, strict=True) if off for label in (tick.label1, tick.label2)]


def _visible(artist) -> bool:
    """Whether an artist and all that it belongs to are shown."""
    axes = getattr(artist, "axes", None)
    return artist.get_visible() and (axes is None or axes.get_visible())


def _sizes(figure: Figure, texts: list[Text]) -> list[str]:
    """Letters that are too small where the figure is shown."""
    shown = min(1.0, COLUMN_WIDTH / figure.get_figwidth())
    sizes = {shown * text.get_fontsize(): text.get_text() for text in texts}
    least = min(sizes, default=SMALLEST_TEXT)
    return (
        [f"{sizes[least]!r} is read in {least:.1f} points, below {SMALLEST_TEXT:g}"]
        if least < SMALLEST_TEXT - 1e-9
        else []
    )


def _panels(figure: Figure) -> list[str]:
    """Panels without content, and axes of numbers that do not say what they show, and in which unit."""
    bars = {bar.ax for bar in _colour_bars(figure)}
    said = []
    for axes in figure.axes:
        name = axes.get_title(loc="left") or axes.get_title() or axes.get_xlabel() or "a panel"
        if not axes.get_visible() or (axes not in bars and _empty(axes)):
            said.append(f"{name!r} is an empty panel")
            continue
        if not axes.axison or (axes in bars and any("[" in text for text in (axes.get_ylabel(), axes.get_xlabel()))):
            continue
        said += [f"{name!r}: no unit on the {which} axis" for which in "xy" if _untold(axes, which)]
    return said


def _colour_bars(figure: Figure) -> list[Colorbar]:
    mapped = [item for axes in figure.axes for item in (*axes.images, *axes.collections)]
    return [item.colorbar for item in mapped if item.colorbar is not None]


def _empty(axes) -> bool:
    """Whether nothing is drawn in a panel, or nothing but zeros."""
    if not axes.axison:
        return not (axes.texts or axes.images or axes.patches)
    lines = [np.asarray(line.get_ydata(), float) for line in axes.lines if line.get_transform() == axes.transData]
    curves = any(np.isfinite(values).any() and (values[np.isfinite(values)] != 0).any() for values in lines)
    points = any(np.isfinite(np.asarray(line.get_xdata(), float)).any() for line in axes.lines)
    flat = lines and max(map(len, lines)) > 2 and not curves
    others = axes.texts or axes.images or axes.patches or axes.collections or (axes.child_axes and not axes.lines)
    return not others and (bool(flat) or not points)


def _untold(axes, which: str) -> bool:
    """Whether an axis has numbers and says no unit; a title may say that of what is drawn upwards."""
    axis = getattr(axes, f"{which}axis")
    labels = [label.get_text() for label in axis.get_ticklabels() if label.get_text()]
    if not labels or not all(map(_number, labels)):
        return False
    shared = getattr(axes, f"get_shared_{which}_axes")().get_siblings(axes)
    if not any(label.get_visible() for label in axis.get_ticklabels()) or not axis.get_tick_params().get(
        "labelbottom" if which == "x" else "labelleft", True
    ):
        return False
    titles = [axes.get_title(loc="left"), axes.get_title()] if which == "y" else []
    row = [getattr(other, f"get_{which}label")() for other in shared]
    return not any("[" in text for text in (axis.get_label_text(), *titles, *row))


def _number(text: str) -> bool:
    return re.fullmatch(r"[-\N{MINUS SIGN}]?[\d.]+(e[-+]?\d+)?|([\d.]+ × )?10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", text) is not None


def _places(figure: Figure, texts: list[Text]) -> list[str]:
    """What is written or listed over something else, or beyond the edge."""
    legends = [legend for axes in figure.axes if axes.get_visible() and (legend := axes.get_legend())]
    legends += figure.legends
    inside = {id(text) for legend in legends for text in legend.findobj(Text)}
    straight = [text for text in texts if id(text) not in inside and text.get_rotation() % 90 == 0]
    boxes = [(text.get_text(), _box(text)) for text in straight]
    boxes += [("a legend", legend.get_window_extent()) for legend in legends]
    said = [
        f"{word!r} and {other!r} lie on one another"
        for (word, first), (other, second) in combinations(boxes, 2)
        if _overlap(first, second)
    ]
    edge = figure.bbox.padded(TOUCH)
    return said + [f"{name!r} leaves the figure" for name, box in boxes if not _within(box, edge)]


def _box(text: Text) -> Bbox:
    """Room that the letters take, without a frame, an arrow, and empty lines below."""
    box, lines = Text.get_window_extent(text), text.get_text().split("\n")
    empty = len(lines) - len(text.get_text().rstrip().split("\n"))
    return Bbox.from_extents(box.x0, box.y0 + empty / len(lines) * box.height, box.x1, box.y1)


def _overlap(box: Bbox, other: Bbox) -> bool:
    wide, high = min(box.x1, other.x1) - max(box.x0, other.x0), min(box.y1, other.y1) - max(box.y0, other.y0)
    return wide > TOUCH and high > TOUCH


def _within(box: Bbox, edge: Bbox) -> bool:
    return box.x0 >= edge.x0 and box.y0 >= edge.y0 and box.x1 <= edge.x1 and box.y1 <= edge.y1
