"""Figures of the study of hub forces."""

from pathlib import Path

import numpy as np

from models.drawing.figures import heading, plt, save
from models.systems.hub_forces.comparison import Comparison

COLOURS = {"free": "#d55e00", "filter": "#0072b2", "prescribed": "#009e73"}
LABELS = {"filter": "Kalman filter of roll and pitch", "prescribed": "roll and pitch prescribed"}


def _shown(comparison: Comparison) -> list[tuple[str, str, str]]:
    """Names, labels and colours of the runs that are drawn: of the free ones, which are alike, the last."""
    free = [(name, "free") for name in comparison.runs if name.startswith("free")][-1:]
    rest = [(name, label) for name, label in LABELS.items() if name in comparison.runs]
    return [(name, label, COLOURS[name.split(",")[0]]) for name, label in (*free, *rest)]


def drift_figure(comparison: Comparison, title: str, path: Path) -> None:
    """Roll, pitch, heading and position of every run, beside the true ones where these are known."""
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.6), sharex=True)
    panels = [(name, name, 1e3, "mrad") for name in ("roll", "pitch", "heading")]
    panels += [("x, beside steady travel", "x", 1, "m"), ("y, to the left", "y", 1, "m"), ("z, up", "z", 1, "m")]
    for axis, (name, channel, factor, unit) in zip(axes.flat, panels, strict=True):
        for run, label, colour in _shown(comparison):
            drawn = comparison.runs[run]
            axis.plot(drawn.times, factor * drawn[channel], color=colour, label=label)
        if true := comparison.truth:
            axis.plot(true.times, factor * true[channel], "--", color="0.2", label="true", linewidth=0.9)
        axis.set(title=name.capitalize(), ylabel=f"[{unit}]")
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=9)
    frame = comparison.measurement.forces.frame
    heading(figure, f"{title}\nThe chassis on forces in the frame '{frame}'", comparison.results)
    save(figure, path)


def damage_figure(comparison: Comparison, title: str, path: Path) -> None:
    """Damage of every section force, divided by the true one's, or without a truth by that of the filter's run."""
    figure, axis = plt.subplots(figsize=(11, 4.6))
    shown, values = _shown(comparison), list[float]()
    for k, (run, label, colour) in enumerate(shown):
        ratios = comparison.damages(comparison.runs[run]["section_force"])
        places = np.arange(len(ratios)) + (k - (len(shown) - 1) / 2) * 0.26
        axis.plot(places, [*ratios.values()], "os^"[k % 3], color=colour, label=label, markersize=5)
        values += ratios.values()
    axis.axhline(1.0, color="0.3", linewidth=0.8)
    axis.set_xticks(range(len(ratios)), [*ratios], rotation=60, ha="right", fontsize=8)
    if max(values) > 3 * min(values):
        axis.set_yscale("log")
    axis.set_ylabel("damage / true damage [1]" if comparison.truth else "damage / that with the filter [1]")
    axis.legend(fontsize=8)
    frame = comparison.measurement.forces.frame
    text = f"{title}\nSection forces in the chassis' axes, slope 5: forces in the frame '{frame}'"
    heading(figure, text, comparison.results)
    save(figure, path)
