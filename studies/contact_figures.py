"""Pictures of rolling contact: pressure, tractions with stick and slip, creep forces with their error."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from models.contact.fields import Fields
from models.contact.inputs import Array
from models.contact.theories import Rolled
from models.core.result import Result
from models.drawing.figures import heading, plt, save
from models.systems.contact.scene import Sweep
from models.systems.contact.work_precision import TARGETS, Point

MILLI, MEGA = 1e3, 1e-6
STICK, SLIP = "#cfe3f2", "#f6c9a8"
ARROWS = 17
"""Arrows across the longer side of a contact area, about."""


def contact_figure(
    patches: list[Fields], friction: float, title: str, pressure: str, forces: Result, path: Path
) -> None:
    """Pressure (a word or two tell of which kind) over the contact area beside its tractions, all patches to scale.

    forces : the result whose last motion is shown.
    """
    length, width = (MILLI * np.ptp(np.concatenate([getattr(f, name)[f.inside] for f in patches])) for name in "xy")
    size = 10.5, float(np.clip(4.0 * width / length + 1.7, 3.6, 8.5))
    figure, axes = plt.subplots(1, 2, figsize=size, sharex=True, sharey=True)
    _pressure(axes[0], patches, pressure)
    _tractions(axes[1], patches, friction, max(length, width) / ARROWS)
    for axis in axes:
        axis.set(aspect="equal", xlabel="x, direction of rolling [mm]")
        axis.grid(visible=False)
    axes[0].set_ylabel("y, to the right [mm]")
    axes[0].invert_yaxis()  # as seen from above, where x is ahead
    heading(figure, title, {"forces": forces})
    save(figure, path)


def _rectangles(f: Fields) -> list[Array]:
    """Corners of every cell inside, (4, 2) in mm."""
    x, y, dx, dy = (MILLI * getattr(f, name)[f.inside] for name in ("x", "y", "dx", "dy"))
    corners = [(x + i * dx / 2, y + j * dy / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return list(np.array(corners).transpose(2, 0, 1))


def _pressure(axis: Any, patches: list[Fields], what: str) -> None:
    greatest = MEGA * max(float(f.pressure.max()) for f in patches)
    for f in patches:
        cells = PolyCollection(
            _rectangles(f), array=MEGA * f.pressure[f.inside], cmap="viridis", edgecolor="face", linewidth=0.2
        )
        cells.set_clim(0.0, greatest)
        axis.add_collection(cells)
    axis.autoscale_view()
    axis.figure.colorbar(cells, ax=axis, label="pressure [MPa]", shrink=0.8)
    axis.set_title(f"{what}, largest {greatest:,.0f} MPa")


def _tractions(axis: Any, patches: list[Fields], friction: float, spacing: float) -> None:
    """Zones of stick and slip, and an arrow of the traction on the wheel every ``spacing`` (mm)."""
    largest = friction * max(float(f.pressure.max()) for f in patches)
    scaled: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": largest / (1.35 * spacing)}
    for f in patches:
        colours = np.where(f.slips[f.inside], SLIP, STICK)
        axis.add_collection(PolyCollection(_rectangles(f), facecolor=colours, edgecolor="face", linewidth=0.2))
        x, y, px, py = _arrows(f, spacing / MILLI)
        arrows = axis.quiver(MILLI * x, MILLI * y, px, py, **scaled, width=0.003, color="#222222")
    axis.quiverkey(arrows, 0.88, 0.035, largest, f"{MEGA * largest:,.0f} MPa", labelpos="W")
    marks = [plt.Rectangle((0, 0), 1, 1, facecolor=colour) for colour in (STICK, SLIP)]
    area = np.concatenate([(f.dx * f.dy)[f.inside] for f in patches])
    slip = float(area[np.concatenate([f.slips[f.inside] for f in patches])].sum() / area.sum())
    labels = [f"stick, {100 * (1 - slip):.0f} % of the area", f"slip, {100 * slip:.0f} %"]
    axis.figure.legend(marks, labels, loc="outside lower right", ncols=2)
    axis.set_title("traction on the wheel")


def _arrows(f: Fields, spacing: float) -> Array:
    """Position and traction (4, n) at points of an even net: in every so many rows of cells, and linear along each."""
    arrows, lines = list[Array](), f.y[:, 0]
    step = max(1, round(spacing / float(f.dy[0, 0])))
    for row in range(len(lines) // 2 % step, len(lines), step):
        inside = np.flatnonzero(f.inside[row])
        inside = inside[np.argsort(f.x[row, inside])]
        if inside.size:
            x = f.x[row, inside]
            at = np.arange(np.ceil(x[0] / spacing), np.floor(x[-1] / spacing) + 1) * spacing
            values = (np.interp(at, x, traction[row, inside]) for traction in (f.px, f.py))
            arrows.append(np.array([at, np.full_like(at, lines[row]), *values]))
    return np.concatenate(arrows, axis=1)


LABELS = {"xi_x": "longitudinal creepage [%]", "xi_y": "lateral creepage [%]", "spin": "spin [1/m]"}
COLOURS = {"fx": "#0072b2", "fy": "#d55e00", "mz": "#009e73"}


def sweep_figure(sweep: Sweep, forces: Result, checks: dict[int, Rolled], title: str, path: Path) -> None:
    """Forces and moment against a creepage, with the band of their error, and points of the exact theory.

    forces : those of the scene, and their errors; checks : exact ones by the number of the motion.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.8))
    values, body = (1.0 if sweep.of == "spin" else 100.0) * sweep.values(), forces.detail.contact
    limit = 1e-3 * body.friction * body.pressing.load
    stated, none = "error_of_cells" in forces.data, 0.0 * values
    error = 1e-3 * (forces["error_of_cells"] + forces["error_of_theory"]) if stated else none
    turned = forces["moment_error_of_cells"] + forces["moment_error_of_theory"] if stated else none
    for axis, name, label, scale, off, most in (
        (left, "fx", "$F_x$", 1e-3, error, limit),
        (left, "fy", "$F_y$", 1e-3, error, limit),
        (right, "mz", None, 1.0, turned, np.inf),
    ):
        colour, force = COLOURS[name], scale * forces[name]
        low, high = np.clip(force - off, -most, most), np.clip(force + off, -most, most)
        axis.fill_between(values, low, high, color=colour, alpha=0.18, linewidth=0)
        axis.plot(values, force, color=colour, linewidth=1.6, label=label)
        exact = [scale * getattr(check, name) for check in checks.values()]
        axis.plot(values[list(checks)], exact, "o", color=colour, markerfacecolor="white", markersize=5)
    for sign in (-1, 1):
        left.axhline(sign * limit, color="black", linewidth=0.7, linestyle=":")
    left.set(title=r"tangential force on the wheel; dotted: $\pm\mu N$", ylabel="force [kN]")
    right.set(title="moment on the wheel about the normal", ylabel="$M_z$ [N m]")
    for axis in (left, right):
        axis.set_xlabel(LABELS[sweep.of])
        axis.set_xscale("log" if sweep.spacing == "logarithmic" and sweep.start > 0 else "linear")
    if stated:
        left.fill_between([], [], color="#888888", alpha=0.3, linewidth=0, label="error of cells and theory")
    if checks:
        left.plot([], [], "o", color="#444444", markerfacecolor="white", markersize=5, label="exact theory")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    heading(figure, title, {"forces": forces})
    save(figure, path)


