"""Figures of drift: the error that each stabiliser leaves, the effect of its stiffness or cut-off on a grade, and the
scatter of error paths."""

import math
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import NullLocator

from models.core.told import Results
from models.drawing.figures import (
    ACCEPTED_COLOUR,
    BLUE,
    COLUMN_WIDTH,
    DOUBTFUL_COLOUR,
    GREY,
    REJECTED_COLOUR,
    SMALL_TEXT,
    VERMILION,
    add_heading,
    legend_below,
    scale_about_one,
    subplots,
)
from models.drift.score import JUDGED_BAND, SECTION_FORCE_CHANNELS, TUMBLING_PITCH, AcceptanceLimits

MethodRow = dict[str, Any]

ROAD_LABELS = {"road": ("on the road", BLUE), "grade": ("on the grade", VERMILION)}
"""Words and colour of each road."""
VERDICT_SIGNS = {
    "accepted": ("✓", ACCEPTED_COLOUR),
    "stabilise": ("~", DOUBTFUL_COLOUR),
    "rejected": ("✗", REJECTED_COLOUR),
}
"""Symbol and colour of each verdict."""
CHANNEL_MARKERS = dict(zip(SECTION_FORCE_CHANNELS, ("o", "s", "^", "D"), strict=True))
"""Marker of each section force channel."""
CHANNEL_LABELS = {"f3x": "front, along", "f3z": "front, upright", "f4x": "rear, along", "f4z": "rear, upright"}
DAMAGE_AXIS, PITCH_AXIS, MOMENT_SHARE_AXIS = (3e-3, 3e2), (1e-4, 10.0), (1e-4, 1.0)
"""Ranges of the figure's axes; a marker at an edge stands for a value beyond it."""
DAMAGE_TICKS = (0.01, 0.5, 0.9, 1.1, 2.0, 100.0)


def draw_quantile_bands(axis: Any, times: np.ndarray, quantile_bands: np.ndarray) -> None:
    """Draw bands of the pitch error's magnitude (rad) over times (s), from its 5, 25, 50, 75 and 95 % quantiles (5,
    times)."""
    low, lower_quarter, middle, upper_quarter, high = quantile_bands
    axis.fill_between(times, low, high, alpha=0.2, color=BLUE, linewidth=0, label="5 to 95 %")
    axis.fill_between(times, lower_quarter, upper_quarter, alpha=0.4, color=BLUE, linewidth=0, label="25 to 75 %")
    axis.semilogy(times, middle, color=BLUE, label="median")
    axis.set_title("Magnitude of the pitch error [rad]")


def decision_figure(
    method_rows: list[MethodRow],
    acceptance_limits: AcceptanceLimits,
    road_grade: float | None,
    results: Results | None = None,
) -> Any:
    """Figure with one line per stabilising method: damage, pitch error, artificial moment, the verdicts with and
    without a true run, and cost."""
    methods = list(dict.fromkeys(row["method"] for row in method_rows))
    widths = (2.5, 1.25, 1.25, 1.5)
    figure, axes = subplots(1, 4, figsize=(COLUMN_WIDTH, 2.6 + 0.36 * len(methods)), sharey=True, width_ratios=widths)
    for row in method_rows:
        _draw_run(axes, row, methods.index(row["method"]))
    right = (1 - acceptance_limits.damage_error, 1 + acceptance_limits.damage_error)
    _prepare_panel(
        axes[0], DAMAGE_AXIS, "pseudo-damage of the section forces\nin the chassis' axes / true one [-]", right
    )
    _prepare_panel(
        axes[1],
        PITCH_AXIS,
        "largest pitch error\n[rad] (dotted:\ntumbled)",
        (PITCH_AXIS[0], acceptance_limits.pitch_error),
    )
    _prepare_panel(
        axes[2],
        MOMENT_SHARE_AXIS,
        f"added moment /\nI pitch'' [-],\nrms to {JUDGED_BAND:g} Hz",
        (MOMENT_SHARE_AXIS[0], acceptance_limits.artificial_share),
    )
    scale_about_one(axes[0], "x", DAMAGE_TICKS)
    axes[0].set_xlim(*DAMAGE_AXIS)
    axes[1].axvline(TUMBLING_PITCH, color=REJECTED_COLOUR, linewidth=0.8, linestyle=":")
    axes[0].set_yticks(range(len(methods)), methods)
    axes[0].set_ylim(len(methods) - 0.5, -0.5)
    _draw_verdicts(axes[3], method_rows, methods)
    _draw_legend(figure, road_grade)
    add_heading(
        figure,
        "Which stabiliser leaves the section forces right: perturbed model, noisy wheel forces "
        f"({method_rows[0]['engine']})",
        results,
    )
    return figure


