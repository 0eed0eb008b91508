"""The figure of choices among effects: what each changes against the tolerance, and energy activity beside ride's."""

from pathlib import Path
from typing import Any

import numpy as np

from models.drawing.figures import plt, save

LOWEST, HIGHEST = 1e-3, 1e3
"""Ends of the axis of changes (percent): what is smaller or larger is drawn at the end."""
ELEMENTS = 8
"""Elements whose activity is drawn, the most active first."""
LEFT, STAYS = "#009e73", "#d55e00"


def choice_figure(found: list[Any], path: Path) -> None:
    """A panel per scene; one more for the activity of those that have it."""
    panels = [(one, False) for one in found] + [(one, True) for one in found if one.watts]
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    longest = max(max(len(one.alone) for one in found), 4)
    figure, axes = plt.subplots(rows, columns, figsize=(6.2 * columns, rows * (1.5 + 0.21 * longest)), squeeze=False)
    for axis, (one, active) in zip(axes.flat, panels, strict=False):
        _activity(axis, one) if active else _changes(axis, one)
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    gap = " " if columns > 1 else "\n"
    figure.suptitle(
        f"Which effects matter for which question:{gap}change by leaving out one effect, against the tolerance",
        x=0.01,
        ha="left",
        fontweight="bold",
    )
    save(figure, path)


def _changes(axis: Any, one: Any) -> None:
    """Changes of every quantity by leaving out each effect alone; the row's colour tells whether it went."""
    shown = sorted(one.alone, key=lambda effect: float(np.nan_to_num(effect.changes, posinf=HIGHEST).max()))
    y = np.arange(len(shown))
    for i, name in enumerate(one.scene.quantities):
        values = np.array([effect.changes[i] for effect in shown])
        axis.plot(
            np.clip(np.nan_to_num(100 * values, posinf=HIGHEST), LOWEST, HIGHEST),
            y,
            "os^Dv"[i % 5],
            color=f"C{i}",
            ms=5,
            label=name.partition(" [")[0],
        )
    axis.axvline(100 * one.scene.tolerance, color="#222222", ls="--", lw=1, label="tolerance")
    axis.set(
        xscale="log",
        xlim=(LOWEST / 1.5, HIGHEST * 1.5),
        yticks=y,
        yticklabels=[effect.effect.replace("_", " ") for effect in shown],
        xlabel="change [%] (at the ends: beyond)",
    )
    for label, effect in zip(axis.get_yticklabels(), shown, strict=True):
        label.set_color(LEFT if effect.effect in one.choice.left_out else STAYS)
    before, _, after = one.choice.calls
    axis.set_title(
        f"{one.scene.system}: {before / after:.3g} times fewer calls at {100 * one.scene.tolerance:g} %\n"
        "green: left out; orange: stays, as it matters or costs nothing",
        fontsize=9.5,
    )
    axis.legend(fontsize=7.5, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _activity(axis: Any, one: Any) -> None:
    finite = {name: value for name, value in one.watts.items() if np.isfinite(value)}
    total = sum(finite.values())
    shown = sorted(finite.items(), key=lambda item: -item[1])[:ELEMENTS][::-1]
    axis.barh([name for name, _ in shown], [100 * value / total for _, value in shown], color="#0072b2", alpha=0.7)
    axis.set(
        title=f"{one.scene.system}: energy activity,\nwhich knows neither the question nor pairs",
        xlabel="share of the mean power [%]",
    )
