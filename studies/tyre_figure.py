"""Figure of tyre friction: along and across the wheel over slip, for several slip angles."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps

from models.core.told import Results
from models.drawing.figures import COLUMN_WIDTH, add_heading, legend_below, save, subplots
from models.tyre.tyre_table import TyreTable

DRAWN_SLIPS = np.linspace(0.0, 1.0, 1001)
COLOUR_MAP = colormaps["viridis"]


def tyre_figure(
    tyre_tables: Mapping[str, TyreTable],
    angles_and_load: tuple[Sequence[float], float],
    title: str,
    figure_path: Path,
    shown_results: Results,
) -> None:
    """Save a figure with a row per tyre table: mu_x over slip, mu_y over slip, and mu_y over mu_x. angles_and_load :
    slip angles (deg) of the curves, and the load (N)."""
    angles, load = angles_and_load
    figure, axes = subplots(len(tyre_tables), 3, figsize=(COLUMN_WIDTH, 2.9 * len(tyre_tables) + 0.5), squeeze=False)
    for row, (name, table) in zip(axes, tyre_tables.items(), strict=True):
        x, y = table.friction(np.deg2rad(angles), DRAWN_SLIPS, load)
        top = 1.08 * max(x.max(), y.max())
        for i, angle in enumerate(angles):
            colour = COLOUR_MAP(0.9 * i / max(len(angles) - 1, 1))
            row[0].plot(DRAWN_SLIPS, x[i], color=colour, label=f"{angle:g}°")
            row[1].plot(DRAWN_SLIPS, y[i], color=colour)
            row[2].plot(x[i], y[i], color=colour)
        row[0].set(xlabel="slip [-]", ylabel="μx [-]", ylim=(0, top), title=f"{name}: along the wheel")
        row[1].set(xlabel="slip [-]", ylabel="μy [-]", ylim=(0, top), title="Across the wheel")
        row[2].set(
            xlabel="μx [-]", ylabel="μy [-]", xlim=(0, top), ylim=(0, top), aspect="equal", title="Both, slip 0 to 1"
        )
    legend_below(figure, axes[0, 0], column_count=len(angles))
    add_heading(figure, f"{title}: friction under {load / 1e3:.4g} kN, by slip angle", shown_results)
    save(figure, figure_path)
