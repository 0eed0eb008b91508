"""Figures of the study of hub forces."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.drawing.figures import plt, save
from models.vehicles.cut_vehicle import ANGLES, X, Y, Z

if TYPE_CHECKING:
    from studies.hub_forces import Found

COLOURS = {"free": "#d55e00", "filter": "#0072b2", "prescribed": "#009e73"}


def _colour(name: str) -> str:
    return COLOURS[name.split(",")[0]]


def _shown(found: "Found") -> dict[str, str]:
    """Names of the runs that are drawn, with their labels: of the free ones, which are alike, the last."""
    free = [name for name in found.runs if name.startswith("free")][-1:]
    labels = {"filter": "Kalman filter of roll and pitch", "prescribed": "roll and pitch prescribed"}
    return dict.fromkeys(free, "free") | {name: labels[name] for name in labels if name in found.runs}


def drift_figure(found: "Found", title: str, path: Path) -> None:
    """Roll, pitch, heading and position of every run, beside the true ones where these are known."""
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.6), sharex=True)
    panels = [(name, i, 1e3, "mrad") for name, i in ANGLES.items()]
    panels += [("x, beside steady travel", X, 1.0, "m"), ("y, to the left", Y, 1.0, "m"), ("z, up", Z, 1.0, "m")]
    for axis, (name, i, factor, unit) in zip(axes.flat, panels, strict=True):
        for run, label in _shown(found).items():
            own = found.runs[run]
            axis.plot(own.times, factor * own.states[:, i], color=_colour(run), label=label)
        if found.truth is not None:
            true = found.truth
            axis.plot(true.times, factor * true.states[:, i], "--", color="0.2", label="true", linewidth=0.9)
        axis.set(title=name.capitalize(), ylabel=f"[{unit}]")
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=9)
    figure.suptitle(f"{title}\nThe chassis on forces in the frame '{found.forces.frame}'", fontsize=11)
    save(figure, path)


def damage_figure(found: "Found", title: str, path: Path) -> None:
    """Pseudo-damage of every section force by the true one, or without a truth by that of the run with the filter."""
    from studies.hub_forces import damages

    figure, axis = plt.subplots(figsize=(11, 4.6))
    names, shown = [element.name for element in found.vehicle.elements], _shown(found)
    for k, (run, label) in enumerate(shown.items()):
        ratios = damages(found, found.runs[run])
        places = np.arange(len(names)) + (k - (len(shown) - 1) / 2) * 0.26
        axis.plot(places, [ratios[name] for name in names], "os^"[k % 3], color=_colour(run), label=label, markersize=5)
    axis.axhline(1.0, color="0.3", linewidth=0.8)
    axis.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    values = [value for run in shown for value in damages(found, found.runs[run]).values()]
    if max(values) > 3 * min(values):
        axis.set_yscale("log")
    axis.set_ylabel("damage / true damage [1]" if found.truth else "damage / that with the filter [1]")
    axis.legend(fontsize=8)
    axis.set_title(f"{title}\nSection forces in the chassis' axes, slope 5: forces in the frame '{found.forces.frame}'")
    save(figure, path)
