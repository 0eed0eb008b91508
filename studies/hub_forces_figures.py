"""Figures of the study of hub forces: drift of the chassis, and damage ratios of section forces."""

from pathlib import Path

import numpy as np

from models.drawing.figures import (
    BLUE,
    COLUMN_WIDTH,
    DARK,
    GREEN,
    TRUTH_COLOUR,
    VERMILION,
    add_heading,
    legend_below,
    save,
    scale_about_one,
    subplots,
)
from models.systems.hub_forces.comparison import StabiliserComparison

METHOD_COLOURS = {"free": VERMILION, "filter": BLUE, "prescribed": GREEN}
DAMAGE_TICKS = (1e-3, 0.1, 0.5, 0.8, 0.9, 1.0, 1.1, 1.25, 2.0, 10.0, 1e3, 1e6)
"""Damage ratios that are marked on the axis if they lie in its range."""
METHOD_LABELS = {"filter": "Kalman filter of roll and pitch", "prescribed": "roll and pitch prescribed"}


def _drawn_runs(run_comparison: StabiliserComparison) -> list[tuple[str, str, str]]:
    """Name, label and colour of each run to draw; of the free runs, which look alike, only the last is drawn."""
    free = [(name, "free") for name in run_comparison.runs if name.startswith("free")][-1:]
    stabilised = [(name, label) for name, label in METHOD_LABELS.items() if name in run_comparison.runs]
    return [(name, label, METHOD_COLOURS[name.split(",")[0]]) for name, label in (*free, *stabilised)]


def drift_figure(run_comparison: StabiliserComparison, title: str, figure_path: Path) -> None:
    """Save a figure of roll, pitch, heading and position of every run over time, with the true motion if it is
    known."""
    figure, axes = subplots(2, 3, figsize=(COLUMN_WIDTH, 5.0), sharex=True)
    panels = [(name, name, 1e3, "mrad") for name in ("roll", "pitch", "heading")]
    panels += [("x, beside steady travel", "x", 1, "m"), ("y, to the left", "y", 1, "m"), ("z, up", "z", 1, "m")]
    for axis, (name, channel, factor, unit) in zip(axes.flat, panels, strict=True):
        for run, label, colour in _drawn_runs(run_comparison):
            drawn = run_comparison.runs[run]
            axis.plot(drawn.times, factor * drawn[channel], color=colour, label=label)
        if true := run_comparison.truth:
            axis.plot(true.times, factor * true[channel], "--", color=TRUTH_COLOUR, label="true", linewidth=0.9)
        axis.set(title=name.capitalize(), ylabel=f"[{unit}]")
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    legend_below(figure, axes[0, 0])
    frame = run_comparison.measurement.forces.frame
    add_heading(figure, f"{title}\nThe chassis on forces in the frame '{frame}'", run_comparison.results)
    save(figure, figure_path)


def damage_figure(run_comparison: StabiliserComparison, title: str, figure_path: Path) -> None:
    """Save a figure of the damage ratio of every section force: damage divided by the true damage or, if this is
    unknown, by the damage of the run with the Kalman filter."""
    figure, axis = subplots(figsize=(COLUMN_WIDTH, 4.6))
    shown, values = _drawn_runs(run_comparison), list[float]()
    for k, (run, label, colour) in enumerate(shown):
        ratios = run_comparison.relative_damages(run_comparison.runs[run]["section_force"])
        x_positions = np.arange(len(ratios)) + (k - (len(shown) - 1) / 2) * 0.26
        axis.plot(x_positions, [*ratios.values()], "os^"[k % 3], color=colour, label=label, markersize=4)
        values += ratios.values()
    axis.axhline(1.0, color=DARK, linewidth=0.8)
    axis.set_xticks(range(len(ratios)), [*ratios], rotation=90)
    least_ratio, largest_ratio = min(0.9, *values), max(1.1, *values)
    low, high = (
        least_ratio * (0.8 if least_ratio > 0.5 else 0.1),
        largest_ratio * (1.25 if largest_ratio < 2.0 else 10.0),
    )
    scale_about_one(axis, "y", [tick for tick in DAMAGE_TICKS if low <= tick <= high])
    axis.set_ylim(low, high)
    axis.set_ylabel("damage / true damage [-]" if run_comparison.truth else "damage / that with the filter [-]")
    legend_below(figure, axis)
    frame = run_comparison.measurement.forces.frame
    text = f"{title}\nSection forces in the chassis' axes, slope 5: forces in the frame '{frame}'"
    add_heading(figure, text, run_comparison.results)
    save(figure, figure_path)
