"""Figures of a sweep: every number that changes over the key, with marks at doubtful results."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.core.assumptions import broken_assumptions_of
from models.core.discretisation import WARNED_SHARE, largest_estimate
from models.core.told import Results
from models.drawing.figures import (
    COLOURS,
    COLUMN_WIDTH,
    GREY,
    LABELS,
    ORANGE,
    REJECTED_COLOUR,
    add_heading,
    legend_below,
    panels,
    save,
    wrapped_text,
)
from studies.command.summary_numbers import Columns, has_several_values, present_numbers

PANELS_ACROSS, PANELS_DOWN, MOST_PAGES = 2, 5, 5
"""Numbers of panels in the width and height of a page, and most pages; all numbers are in ``sweep.csv``."""
LOGARITHMIC_RATIO = 30.0
"""Ratio of the largest to the least value above which an axis is logarithmic."""
FAILED_MARK = {"marker": "x", "color": REJECTED_COLOUR, "markersize": 8, "markeredgewidth": 2, "label": "failed"}
BROKEN_MARK = {
    "marker": "o",
    "color": REJECTED_COLOUR,
    "markersize": 9,
    "markeredgewidth": 1.5,
    "label": "assumption broken",
}
WARNING_MARK = {
    "marker": "^",
    "color": ORANGE,
    "markersize": 8,
    "markeredgewidth": 1.5,
    "label": f"error above {100.0 * WARNED_SHARE:g} %",
}
"""Mark of a point with a large error; like that of a broken assumption it is drawn open around the point."""


@dataclass(frozen=True)
class SweepResults:
    """Results of a sweep of ``scene`` over ``swept_key``, with a value, a failure record and results for each point.

    columns_by_quantity : numbers over the points, by name; failures_of_points : reasons of failed runs at each point,
    by engine; results_of_points : of each point, without channels, by name; key_unit : of the key's values.
    """

    scene: str
    swept_key: str
    swept_values: tuple[Any, ...]
    columns_by_quantity: Columns
    failures_of_points: list[dict[str, str]]
    results_of_points: Sequence[Results]
    key_unit: str = "SI"

    def broken_points(self, engine: str) -> list[int]:
        """Indices of the points at which a result of an engine, or of any engine for "", broke an assumption."""
        return [
            i
            for i, results in enumerate(self.results_of_points)
            if any(map(broken_assumptions_of, _results_of_engine(results, engine).values()))
        ]

    def warned_points(self, engine: str) -> list[int]:
        """Indices of the points at which a result of an engine, or of any engine for "", states an error large enough
        for a warning."""
        shown = (
            map(largest_estimate, _results_of_engine(results, engine).values()) for results in self.results_of_points
        )
        return [i for i, worst in enumerate(shown) if any(error is not None and error.warned for error in worst)]


def _results_of_engine(point_results: Results, engine: str) -> Results:
    """Results that an engine's curve is based on: results of this engine, and results that belong to no engine."""
    other_engines = set(LABELS) - {engine} if engine else set()
    return {name: run for name, run in point_results.items() if run.data.attrs["engine"] not in other_engines}


def draw_sweep(sweep_results: SweepResults, output_folder: Path) -> list[str]:
    """Save the figures ``sweep.png``, ``sweep-2.png``, ... of a sweep, and return their names; none if no number
    changes."""
    changing = _changing_quantities(sweep_results.columns_by_quantity)
    size, names = PANELS_ACROSS * PANELS_DOWN, list[str]()
    shown = list(changing.items())[: size * MOST_PAGES]
    for first in range(0, len(shown), size):
        name = f"sweep-{first // size + 1}.png" if first else "sweep.png"
        _draw_page(
            sweep_results,
            shown[first : first + size],
            output_folder / name,
            f"the {len(changing)} quantities that change",
        )
        names.append(name)
    return names


def _changing_quantities(columns_by_quantity: Columns) -> dict[str, dict[str, list[Any]]]:
    """Columns of the quantities that change in the sweep, by quantity and engine; the engine is "" for numbers without
    one."""
    panels: dict[str, dict[str, list[Any]]] = {}
    for name, column in columns_by_quantity.items():
        first, _, rest_of_name = name.partition(", ")
        engine, quantity_name = (first, rest_of_name) if rest_of_name and first in LABELS else ("", name)
        panels.setdefault(quantity_name, {})[engine] = column
    return {
        quantity_name: panel
        for quantity_name, panel in panels.items()
        if any(has_several_values(column) for column in panel.values())
    }


