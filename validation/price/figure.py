"""The work-precision figure: error over counted work and over seconds, with a curve for each integrator."""

from collections import defaultdict
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from models.advice.price.runner import WorkPrecisionPoint, WorkPrecisionPoints
from models.drawing.figures import (
    BLUE,
    COLOURS,
    COLUMN_WIDTH,
    DARK,
    GREEN,
    GREY,
    PINK,
    REJECTED_COLOUR,
    SKY,
    SMALL_TEXT,
    TITLE_TEXT,
    VERMILION,
    add_heading,
    subplots,
    wrapped_text,
)
from validation.price.tables import curve_name

Style = dict[str, Any]
SHARED_MARKERS = {"RK4": "o", "RK44": "o", "Euler": "D", "ExplicitEuler": "D"}
"""Markers of integration methods that several engines have."""
OTHER_MARKERS = "s^v<>PXhp*d"
"""Markers of all further methods, in turn within each engine."""
ORDER_STYLES = {1: ":", 2: "--", 3: "-.", 4: "-"}
FAMILY_COLOURS = (GREY, BLUE, GREEN, PINK, VERMILION, SKY)
"""Colours of curve families that are not engines, such as contact theories."""
LONGEST_LABEL = 27
"""Longest curve name (letters) with which the legend has four columns."""
MARKER_SIZES = {"reference": 6.5, "exudyn": 5.0, "mujoco": 3.5}
"""Marker sizes by engine, so that coinciding curves show as rings within each other."""
SINGLE_RUN_MARKER = 0.5
"""Size of a marker for a setting timed once, divided by the size of one timed in several rounds."""
FRONT_STYLE: Style = {"color": "#f0c808", "linewidth": 7, "alpha": 0.45}
BROKEN_STYLE: Style = {
    "marker": "o",
    "linestyle": "none",
    "markersize": 8.5,
    "markerfacecolor": "none",
    "markeredgecolor": REJECTED_COLOUR,
    "markeredgewidth": 0.8,
}
LABEL_SIZE = np.array([0.37, 0.1])
"""Width and height of the label of an engine's default setting, in fractions of the panel."""
LABEL_POSITIONS = np.array([(x, y) for x in np.linspace(0.015, 0.62, 13) for y in np.linspace(0.2, 0.87, 17)])
"""Allowed positions of a label's left middle, in fractions of the panel, clear of the bands and texts at its edges."""


def draw(measured_points: WorkPrecisionPoints) -> Figure:
    """Figure of error over force calls and over time, side by side; failed settings are marked at the top of the first
    panel."""
    figure, axes = subplots(1, 2, figsize=(COLUMN_WIDTH, 7.6), sharey=True)
    styles = _curve_styles(measured_points)
    top = 8 * max(measured_points.error(p) for p in measured_points.points if p.status == "ok")
    rounds = max(len(p.seconds) for p in measured_points.points)
    several = f"up to {rounds} interleaved rounds (small: one run)" if rounds > 1 else "one run"
    for ax, kind in zip(axes, measured_points.cost_kinds, strict=True):
        _shade_floor(ax, measured_points)
        _plot_front(ax, measured_points, kind)
        for curve, points in measured_points.curves().items():
            _plot_curve(ax, measured_points, points, kind, styles[curve])
        timed = kind == "seconds"
        label = "time [s] of a run, model built anew (median)" if timed else f"{kind} in the run [-]"
        ax.set(xscale="log", yscale="log", xlabel=label)
        ax.set_title(
            wrapped_text(f"By {kind}, {several if timed else 'counted exactly'}", 0.44 * COLUMN_WIDTH, TITLE_TEXT)
        )
    _mark_failures(axes[0], measured_points, top)
    axes[0].set_ylabel(f"error of the {measured_points.quantity} [{measured_points.unit}]")
    axes[0].set_ylim(0.3 * measured_points.uncertainty[measured_points.quantity], 15 * top)
    for ax, kind in zip(axes, measured_points.cost_kinds, strict=True):
        _mark_defaults(ax, measured_points, kind)
    curve_groups = "; ".join(curve_name(group[0], [group]) for group in measured_points.coinciding_curves())
    add_heading(figure, f"What accuracy costs: {measured_points.title}")
    longest = max(map(len, map(curve_name, styles)))
    figure.legend(
        handles=_legend_handles(measured_points, styles),
        loc="outside lower center",
        ncols=4 if longest <= LONGEST_LABEL else 3,
        fontsize=SMALL_TEXT,
        handlelength=2.6,
        columnspacing=1.2,
        title=wrapped_text(f"Same error at the same setting: {curve_groups}.", 1.1 * COLUMN_WIDTH, SMALL_TEXT)
        if curve_groups
        else None,
        title_fontsize=SMALL_TEXT,
        alignment="left",
    )
    return figure


