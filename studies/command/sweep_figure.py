"""Figures of a sweep: a panel per quantity that changes, a curve per implementation, failures as crosses."""

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from models.drawing.figures import COLOURS, LABELS, plt, save

if TYPE_CHECKING:
    from studies.command.sweep import Points

ACROSS, DOWN, PAGES = 3, 4, 4
"""Panels of a page, and the most pages; all numbers are in ``sweep.csv``."""
DECADES = 30.0
"""Ratio of the largest to the least value from which on an axis is logarithmic."""

Columns = dict[str, list[Any]]


def draw(job: "Points", columns: Columns, failures: list[dict[str, str]]) -> list[str]:
    """Write ``sweep.png``, ``sweep-2.png``, ... and return their names."""
    panels = _panels(columns)
    size, names = ACROSS * DOWN, list[str]()
    shown = list(panels.items())[: size * PAGES] or [("no number changes", {})]
    for first in range(0, len(shown), size):
        name = f"sweep-{first // size + 1}.png" if first else "sweep.png"
        _page(job, shown[first : first + size], failures, name, f"the {len(panels)} quantities that change")
        names.append(name)
    return names


def _panels(columns: Columns) -> dict[str, dict[str, list[Any]]]:
    """Quantities that change -> curve of each implementation, "" where there is but one."""
    panels: dict[str, dict[str, list[Any]]] = {}
    for name, column in columns.items():
        first, _, rest = name.partition(", ")
        engine, what = (first, rest) if rest and first in LABELS else ("", name)
        panels.setdefault(what, {})[engine] = column
    return {what: own for what, own in panels.items() if any(_moves(column) for column in own.values())}


def _moves(column: list[Any]) -> bool:
    return len({value for value in column if value is not None}) > 1


def _page(
    job: "Points", panels: list[tuple[str, dict[str, list[Any]]]], failures: list[dict[str, str]], name: str, note: str
) -> None:
    down = -(-len(panels) // ACROSS)
    figure, axes = plt.subplots(down, min(ACROSS, len(panels)), figsize=(12, 2.6 * down + 0.9), squeeze=False)
    at, ticks = _places(job.values)
    for axis, (what, curves) in zip(axes.flat, panels, strict=False):
        _panel(axis, at, what, curves, failures, "o" if ticks else "o-")
        if ticks:
            axis.set_xticks(at, ticks)
        elif _spread(at):
            axis.set_xscale("log")
        axis.set_xlabel(job.key)
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    handles = {
        label: handle for axis in axes.flat for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside upper right", ncols=max(1, len(handles)))
    figure.suptitle(f"{job.scene.rpartition('/')[2]} over {job.key}: {note}", x=0.01, ha="left", fontweight="bold")
    save(figure, job.folder / name)


def _places(values: tuple[Any, ...]) -> tuple[np.ndarray, list[str]]:
    """Places on the axis and, for values that are no numbers, what is written there."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return np.array(values, float), []
    return np.arange(float(len(values))), [str(value)[:18] for value in values]


def _panel(
    axis: Any, at: np.ndarray, what: str, curves: dict[str, list[Any]], failures: list[dict[str, str]], style: str
) -> None:
    order = np.argsort(at)
    for i, (engine, column) in enumerate(curves.items()):
        values = np.array([np.nan if value is None else float(value) for value in column])
        axis.plot(
            at[order],
            values[order],
            style,
            color=COLOURS.get(engine, "#0072b2"),
            markersize=3.5,
            linewidth=2.2 - 0.6 * min(i, 2),
            label=LABELS.get(engine, engine) or None,
        )
    if all(_spread(np.array([v for v in column if v is not None], float)) for column in curves.values()):
        axis.set_yscale("log")
    else:
        axis.ticklabel_format(axis="y", useOffset=False)
    lost = [i for i, failed in enumerate(failures) if failed and any(column[i] is None for column in curves.values())]
    if lost:
        axis.plot(
            at[lost],
            np.full(len(lost), 0.04),
            "x",
            transform=axis.get_xaxis_transform(),
            color="#cc0000",
            markersize=8,
            markeredgewidth=2,
            clip_on=False,
            label="failed",
        )
    axis.set_title(_title(what), fontsize=9)


def _title(what: str) -> str:
    """The quantity on at most two lines, its unit last."""
    text, unit = re.fullmatch(r"(.*?)( \[[^\[\]]*\])?", what, re.DOTALL).groups()  # type: ignore[union-attr]
    if len(what) <= 46:
        return what
    cut = text.rfind(", ", 0, 46)
    cut = cut + 1 if cut > 0 else 46
    return f"{text[:cut]}\n{text[cut : cut + 46].strip()}{unit or ''}"


def _spread(values: np.ndarray) -> bool:
    return bool(len(values) and (values > 0).all() and values.max() > DECADES * values.min())
