"""Pictures of rolling contact: pressure, tractions with stick and slip, creep forces with their error."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from models.contact.accuracy import Error
from models.contact.fields import Fields
from models.contact.theories import Contact, Rolled
from models.drawing.figures import plt, save
from models.systems.contact.scene import Sweep
from models.systems.contact.work_precision import TARGETS, Point

MILLI, MEGA = 1e3, 1e-6
STICK, SLIP = "#cfe3f2", "#f6c9a8"
ARROWS = 17
"""Arrows across the longer side of a contact area, about."""


def contact_figure(patches: list[Fields], friction: float, title: str, pressure: str, path: Path) -> None:
    """Pressure (a word or two tell of which kind) over the contact area beside its tractions, all patches to scale."""
    figure, axes = plt.subplots(1, 2, figsize=_size(patches), sharex=True, sharey=True)
    _pressure(axes[0], patches, pressure)
    _tractions(axes[1], patches, friction)
    for axis in axes:
        axis.set_aspect("equal")
        axis.grid(visible=False)
        axis.set_xlabel("x, direction of rolling [mm]")
    axes[0].set_ylabel("y, to the right [mm]")
    axes[0].invert_yaxis()  # as seen from above, where x is ahead
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    save(figure, path)


def _extent(patches: list[Fields]) -> tuple[float, float]:
    """Length along x and width along y of all patches together (mm)."""
    return tuple(
        float(np.ptp(np.concatenate([getattr(f, name)[f.inside] for f in patches]))) * MILLI  # type: ignore
        for name in ("x", "y")
    )


def _size(patches: list[Fields]) -> tuple[float, float]:
    length, width = _extent(patches)
    return 10.5, float(np.clip(4.0 * width / length + 1.7, 3.6, 8.5))


def _rectangles(f: Fields) -> list[np.ndarray]:
    """Corners of every cell inside, (4, 2) in mm."""
    x, y, dx, dy = (MILLI * getattr(f, name)[f.inside] for name in ("x", "y", "dx", "dy"))
    corners = [(x + i * dx / 2, y + j * dy / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return list(np.array([np.stack(corner, -1) for corner in corners]).transpose(1, 0, 2))


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


def _tractions(axis: Any, patches: list[Fields], friction: float) -> None:
    """Zones of stick and slip, and an arrow of the traction on the wheel in every so many cells."""
    largest = friction * max(float(f.pressure.max()) for f in patches)
    spacing = max(_extent(patches)) / ARROWS
    for f in patches:
        slips = f.slips[f.inside]
        colours = np.where(slips, SLIP, STICK)
        axis.add_collection(PolyCollection(_rectangles(f), facecolor=colours, edgecolor="face", linewidth=0.2))
        x, y, px, py = _arrows(f, spacing / MILLI)
        arrows = axis.quiver(
            MILLI * x,
            MILLI * y,
            px,
            py,
            angles="xy",
            scale_units="xy",
            scale=largest / (1.35 * spacing),
            width=0.003,
            color="#222222",
        )
    axis.quiverkey(arrows, 0.88, 0.035, largest, f"{MEGA * largest:,.0f} MPa", labelpos="W")
    marks = [plt.Rectangle((0, 0), 1, 1, facecolor=colour) for colour in (STICK, SLIP)]
    share = np.concatenate([f.slips[f.inside] for f in patches])
    weight = np.concatenate([(f.dx * f.dy)[f.inside] for f in patches])
    slip = float(weight[share].sum() / weight.sum())
    labels = [f"stick, {100 * (1 - slip):.0f} % of the area", f"slip, {100 * slip:.0f} %"]
    axis.figure.legend(marks, labels, loc="outside lower right", ncols=2)
    axis.set_title("traction on the wheel")


def _arrows(f: Fields, spacing: float) -> tuple[np.ndarray, ...]:
    """Position and traction at points of an even net: in every so many rows of cells, and linear along each."""
    found = []
    lines = f.y[:, 0]
    step = max(1, round(spacing / float(f.dy[0, 0])))
    for row in range(len(lines) // 2 % step, len(lines), step):
        inside = np.flatnonzero(f.inside[row])
        inside = inside[np.argsort(f.x[row, inside])]
        if inside.size:
            x = f.x[row, inside]
            at = np.arange(np.ceil(x[0] / spacing), np.floor(x[-1] / spacing) + 1) * spacing
            values = (np.interp(at, x, getattr(f, name)[row, inside]) for name in ("px", "py"))
            found.append(np.array([at, np.full_like(at, lines[row]), *values]))
    return tuple(np.concatenate(found, axis=1))


LABELS = {"xi_x": "longitudinal creepage [%]", "xi_y": "lateral creepage [%]", "spin": "spin [1/m]"}
COLOURS = {"fx": "#0072b2", "fy": "#d55e00", "mz": "#009e73"}


def sweep_figure(
    sweep: Sweep,
    body: Contact,
    found: list[tuple[Rolled, Error]],
    checks: list[tuple[float, Rolled]],
    title: str,
    path: Path,
) -> None:
    """Forces and moment against a creepage, with the band of their error, and points of the exact theory."""
    figure, axes = plt.subplots(1, 2, figsize=(11.0, 4.8))
    scale = 1.0 if sweep.of == "spin" else 100.0
    values, limit = scale * sweep.values(), body.friction * body.pressing.load
    at = [scale * value for value, _ in checks]
    error = np.array([one.total for _, one in found])
    for name, text in (("fx", "$F_x$"), ("fy", "$F_y$")):
        force = np.array([getattr(one, name) for one, _ in found])
        low, high = np.clip(force - error, -limit, limit), np.clip(force + error, -limit, limit)
        axes[0].fill_between(values, 1e-3 * low, 1e-3 * high, color=COLOURS[name], alpha=0.18, linewidth=0)
        axes[0].plot(values, 1e-3 * force, color=COLOURS[name], linewidth=1.6, label=text)
        axes[0].plot(
            at,
            [1e-3 * getattr(one, name) for _, one in checks],
            "o",
            color=COLOURS[name],
            markerfacecolor="white",
            markersize=5,
        )
    moment, off = np.array([[one.mz, error.moment] for one, error in found]).T
    axes[1].fill_between(values, moment - off, moment + off, color=COLOURS["mz"], alpha=0.18, linewidth=0)
    axes[1].plot(values, moment, color=COLOURS["mz"], linewidth=1.6)
    axes[1].plot(at, [one.mz for _, one in checks], "o", color=COLOURS["mz"], markerfacecolor="white", markersize=5)
    for sign in (-1, 1):
        axes[0].axhline(sign * 1e-3 * limit, color="black", linewidth=0.7, linestyle=":")
    axes[0].set_title(r"tangential force on the wheel; dotted: $\pm\mu N$")
    axes[0].set_ylabel("force [kN]")
    axes[1].set_title("moment on the wheel about the normal")
    axes[1].set_ylabel("$M_z$ [N m]")
    for axis in axes:
        axis.set_xlabel(LABELS[sweep.of])
        axis.set_xscale("log" if sweep.spacing == "logarithmic" and sweep.start > 0 else "linear")
    _legend(axes[0], bool(checks))
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    save(figure, path)


def _legend(axis: Any, checked: bool) -> None:
    axis.fill_between([], [], color="#888888", alpha=0.3, linewidth=0, label="error of cells and theory")
    if checked:
        axis.plot([], [], "o", color="#444444", markerfacecolor="white", markersize=5, label="exact theory")
    axis.figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=4)


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


def price_figure(points: list[Point], title: str) -> Figure:
    """Error of every theory over its time and over its cells, both logarithmic; thin lines: 95 of 100 contacts."""
    figure, axes = plt.subplots(1, 2, figsize=(11.5, 5.2), sharey=True)
    for name, (colour, marker) in STYLES.items():
        own = [one for one in points if one.name == name]
        error, most = (
            [100 * value for value in values] for values in ([one.mean for one in own], [one.most for one in own])
        )
        for axis, along in zip(axes, ([one.seconds for one in own], [one.cells**2 for one in own]), strict=True):
            label = name if error[0] < TOP else f"{name}: {error[0]:.0f} %"
            axis.plot(along, error, color=colour, marker=marker, linewidth=1.4, markersize=5.5, label=label)
            axis.plot(along, most, color=colour, marker=marker, linewidth=0.6, markersize=3, alpha=0.6)
    for axis, label in zip(axes, ("time of one evaluation from Python [s]", "cells in the contact area"), strict=True):
        axis.set(xscale="log", yscale="log", xlabel=label)
        for target in TARGETS:
            axis.axhline(100 * target, color="black", linewidth=0.5, linestyle=":")
    axes[0].set_ylim(0.1, TOP)
    axes[1].set_xlim(left=30.0)
    axes[0].set_yticks([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50], ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50"])
    axes[0].minorticks_off()
    axes[0].set_ylabel(r"error of the tangential force [% of $\mu N$]")
    axes[0].set_title("thick: mean of all contacts; thin: 95 of 100 are better")
    axes[1].set_title("dotted: 5, 2, 1 and 0.5 %")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    return figure