def _curve_styles(measured_points: WorkPrecisionPoints) -> dict[str, Style]:
    """Style of each curve: colour by engine, marker by method, line by declared order (solid from 4 up)."""
    styles: dict[str, Style] = {}
    for curve, (first, *_) in measured_points.curves().items():
        setting, colour = first.setting, _engine_colour(first, measured_points)
        used = {style["marker"] for style in styles.values() if style["color"] == colour}
        marker = SHARED_MARKERS.get(setting.method) or next((m for m in OTHER_MARKERS if m not in used), ".")
        line, size = ORDER_STYLES.get(setting.order, "-"), MARKER_SIZES.get(setting.engine, 5)
        styles[curve] = {"color": colour, "marker": marker, "linestyle": line, "markersize": size}
    return styles


def _engine_colour(measured_point: WorkPrecisionPoint, measured_points: WorkPrecisionPoints) -> str:
    """Colour of the engine of a measured point; engines that are not in COLOURS get one of FAMILY_COLOURS."""
    engine = measured_point.setting.engine
    other_engines = [
        name for name in dict.fromkeys(p.setting.engine for p in measured_points.points) if name not in COLOURS
    ]
    return COLOURS[engine] if engine in COLOURS else FAMILY_COLOURS[other_engines.index(engine) % len(FAMILY_COLOURS)]


def _plot_curve(
    panel: Axes,
    measured_points: WorkPrecisionPoints,
    curve_points: list[WorkPrecisionPoint],
    cost_kind: str,
    curve_style: Style,
) -> None:
    """Plot one curve. Points with errors below the accuracy of the reference are hollow; points timed once are
    small."""
    point_positions = [(p.cost(cost_kind), measured_points.error(p)) for p in curve_points]
    panel.plot(*zip(*point_positions, strict=True), **{**curve_style, "marker": "none"}, alpha=0.75)
    points_by_look = defaultdict(list)
    for p, point_position in zip(curve_points, point_positions, strict=True):
        points_by_look[
            point_position[1] < measured_points.judging_floor(), cost_kind == "seconds" and p.changed is None
        ].append(point_position)
    for (hollow, once), points_alike in points_by_look.items():
        look = {
            **curve_style,
            "linestyle": "none",
            "markersize": curve_style["markersize"] * (SINGLE_RUN_MARKER if once else 1.0),
        }
        face = "white" if hollow else curve_style["color"]
        panel.plot(*zip(*points_alike, strict=True), **look, markerfacecolor=face, markeredgewidth=0.9)
    for p, point_position in zip(curve_points, point_positions, strict=True):
        if p.broken:
            panel.plot(*point_position, **BROKEN_STYLE)


def _shade_floor(panel: Axes, measured_points: WorkPrecisionPoints) -> None:
    """Shade the range of errors below the accuracy of the reference solution."""
    known = measured_points.uncertainty[measured_points.quantity]
    for low, high, alpha in ((1e-30, known, 0.6), (known, measured_points.judging_floor(), 0.25)):
        panel.axhspan(low, high, color="#bbbbbb", alpha=alpha, zorder=0, linewidth=0)
    floor_text = f"reference known to {known:.1g} {measured_points.unit} (dark);\nbelow ten times that: hollow"
    panel.text(
        0.015, 0.012, floor_text, transform=panel.transAxes, ha="left", va="bottom", fontsize=SMALL_TEXT, color=GREY
    )


def _plot_front(panel: Axes, measured_points: WorkPrecisionPoints, cost_kind: str) -> None:
    """Plot the Pareto front of error and cost as a broad pale line behind the curves."""
    front = measured_points.pareto_points(cost_kind)
    costs = [p.cost(cost_kind) for p in front]
    panel.plot(costs, list(map(measured_points.error, front)), **FRONT_STYLE, solid_capstyle="round", zorder=1)


def _mark_defaults(panel: Axes, measured_points: WorkPrecisionPoints, cost_kind: str) -> None:
    """Mark each engine's default setting with a ring, and label it where the panel has most space."""
    taken_positions, names = _line_points(panel), list[np.ndarray]()
    ring: Style = {"markersize": 11, "markerfacecolor": "none", "markeredgecolor": DARK, "markeredgewidth": 1.2}
    for owner, p in measured_points.defaults.items():
        if p.status != "ok":
            continue
        default_position = (p.cost(cost_kind), measured_points.error(p))
        panel.plot(*default_position, "o", **ring, zorder=5)
        around = _fractions_of_panel(panel, [default_position])[0]
        corner = _emptiest_corner(taken_positions, around, names)
        names.append(corner + LABEL_SIZE * np.array([0.5, 0.0]))
        leader_line = around + np.linspace(0.0, 1.0, 9)[:, None] * (names[-1] - around)
        taken_positions = np.vstack(
            [taken_positions, corner + LABEL_SIZE * np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]), leader_line]
        )
        panel.annotate(
            f"{owner} default:\n{p.setting.method},\n{p.setting.label()}",
            default_position,
            fontsize=SMALL_TEXT,
            xytext=(float(corner[0]), float(corner[1])),
            textcoords="axes fraction",
            ha="left",
            va="center",
            zorder=6,
            arrowprops={"arrowstyle": "-", "color": DARK, "linewidth": 0.7, "shrinkB": 5},
        )