def _draw_run(panels: Any, method_row: MethodRow, line_number: int) -> None:
    """Draw the markers of one run; those of a run on a grade are slightly lower."""
    _, colour = ROAD_LABELS[method_row["road"]]
    y = line_number + (0.17 if method_row["road"] == "grade" else -0.17)
    for channel, mark in CHANNEL_MARKERS.items():
        if method_row[f"damage {channel}"] is not None:
            clipped_damage = np.clip(method_row[f"damage {channel}"], *DAMAGE_AXIS)
            panels[0].plot(clipped_damage, y, mark, color=colour, markersize=4, clip_on=False, alpha=0.8)
    if method_row["damage f3x"] is None:
        verdict_text = f"tumbled; its vertical f3 says {method_row['vertical damage f3']:.2f}"
        panels[0].text(1.0, y, verdict_text, color=colour, fontsize=SMALL_TEXT, ha="center", va="center")
    for axis, name, span in (
        (panels[1], "pitch error max [rad]", PITCH_AXIS),
        (panels[2], "moment share to 15 Hz", MOMENT_SHARE_AXIS),
    ):
        axis.plot(np.clip(method_row[name], *span), y, "o", color=colour, markersize=4, clip_on=False)


def _prepare_panel(
    axis: Any, axis_limits: tuple[float, float], title: str, acceptable_range: tuple[float, float]
) -> None:
    """Set a panel's logarithmic axis, its label, and the band of acceptable values."""
    axis.set(xscale="log", xlim=axis_limits, xlabel=title)
    axis.axvspan(*acceptable_range, color=ACCEPTED_COLOUR, alpha=0.16, linewidth=0)
    axis.grid(axis="y", alpha=0.25)


def _draw_verdicts(axis: Any, method_rows: list[MethodRow], method_names: list[str]) -> None:
    """Draw symbols for the verdicts with and without the true run, per road, and the computing time relative to the
    free run."""
    axis.set_xlim(0, 10)
    axis.axis("off")
    columns = [
        (row["road"], key) for row in method_rows if row["method"] == "free" for key in ("verdict", "without truth")
    ]
    x_by_column = dict(zip(columns, (0.8, 2.6, 4.4, 6.2), strict=False))
    for (road, key), x in x_by_column.items():
        name = "by damage" if key == "verdict" else "without truth"
        road_text = "road" if road == "road" else "grade"
        style = {"fontsize": SMALL_TEXT, "va": "bottom", "ha": "center", "rotation": 90, "color": ROAD_LABELS[road][1]}
        axis.text(x, -0.75, f"{road_text}, {name}", **style)
    axis.text(8.9, -0.75, "seconds / free", fontsize=SMALL_TEXT, va="bottom", ha="center", rotation=90)
    free = next(row["seconds"] for row in method_rows if row["method"] == "free")
    for row in method_rows:
        line = method_names.index(row["method"])
        for key in ("verdict", "without truth"):
            sign, colour = VERDICT_SIGNS[row[key]]
            x = x_by_column[row["road"], key]
            axis.text(x, line, sign, color=colour, va="center", ha="center", fontsize=10, fontweight="bold")
        if row["road"] == method_rows[0]["road"]:
            axis.text(9.9, line, f"{row['seconds'] / free:.1f}", va="center", ha="right", fontsize=8)


