"""Picture of a held wheelset's contact over its displacement: places, angles, forces, pressures of both wheels."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from models.drawing.figures import plt, save
from models.rail.contact_table import Place, Placed
from models.systems.wheel_rail.plan import case_text
from models.systems.wheel_rail.scene import Case

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#222222")
PANELS: tuple[tuple[str, Callable[[Place], float]], ...] = (
    ("on the rail, from its top [mm]", lambda p: 1e3 * (p.y - p.top)),
    ("on the wheel [mm]", lambda p: 1e3 * p.wheel_centre),
    ("contact angle [deg]", lambda p: float(np.degrees(-p.centre_angle))),
    ("normal force [kN]", lambda p: 1e-3 * p.normal),
    ("largest pressure [MPa]", lambda p: 1e-6 * p.peak),
)


def figure(title: str, found: dict[str, tuple[Case, list[Placed]]], path: Path) -> None:
    """A column for each wheel; the bars in the first row are the patches' widths."""
    drawn, axes = plt.subplots(len(PANELS), 2, figsize=(10.5, 12.5), sharex=True, sharey="row")
    for column, wheel in enumerate(("left", "right")):
        for row, (label, value) in enumerate(PANELS):
            axis = axes[row, column]
            for k, (name, (case, placed)) in enumerate(found.items()):
                _points(axis, placed, wheel, value, k, f"{name}: {case_text(case.yaw, case.friction)}", wide=row == 0)
            if column == 0:
                axis.set_ylabel(label)
        axes[0, column].set_title(f"{wheel} wheel")
        axes[-1, column].set_xlabel("displacement of the wheelset to the right [mm]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncols=2)
    drawn.suptitle(f"{title}\nevery patch: bars in the first row are its width", x=0.01, ha="left", fontweight="bold")
    save(drawn, path)


def _points(
    axis: plt.Axes, placed: list[Placed], wheel: str, value: Callable[[Place], float], k: int, label: str, *, wide: bool
) -> None:
    """One case; later ones hollow and beside, so that equal ones show."""
    points = [
        (1e3 * one.shift + 0.08 * k, value(place), 5e2 * place.width * np.cos(place.angle))
        for one in placed
        for place in getattr(one, wheel)
    ]
    if not points:
        return
    shift, values, half = np.array(points).T
    colour = COLOURS[k % len(COLOURS)]
    axis.errorbar(
        shift,
        values,
        yerr=half if wide else None,
        fmt="os"[k % 2],
        markersize=4,
        color=colour,
        linewidth=1.6,
        markerfacecolor=colour if k == 0 else "white",
        label=label,
    )
