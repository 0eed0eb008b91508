"""The figure of a choice of effects: what each changes, against the tolerance, and energy activity beside it."""

from pathlib import Path
from typing import Any

import numpy as np

from models.advice.ride_choice.choose import Choice
from models.drawing.figures import plt, save
from models.systems.ride.scene import RideScene

LOWEST, HIGHEST = 1e-4, 1e3
"""Ends of the axis of changes (percent): what is smaller or larger is drawn at the end."""
ELEMENTS = 12
"""Elements whose activity is drawn, the most active first."""


def choice_figure(scene: RideScene, alone: list[Any], choice: Choice, watts: dict[str, float], path: Path) -> None:
    """Changes by effect, left out alone and all together; activity by element."""
    rows = [
        (one.effect.name + ("  [left out]" if one.effect in choice.left_out else ""), one.predicted, one.confirmed)
        for one in alone
    ] + [("all that is left out", choice.predicted, choice.confirmed)]
    height = 1.6 + 0.3 * max(len(rows), ELEMENTS)
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, height), width_ratios=(1.6, 1))
    y = np.arange(len(rows))[::-1]
    for i, name in enumerate(scene.quantities):
        shift = 0.16 * (i - (len(scene.quantities) - 1) / 2)
        found, said = (_drawn([row[k][i] for row in rows]) for k in (2, 1))
        left.plot(found, y + shift, "o", color=f"C{i}", label=f"{name}, confirmed", ms=5)
        left.plot(said, y + shift, "x", color=f"C{i}", label=f"{name}, predicted", ms=6)
    left.axvline(100 * (scene.tolerance or 0), color="#222222", ls="--", label="tolerance")
    left.set(
        xscale="log",
        xlim=(LOWEST / 1.5, HIGHEST * 1.5),
        yticks=y,
        yticklabels=[row[0] for row in rows],
        xlabel="change of the standard deviation [%], worst speed (at the ends: beyond)",
        title="What leaving out an effect changes",
    )
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize=8)
    _activity(right, watts)
    figure.suptitle(scene.title)
    save(figure, path)


def _drawn(values: list[float]) -> np.ndarray:
    return np.clip(np.nan_to_num(100 * abs(np.array(values)), posinf=HIGHEST), LOWEST, HIGHEST)


def _activity(axis: Any, watts: dict[str, float]) -> None:
    """Shares of the finite ones; an inertia under white noise has none."""
    finite = {name: value for name, value in watts.items() if np.isfinite(value)}
    total = sum(finite.values())
    shown = sorted(finite.items(), key=lambda item: -item[1])[:ELEMENTS][::-1]
    axis.barh([name for name, _ in shown], [100 * value / total for _, value in shown], color="#0072b2", alpha=0.7)
    without = [name for name in watts if name not in finite]
    note = f"\n{len(without)} inertias are unbounded under white noise" if without else ""
    axis.set(title="Energy activity: blind to the question", xlabel=f"share of the mean power [%]{note}")
