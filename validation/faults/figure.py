"""Figure of the checks that see each planted fault, and by how much their errors exceed the tolerance."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from models.drawing.figures import COLUMN_WIDTH, SMALL_TEXT, add_heading, subplots

SCALE_DECADES = 12
"""Decades at the end of the colour scale; a refused run counts as this many."""
BLUE_COLOUR_MAP = LinearSegmentedColormap.from_list("seen", ("#d6e6f4", "#6aaed6", "#08488e"))


def fault_map(
    faults: Sequence[str],
    checks: Sequence[str],
    ratios: dict[str, list[list[float]]],
    titles: dict[str, str],
    hidden: Sequence[bool],
) -> Figure:
    """Coloured table of log10(error / tolerance) for each vehicle, with faults as rows and checks as columns; white
    where a check does not see the fault.

    ratios : by vehicle, rows of faults and columns of checks; hidden : faults that the second vehicle hides.
    """
    figure, axes = subplots(1, len(ratios), figsize=(COLUMN_WIDTH, 1.6 + 0.17 * len(faults)), sharey=True)
    add_heading(figure, "Which check sees which fault: decades above its tolerance")
    for axis, (vehicle, values) in zip(np.atleast_1d(axes), ratios.items(), strict=True):
        image = _draw_cells(axis, np.array(values), checks)
        axis.set_title(titles[vehicle])
    first_axis, last_axis = np.atleast_1d(axes)[[0, -1]]
    first_axis.set_yticks(range(len(faults)), faults, fontsize=SMALL_TEXT)
    for row in np.flatnonzero(hidden):
        last_axis.text(
            len(checks) / 2 - 0.5, row, "hidden", ha="center", va="center", fontsize=SMALL_TEXT, color="#b03000"
        )
    bar = figure.colorbar(image, ax=axes, shrink=0.4, aspect=30, pad=0.01)
    bar.set_label("size of what it sees / tolerance [decades]")
    return figure


def _draw_cells(axis: Any, ratios: np.ndarray, checks: Sequence[str]) -> Any:
    decades = np.log10(np.clip(ratios, 1e-3, 10.0**SCALE_DECADES))
    image = axis.imshow(
        np.where(ratios > 1, decades, np.nan), cmap=BLUE_COLOUR_MAP, vmin=0, vmax=SCALE_DECADES, aspect="auto"
    )
    axis.set_xticks(range(len(checks)), checks, rotation=45, ha="right", rotation_mode="anchor", fontsize=SMALL_TEXT)
    axis.set_xticks(np.arange(0.5, len(checks) - 1), minor=True)
    axis.set_yticks(np.arange(0.5, len(ratios) - 1), minor=True)
    axis.grid(False)
    axis.grid(True, which="minor", color="#cccccc", linewidth=0.5, alpha=1.0)
    axis.tick_params(which="both", length=0)
    return image
