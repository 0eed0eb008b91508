"""Figures of rolling contact: pressure, tractions with zones of stick and slip, and creep forces with errors."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import NullLocator

from models.contact.fields import ContactFields
from models.contact.inputs import Array
from models.contact.theories import RollingResult
from models.core.result import Result
from models.drawing.figures import (
    BLUE,
    COLUMN_WIDTH,
    DARK,
    GREEN,
    GREY,
    ORANGE,
    PINK,
    SKY,
    VERMILION,
    add_heading,
    legend_below,
    save,
    subplots,
)
from models.systems.contact.scene import CreepageSweep
from models.systems.contact.work_precision import ERROR_TARGETS, TheoryPoint

MILLIMETRES_PER_METRE, MEGAPASCAL_PER_PASCAL = 1e3, 1e-6
STICK_COLOUR, SLIP_COLOUR = "#cfe3f2", "#f6c9a8"
ARROW_COUNT = 17
"""Approximate number of traction arrows along the longer side of a contact area."""


def contact_figure(
    contact_patches: list[ContactFields],
    friction_coefficient: float,
    title: str,
    pressure_name: str,
    creep_forces: Result,
    figure_path: Path,
) -> None:
    """Save a figure of pressure and tractions over the contact area, with all patches to scale. pressure_name : of the
    pressure distribution.

    creep_forces : the result whose last motion is shown.
    """
    length, width = (
        MILLIMETRES_PER_METRE * np.ptp(np.concatenate([getattr(f, name)[f.inside] for f in contact_patches]))
        for name in "xy"
    )
    size = COLUMN_WIDTH, float(np.clip(3.2 * width / length + 1.9, 3.8, 8.0))
    figure, axes = subplots(1, 2, figsize=size, sharex=True, sharey=True)
    _draw_pressure(axes[0], contact_patches, pressure_name)
    _draw_tractions(axes[1], contact_patches, friction_coefficient, max(length, width) / ARROW_COUNT)
    for axis in axes:
        axis.set(aspect="equal", xlabel="x, direction of rolling [mm]")
        axis.grid(visible=False)
    for axis in axes:
        axis.set_ylabel("y, to the right [mm]")
    axes[0].invert_yaxis()  # as seen from above, where x is ahead
    add_heading(figure, title, {"forces": creep_forces})
    save(figure, figure_path)


def _cell_corners(fields_on_cells: ContactFields) -> list[Array]:
    """Corners (4, 2) in mm of every cell inside the contact area."""
    x, y, dx, dy = (
        MILLIMETRES_PER_METRE * getattr(fields_on_cells, name)[fields_on_cells.inside]
        for name in ("x", "y", "dx", "dy")
    )
    corners = [(x + i * dx / 2, y + j * dy / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return list(np.array(corners).transpose(2, 0, 1))


def _draw_pressure(axis: Any, contact_patches: list[ContactFields], quantity: str) -> None:
    greatest = MEGAPASCAL_PER_PASCAL * max(float(f.pressure.max()) for f in contact_patches)
    for f in contact_patches:
        cells = PolyCollection(
            _cell_corners(f),
            array=MEGAPASCAL_PER_PASCAL * f.pressure[f.inside],
            cmap="viridis",
            edgecolor="face",
            linewidth=0.2,
        )
        cells.set_clim(0.0, greatest)
        axis.add_collection(cells)
    axis.autoscale_view()
    axis.figure.colorbar(cells, ax=axis, location="left", label="pressure [MPa]", shrink=0.8, aspect=25)
    axis.set_title(f"{quantity[0].upper()}{quantity[1:]},\nlargest {greatest:,.0f} MPa")


def _draw_tractions(
    axis: Any, contact_patches: list[ContactFields], friction_coefficient: float, arrow_spacing: float
) -> None:
    """Draw the zones of stick and slip, and arrows of the traction on the wheel at a ``arrow_spacing`` (mm)."""
    largest = friction_coefficient * max(float(f.pressure.max()) for f in contact_patches)
    scaled: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": largest / (1.35 * arrow_spacing)}
    for f in contact_patches:
        colours = np.where(f.slips[f.inside], SLIP_COLOUR, STICK_COLOUR)
        axis.add_collection(PolyCollection(_cell_corners(f), facecolor=colours, edgecolor="face", linewidth=0.2))
        x, y, px, py = _traction_arrows(f, arrow_spacing / MILLIMETRES_PER_METRE)
        arrows = axis.quiver(
            MILLIMETRES_PER_METRE * x, MILLIMETRES_PER_METRE * y, px, py, **scaled, width=0.004, color=DARK
        )
    axis.quiverkey(arrows, 0.9, 1.03, largest, f"{MEGAPASCAL_PER_PASCAL * largest:,.0f} MPa", labelpos="W")
    marks = [Rectangle((0, 0), 1, 1, facecolor=colour) for colour in (STICK_COLOUR, SLIP_COLOUR)]
    area = np.concatenate([(f.dx * f.dy)[f.inside] for f in contact_patches])
    slip = float(area[np.concatenate([f.slips[f.inside] for f in contact_patches])].sum() / area.sum())
    labels = [f"stick, {100 * (1 - slip):.0f} % of the area", f"slip, {100 * slip:.0f} %"]
    axis.figure.legend(marks, labels, loc="outside lower right", ncols=2)
    axis.set_title("Traction on the wheel,\nand where it sticks and slips")


def _traction_arrows(fields_on_cells: ContactFields, arrow_spacing: float) -> Array:
    """Positions x, y (m) and tractions (Pa) of the arrows, (4, n), at evenly spaced points along some rows of cells,
    between which tractions are interpolated."""
    arrows, lines = list[Array](), fields_on_cells.y[:, 0]
    step = max(1, round(arrow_spacing / float(fields_on_cells.dy[0, 0])))
    for row in range(len(lines) // 2 % step, len(lines), step):
        cells_inside = np.flatnonzero(fields_on_cells.inside[row])
        cells_inside = cells_inside[np.argsort(fields_on_cells.x[row, cells_inside])]
        if cells_inside.size:
            x = fields_on_cells.x[row, cells_inside]
            arrow_positions = (
                np.arange(np.ceil(x[0] / arrow_spacing), np.floor(x[-1] / arrow_spacing) + 1) * arrow_spacing
            )
            values = (
                np.interp(arrow_positions, x, traction[row, cells_inside])
                for traction in (fields_on_cells.px, fields_on_cells.py)
            )
            arrows.append(np.array([arrow_positions, np.full_like(arrow_positions, lines[row]), *values]))
    return np.concatenate(arrows, axis=1)


CREEPAGE_LABELS = {"xi_x": "longitudinal creepage [%]", "xi_y": "lateral creepage [%]", "spin": "spin [1/m]"}
FORCE_COLOURS = {"fx": BLUE, "fy": VERMILION, "mz": GREEN}


def creepage_sweep_figure(
    creepage_sweep: CreepageSweep,
    creep_forces: Result,
    exact_results: dict[int, RollingResult],
    title: str,
    figure_path: Path,
) -> None:
    """Save a figure of creep forces and moment over a creepage, with error bands and some results of the exact theory.

    creep_forces : those of the scene, and their errors; exact_results : results of the exact theory by the number of
    the motion.
    """
    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.2))
    values, body = (
        (1.0 if creepage_sweep.of == "spin" else 100.0) * creepage_sweep.values(),
        creep_forces.detail.contact,
    )
    limit = 1e-3 * body.friction * body.pressing.load
    stated, no_error = "error_of_cells" in creep_forces.data, 0.0 * values
    error = 1e-3 * (creep_forces["error_of_cells"] + creep_forces["error_of_theory"]) if stated else no_error
    moment_error = (
        creep_forces["moment_error_of_cells"] + creep_forces["moment_error_of_theory"] if stated else no_error
    )
    for axis, name, label, scale, error_band, force_bound in (
        (left, "fx", "Fx", 1e-3, error, limit),
        (left, "fy", "Fy", 1e-3, error, limit),
        (right, "mz", None, 1.0, moment_error, np.inf),
    ):
        colour, force = FORCE_COLOURS[name], scale * creep_forces[name]
        low, high = (
            np.clip(force - error_band, -force_bound, force_bound),
            np.clip(force + error_band, -force_bound, force_bound),
        )
        axis.fill_between(values, low, high, color=colour, alpha=0.18, linewidth=0)
        axis.plot(values, force, color=colour, linewidth=1.6, label=label)
        exact = [scale * getattr(check, name) for check in exact_results.values()]
        axis.plot(values[list(exact_results)], exact, "o", color=colour, markerfacecolor="white", markersize=5)
    for sign in (-1, 1):
        left.axhline(sign * limit, color=DARK, linewidth=0.7, linestyle=":")
    left.set(title="Force on the wheel; dotted: ±μN", ylabel="tangential force [kN]")
    right.set(title="Moment on the wheel about the normal", ylabel="Mz [N m]")
    for axis in (left, right):
        axis.set_xlabel(CREEPAGE_LABELS[creepage_sweep.of])
        axis.set_xscale("log" if creepage_sweep.spacing == "logarithmic" and creepage_sweep.start > 0 else "linear")
    if stated:
        left.fill_between([], [], color=GREY, alpha=0.3, linewidth=0, label="error of cells and theory")
    if exact_results:
        left.plot([], [], "o", color=DARK, markerfacecolor="white", markersize=5, label="exact theory")
    legend_below(figure, left)
    add_heading(figure, title, {"forces": creep_forces})
    save(figure, figure_path)


THEORY_STYLES = {
    "linear theory": (GREY, "x"),
    "FASTSIM 1982": (VERMILION, "s"),
    "FASTSIM, plain march": (ORANGE, "v"),
    "FASTSIM": (BLUE, "o"),
    "FASTSIM, three flexibilities": (SKY, "^"),
    "FASTSIM, parabolic": (GREEN, "D"),
    "theory of 1983": (PINK, "P"),
    "exact theory": (DARK, "*"),
}


LARGEST_DRAWN_ERROR = 60.0
"""Largest error (% of mu N) that the figure shows."""


def price_figure(price_result: Result, title: str) -> Figure:
    """Figure of the error of every contact theory over its number of cells and over its computing time, on logarithmic
    axes. Bars reach up to the error that 95 % of the contacts do not exceed.

    FASTSIM's choices, which lie within one decade of time, have a panel apart from the theories beside it.
    """
    widths = (1.3, 1.0, 1.0)
    figure, axes = subplots(1, 3, figsize=(COLUMN_WIDTH, 4.6), sharey=True, width_ratios=widths)
    points: list[TheoryPoint] = price_result.detail
    for name in THEORY_STYLES:
        line = [point for point in points if point.name == name]
        if line:
            _plot_theory(axes[0], name, line, [point.cells**2 for point in line], with_bar=True)
            micros = [1e6 * point.seconds for point in line]
            _plot_theory(axes[1 if name.startswith("FASTSIM") else 2], name, line, micros)
    for axis, panel_title, label in zip(
        axes,
        ("By cells; bar: to 95 of 100 contacts", "FASTSIM by time", "Other theories by time"),
        ("cells in the contact area [-]", "time of an evaluation [µs]", "time of an evaluation [µs]"),
        strict=True,
    ):
        axis.set(xscale="log", yscale="log", xlabel=label, title=panel_title)
        for target in ERROR_TARGETS:
            axis.axhline(100 * target, color=DARK, linewidth=0.6, linestyle=":")
    axes[0].set_yticks([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50], ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50"])
    axes[0].yaxis.set_minor_locator(NullLocator())
    axes[0].set(
        ylim=(0.1, LARGEST_DRAWN_ERROR), xlim=(30.0, None), ylabel="mean error of the tangential force [% of μN]"
    )
    legend_below(figure, axes[0])
    add_heading(figure, title, {"price": price_result})
    return figure


def _plot_theory(
    axis: Any, theory_name: str, theory_points: list[TheoryPoint], x_values: list[float], with_bar: bool = False
) -> None:
    """Plot the mean error (% of mu N) of a contact theory. An optional bar at its largest number of cells reaches up to
    the error that 95 % of the contacts do not exceed."""
    colour, marker = THEORY_STYLES[theory_name]
    mean, largest_errors = (
        100 * np.array([getattr(point, key) for point in theory_points]) for key in ("mean", "quantile_95")
    )
    label = theory_name if mean[0] < LARGEST_DRAWN_ERROR else f"{theory_name}: {mean[0]:.0f} %"
    axis.plot(x_values, mean, color=colour, marker=marker, linewidth=1.3, markersize=4.5, label=label)
    if with_bar:
        axis.plot([x_values[-1]] * 2, [mean[-1], largest_errors[-1]], color=colour, linewidth=0.8)
        axis.plot(x_values[-1], largest_errors[-1], "_", color=colour, markersize=5)