def _fractions_of_panel(panel: Axes, data_positions: Any) -> np.ndarray:
    """Positions (n, 2) as fractions of the panel, from positions (n, 2) in data units."""
    return np.asarray((panel.transData - panel.transAxes).transform(np.asarray(data_positions, float)))


def _line_points(panel: Axes) -> np.ndarray:
    """Points (n, 2) along all lines of a panel, as fractions of the panel."""
    points = [np.empty((0, 2))]
    for line in panel.get_lines():
        ends = _fractions_of_panel(panel, line.get_xydata())
        points += [a + (b - a) * np.linspace(0.0, 1.0, 9)[:, None] for a, b in pairwise(ends)] + [ends]
    return np.vstack(points)


def _emptiest_corner(
    taken_positions: np.ndarray, setting_position: np.ndarray, label_centres: list[np.ndarray]
) -> np.ndarray:
    """Position (2,) of LABEL_POSITIONS at which a label covers no line; if several are free, one near its setting.

    label_centres : middles of labels already placed, which the leader line of this label shall not cross.
    """
    middles = LABEL_POSITIONS + LABEL_SIZE * np.array([0.5, 0.0])
    distances = np.abs(middles[:, None] - taken_positions) / (0.5 * LABEL_SIZE)
    clear = np.minimum(distances.max(axis=2).min(axis=1), 1.8)
    far = np.hypot(*(middles - setting_position).T)
    leader_lines = setting_position + np.linspace(0.0, 1.0, 17)[:, None, None] * (middles - setting_position)
    crossed = [(np.abs(leader_lines - name) < 0.55 * LABEL_SIZE).all(axis=2).any(axis=0) for name in label_centres]
    return np.asarray(LABEL_POSITIONS[np.argmax(clear - 0.3 * far - 2.0 * np.sum(crossed, axis=0))])


def _mark_failures(panel: Axes, measured_points: WorkPrecisionPoints, mark_height: float) -> None:
    """Mark each failed setting with a cross at the number of force calls that it would have needed, and list the
    failures."""
    failed = [p for p in measured_points.points if p.status != "ok"]
    for p in failed:
        if calls := _expected_calls(p, measured_points):
            size = 1.4 * MARKER_SIZES.get(p.setting.engine, 5)
            panel.plot(
                calls, mark_height, "x", color=_engine_colour(p, measured_points), markersize=size, markeredgewidth=1.6
            )
    if failed:
        text = "; ".join(
            f"{status}: {_methods_text(failed, status)}" for status in dict.fromkeys(p.status for p in failed)
        )
        text = wrapped_text(text, 0.42 * COLUMN_WIDTH, SMALL_TEXT)
        panel.annotate(text, (0.995, 0.995), xycoords="axes fraction", ha="right", va="top", fontsize=SMALL_TEXT)


def _expected_calls(failed_point: WorkPrecisionPoint, measured_points: WorkPrecisionPoints) -> float:
    """Number of force calls that a failed setting made, or would need by extrapolation from its curve; 0 if unknown."""
    work = measured_points.cost_kinds[0]
    if failed_point.counts:
        return failed_point.cost(work)
    first = next(iter(measured_points.curves().get(failed_point.setting.curve, ())), None)
    return (
        0.0
        if first is None or failed_point.setting.adaptive
        else first.cost(work) * first.setting.value / failed_point.setting.value
    )


def _methods_text(failed_points: list[WorkPrecisionPoint], failure_status: str) -> str:
    """Text for the figure that names the methods whose settings failed with a status."""
    failed_alike = [p for p in failed_points if p.status == failure_status]
    if failure_status == "flagged":
        return ", ".join(dict.fromkeys(f"{p.setting.curve} (cross, see table)" for p in failed_alike))
    unstable = sum(not p.setting.adaptive for p in failed_alike)
    subject = "beyond stability, steps" if failure_status == "refused" else "settings"
    parts = [f"{subject}: {unstable} (crosses)"] if unstable else []
    parts += [
        f"{p.setting.method} ({'not implemented' if 'not implemented' in p.reason else 'see table'})"
        for p in failed_alike
        if p.setting.adaptive
    ]
    return ", ".join(parts)


def _legend_handles(measured_points: WorkPrecisionPoints, curve_styles: dict[str, Style]) -> list[Line2D]:
    """Handles of the legend: the curves, then the Pareto front and the marks of failed settings."""
    names = sorted(curve_styles, key=curve_name)
    handles = [Line2D([], [], **curve_styles[curve], label=curve_name(curve)) for curve in names]
    handles.append(Line2D([], [], **FRONT_STYLE, label="no other setting is better (Pareto)"))
    for text in dict.fromkeys(text for p in measured_points.points for text in p.broken):
        handles.append(Line2D([], [], **BROKEN_STYLE, label=fill(f"assumption broken: {text}", LONGEST_LABEL)))
    if any(p.status != "ok" for p in measured_points.points):
        failed = "no answer to rely on"
        handles.append(Line2D([], [], color=GREY, marker="x", linestyle="none", label=failed))
    return handles