def _draw_legend(figure: Any, road_grade: float | None) -> None:
    """Draw the legend of marks and roads below the figure."""
    marks = [
        Line2D([], [], marker=mark, linestyle="", color=GREY, markersize=5, label=CHANNEL_LABELS[channel])
        for channel, mark in CHANNEL_MARKERS.items()
    ]
    words = {"road": "on the road as it is", "grade": f"on the same road with a grade of {road_grade or 0:g} rad"}
    roads = [
        Line2D([], [], marker="o", linestyle="", color=ROAD_LABELS[road][1], label=word)
        for road, word in words.items()
        if road == "road" or road_grade is not None
    ]
    good = Rectangle((0, 0), 1, 1, color=ACCEPTED_COLOUR, alpha=0.16, label="within the limits")
    signs = [
        Line2D([], [], marker="s", linestyle="", color=colour, markersize=5, label=f"{sign} {word}")
        for word, (sign, colour) in VERDICT_SIGNS.items()
    ]
    figure.legend(handles=[*marks, *roads, good, *signs], loc="outside lower center", ncols=4)


def stiffness_figure(
    stiffness_sweep: dict[str, np.ndarray], bench: Any, acceptance_limits: AcceptanceLimits, road_grade: float | None
) -> Any:
    """Figure of the largest pitch error and the worst damage ratio over the stiffness of the spring to the ground, for
    every road; the upper axis shows the cut-off of the equivalent high-pass.

    stiffness_sweep : per road what ``Bench.sweep`` gives; bench : the bench of the road without the grade
    """
    figure, axes = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.6))
    for road, curve in stiffness_sweep.items():
        name, colour = ROAD_LABELS[road]
        axes[0].loglog(curve[:, 0], curve[:, 1], "-", color=colour, label=f"spring {name}")
        axes[0].loglog(curve[:, 0], curve[:, 2], "o", color=colour, markersize=4, label=f"high-pass {name}")
        has_not_tumbled = curve[:, 1] < TUMBLING_PITCH
        axes[1].loglog(curve[has_not_tumbled, 0], curve[has_not_tumbled, 3], "o-", color=colour, markersize=4)
        tumbled = curve[~has_not_tumbled, 0]
        axes[1].plot(tumbled, np.full(len(tumbled), DAMAGE_AXIS[1]), "x", color=colour, label=f"tumbles {name}")
    low = acceptance_limits.pitch_error / 2
    axes[0].axhspan(low, acceptance_limits.pitch_error, color=ACCEPTED_COLOUR, alpha=0.16, linewidth=0, label="allowed")
    axes[1].axhspan(
        1 - acceptance_limits.damage_error,
        1 + acceptance_limits.damage_error,
        color=ACCEPTED_COLOUR,
        alpha=0.3,
        linewidth=0,
    )
    axes[0].set(ylim=(low, 3.0), title="Largest pitch error [rad]")
    axes[1].set(ylim=(None, 1.5 * DAMAGE_AXIS[1]), title="Damage of the worst section force / true [-]")
    for axis in axes:
        axis.axvline(bench.holding, color=GREY, linewidth=0.8, linestyle="--", label="predicted to hold from here")
        axis.set_xlabel("stiffness of the spring to the ground [N m/rad]")
        turning = (
            lambda k: np.sqrt(np.maximum(k, 0.0) / bench.pitch_inertia) / (2 * math.pi),
            lambda f: bench.pitch_inertia * (2 * math.pi * f) ** 2,
        )
        cutoff_axis = axis.secondary_xaxis("top", functions=turning)
        cutoff_axis.set_xlabel("cut-off of the equivalent high-pass [Hz]")
        figure.draw_without_rendering()  # an axis beside another one takes its scale and its marks when it is drawn
        cutoff_axis.xaxis.set_minor_locator(NullLocator())
    why = (
        "what the stiffness does"
        if road_grade is None
        else f"no stiffness is right, least of all on a grade of {road_grade:g} rad"
    )
    legend_below(figure, *axes, column_count=3)
    add_heading(figure, f"Keeping the pitch near zero: {why}")
    return figure