def _draw_page(
    sweep_results: SweepResults, shown_curves: list[tuple[str, dict[str, list[Any]]]], figure_path: Path, page_note: str
) -> None:
    figure, axes = panels(len(shown_curves), min(PANELS_ACROSS, len(shown_curves)), 2.3)
    sweep_positions, ticks = _axis_positions(sweep_results.swept_values)
    for axis, (quantity_name, curves) in zip(axes, shown_curves, strict=True):
        _draw_panel(axis, sweep_positions, quantity_name, curves, sweep_results, "o" if ticks else "o-")
        if ticks:
            axis.set_xticks(sweep_positions, ticks)
        elif _wants_log_axis(sweep_positions):
            axis.set_xscale("log")
        else:
            axis.locator_params(axis="x", nbins=6)
        axis.set_xlabel(sweep_results.swept_key if ticks else f"{sweep_results.swept_key} [{sweep_results.key_unit}]")
    legend_below(figure, *axes)
    add_heading(figure, f"{sweep_results.scene.rpartition('/')[2]} over {sweep_results.swept_key}: {page_note}")
    save(figure, figure_path)


def _axis_positions(key_values: tuple[Any, ...]) -> tuple[np.ndarray, list[str]]:
    """Positions of the sweep's values on the axis, and tick labels; these are empty if the values are numbers."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in key_values):
        return np.array(key_values, float), []
    return np.arange(float(len(key_values))), [str(value)[:18] for value in key_values]


def _draw_panel(
    axis: Any,
    sweep_positions: np.ndarray,
    quantity_name: str,
    curves_by_engine: dict[str, list[Any]],
    sweep_results: SweepResults,
    axis_style: str,
) -> None:
    order = np.argsort(sweep_positions)
    for i, (engine, column) in enumerate(curves_by_engine.items()):
        axis.plot(
            sweep_positions[order],
            np.array(column, float)[order],
            axis_style,
            color=COLOURS.get(engine, GREY),
            markersize=3.5,
            linewidth=2.2 - 0.6 * min(i, 2),
            label=LABELS[engine] or None,
        )
        _draw_marks(axis, sweep_positions, np.array(column, float), sweep_results, engine)
    if all(_wants_log_axis(np.array(present_numbers(column), float)) for column in curves_by_engine.values()):
        axis.set_yscale("log")
    else:
        axis.ticklabel_format(axis="y", useOffset=False)
    lost = [
        i
        for i, failed in enumerate(sweep_results.failures_of_points)
        if failed and any(col[i] is None for col in curves_by_engine.values())
    ]
    if lost:
        foot = {"transform": axis.get_xaxis_transform(), "clip_on": False, "linestyle": "none"}
        axis.plot(sweep_positions[lost], np.full(len(lost), 0.04), **FAILED_MARK, **foot)
    axis.set_title(wrapped_text(_label_with_unit(quantity_name), 0.47 * COLUMN_WIDTH, 9), fontsize=9)


def _draw_marks(
    axis: Any, sweep_positions: np.ndarray, curve_values: np.ndarray, sweep_results: SweepResults, engine: str
) -> None:
    """Draw open marks around the points of a curve at which a result broke an assumption or states a large error."""
    for points, look in (
        (sweep_results.broken_points(engine), BROKEN_MARK),
        (sweep_results.warned_points(engine), WARNING_MARK),
    ):
        shown = [i for i in points if np.isfinite(curve_values[i])]
        if shown:
            axis.plot(
                sweep_positions[shown], curve_values[shown], linestyle="none", markerfacecolor="none", zorder=4, **look
            )


def _label_with_unit(quantity_name: str) -> str:
    """Label of a quantity with its unit. If the name holds no unit, the unit is "-" for counts and "SI" for all
    others."""
    return (
        quantity_name
        if "[" in quantity_name
        else f"{quantity_name} [{'-' if quantity_name.startswith('counts') else 'SI'}]"
    )


def _wants_log_axis(curve_values: np.ndarray) -> bool:
    return bool(
        len(curve_values) and (curve_values > 0).all() and curve_values.max() > LOGARITHMIC_RATIO * curve_values.min()
    )
