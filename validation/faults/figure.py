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
    fault_names: Sequence[str],
    check_names: Sequence[str],
    ratios_by_vehicle: dict[str, list[list[float]]],
    vehicle_titles: dict[str, str],
    hidden_faults: Sequence[bool],
) -> Figure:
    """Coloured table of log10(error / tolerance) for each vehicle, with faults as rows and checks as columns; white
    where a check does not see the fault.

    ratios_by_vehicle : by vehicle, rows of faults and columns of checks; hidden_faults : faults that the second vehicle
    hides.
    """
    figure, axes = subplots(
        1, len(ratios_by_vehicle), figsize=(COLUMN_WIDTH, 1.6 + 0.17 * len(fault_names)), sharey=True
    )
    add_heading(figure, "Which check sees which fault: decades above its tolerance")
    for axis, (vehicle, values) in zip(np.atleast_1d(axes), ratios_by_vehicle.items(), strict=True):
        image = _draw_cells(axis, np.array(values), check_names)
        axis.set_title(vehicle_titles[vehicle])
    first_axis, last_axis = np.atleast_1d(axes)[[0, -1]]
    first_axis.set_yticks(range(len(fault_names)), fault_names, fontsize=SMALL_TEXT)
    for row in np.flatnonzero(hidden_faults):
        last_axis.text(
            len(check_names) / 2 - 0.5, row, "hidden", ha="center", va="center", fontsize=SMALL_TEXT, color="#b03000"
        )
    bar = figure.colorbar(image, ax=axes, shrink=0.4, aspect=30, pad=0.01)
    bar.set_label("size of what it sees / tolerance [decades]")
    return figure


def _draw_cells(panel: Any, error_ratios: np.ndarray, check_names: Sequence[str]) -> Any:
    decades = np.log10(np.clip(error_ratios, 1e-3, 10.0**SCALE_DECADES))
    image = panel.imshow(
        np.where(error_ratios > 1, decades, np.nan), cmap=BLUE_COLOUR_MAP, vmin=0, vmax=SCALE_DECADES, aspect="auto"
    )
    panel.set_xticks(
        range(len(check_names)), check_names, rotation=45, ha="right", rotation_mode="anchor", fontsize=SMALL_TEXT
    )
    panel.set_xticks(np.arange(0.5, len(check_names) - 1), minor=True)
    panel.set_yticks(np.arange(0.5, len(error_ratios) - 1), minor=True)
    panel.grid(False)
    panel.grid(True, which="minor", color="#cccccc", linewidth=0.5, alpha=1.0)
    panel.tick_params(which="both", length=0)
    return image