STYLES = {
    "linear theory": ("#888888", "x"),
    "FASTSIM 1982": ("#d55e00", "s"),
    "FASTSIM, plain march": ("#e69f00", "v"),
    "FASTSIM": ("#0072b2", "o"),
    "FASTSIM, three flexibilities": ("#56b4e9", "^"),
    "FASTSIM, parabolic": ("#009e73", "D"),
    "theory of 1983": ("#cc79a7", "P"),
    "exact theory": ("#222222", "*"),
}


TOP = 60.0
"""Largest error (%) that the figure shows."""


def price_figure(price: Result, title: str) -> Figure:
    """Error of every theory over its time and over its cells, both logarithmic; thin lines: 95 of 100 contacts."""
    figure, axes = plt.subplots(1, 2, figsize=(11.5, 5.2), sharey=True)
    points: list[Point] = price.detail
    for name, (colour, marker) in STYLES.items():
        line = [point for point in points if point.name == name]
        error, most = (100 * np.array([getattr(point, key) for point in line]) for key in ("mean", "most"))
        label = name if error[0] < TOP else f"{name}: {error[0]:.0f} %"
        for axis, along in zip(axes, ([p.seconds for p in line], [p.cells**2 for p in line]), strict=True):
            axis.plot(along, error, color=colour, marker=marker, linewidth=1.4, markersize=5.5, label=label)
            axis.plot(along, most, color=colour, marker=marker, linewidth=0.6, markersize=3, alpha=0.6)
    for axis, label in zip(axes, ("time of one evaluation from Python [s]", "cells in the contact area"), strict=True):
        axis.set(xscale="log", yscale="log", xlabel=label)
        for target in TARGETS:
            axis.axhline(100 * target, color="black", linewidth=0.5, linestyle=":")
    axes[0].set_yticks([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50], ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50"])
    axes[0].minorticks_off()
    axes[0].set(ylim=(0.1, TOP), ylabel=r"error of the tangential force [% of $\mu N$]")
    axes[0].set_title("thick: mean of all contacts; thin: 95 of 100 are better")
    axes[1].set(title="dotted: 5, 2, 1 and 0.5 %", xlim=(30.0, None))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    heading(figure, title, {"price": price})
    return figure
