"""What one contact of wheel and rail does: area, pressure, forces and how far they are off, at one creepage or many."""

import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.contact.accuracy import Error, rolled
from models.contact.theories import Contact, ExactOnEllipse, Fastsim, Linear, Motion, OnEllipse, Rolled
from models.core.errors import InputError
from models.core.strict import Strict, read
from models.core.tables import write_table
from models.machine.seconds import cost, duration
from models.systems.contact.of_scene import built_of, contact, creepages, touches
from models.systems.contact.scene import ContactScene, Method

SYSTEM = "contact"
Progress = Callable[[str, float], None]
UNITS = {"fx": "N", "fy": "N", "mz": "N m", "stick": "-", "dissipation": "N"}
"""Of the forces; the power lost is the dissipation times the rolling speed."""
ERRORS = {
    "error_of_cells": ("N", "cells"),
    "error_of_theory": ("N", "theory"),
    "moment_error_of_cells": ("N m", "moment_cells"),
    "moment_error_of_theory": ("N m", "moment_theory"),
}
"""Columns of the errors with their units and names in ``Error``: of the force, and of the moment."""
ROWS = 12
"""Rows of a sweep that are printed, about; the file has all."""


class Options(Strict):
    """[options] of this study."""

    exact: int = Field(9, ge=0, le=100, description="points of a sweep that the exact theory checks, on an ellipse")


def check(scene: ContactScene, engines: tuple[str, ...]) -> None:
    """Refuse a table of cases, which is another study's."""
    if scene.cases is not None:
        allowed = "computes one contact; for a table of cases use contact_table"
        raise InputError(scene.file, "study", scene.study, allowed)


def run(scene: ContactScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Press the bodies, roll them; saves ``forces.csv``, ``fields.csv`` and figures."""
    check(scene, engines)
    motions, cells = creepages(scene), scene.method.cells
    progress("loading", 0.0)
    shown = rolled(contact(scene), motions[-1], cells, fields=True)  # compiles first: no part of the times below
    start = time.perf_counter()
    body = contact(scene)
    pressed = time.perf_counter()
    found, marks = [], [pressed]
    for i, motion in enumerate(motions):
        progress("rolling", i / len(motions))
        found.append(rolled(body, motion, cells))
        marks.append(time.perf_counter())
    times = pressed - start, np.diff(marks)
    found[-1] = shown
    _save(motions, found, folder)
    progress("figures", 0.9)
    _figures(scene, body, motions, found, folder)
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "answer": _answer(body, motions, found),
        "table": _table(scene, body, motions, found, times),
    }


def _save(motions: list[Motion], found: list[tuple[Rolled, Error]], folder: Path) -> None:
    """Forces of every creepage, and the cells of the last one."""
    creepages = zip(("xi_x [-]", "xi_y [-]", "spin [1/m]"), np.array(motions).T, strict=True)
    columns = {name.partition(" ")[0]: (name.partition("[")[2][:-1], values) for name, values in creepages}
    for name, unit in UNITS.items():
        columns[name] = (unit, np.array([getattr(one, name) for one, _ in found]))
    for name, (unit, key) in ERRORS.items():
        columns[name] = (unit, np.array([getattr(error, key) for _, error in found]))
    write_table(folder / "forces.csv", columns)
    fields = found[-1][0].fields
    if fields:
        units = {"x": "m", "y": "m", "dx": "m", "dy": "m", "pressure": "Pa", "px": "Pa", "py": "Pa", "slips": "-"}
        write_table(
            folder / "fields.csv",
            {
                name: (unit, np.concatenate([getattr(f, name)[f.inside] for f in fields]))
                for name, unit in units.items()
            },
        )


def _answer(body: Contact, motions: list[Motion], found: list[tuple[Rolled, Error]]) -> dict[str, Any]:
    """Everything that was computed, as plain numbers in SI."""
    rows = [
        {
            **dict(zip(("xi_x", "xi_y", "spin"), motion, strict=True)),
            **{name: getattr(one, name) for name in UNITS},
            **{name: getattr(error, key) for name, (_, key) in ERRORS.items()},
        }
        for motion, (one, error) in zip(motions, found, strict=True)
    ]
    return {**asdict(body.pressing), "friction": body.friction, "forces": rows, "doubt": _doubt(body, found)}


def _doubt(body: Contact, found: list[tuple[Rolled, Error]]) -> str:
    """What is to be said against the forces: of the linear theory alone, which has no bound of its own."""
    if not isinstance(body, Linear):
        return ""
    with np.errstate(divide="ignore", invalid="ignore"):  # no friction carries nothing
        return doubted(np.array([np.linalg.norm(one.force) for one, _ in found]) / (body.friction * body.pressing.load))


def doubted(used: np.ndarray) -> str:
    """What is said against the linear theory's forces ``used`` (n,) by mu N; "" where friction can carry them all."""
    beyond = used[used > 1.0]
    if not beyond.size:
        return ""
    return (
        f"the linear theory's force is more than friction can carry at {beyond.size} of {used.size} creepages, up "
        f"to {beyond.max():.3g} mu N: it knows no slip"
    )


def _table(
    scene: ContactScene,
    body: Contact,
    motions: list[Motion],
    found: list[tuple[Rolled, Error]],
    times: tuple[float, np.ndarray],
) -> list[str]:
    """Normal contact, then forces with their errors: all of one creepage, or some rows of a sweep.

    times : of pressing, and of rolling at each creepage with its errors (s)
    """
    p, limit = body.pressing, body.friction * body.pressing.load
    size = f"a = {1e3 * body.a:.3f} mm, b = {1e3 * body.b:.3f} mm, " if isinstance(body, OnEllipse) else ""
    lines = [
        f"  normal load {p.load:,.0f} N, approach {1e6 * p.approach:.2f} um, {size}area {1e6 * p.area:.2f} mm^2, "
        f"largest pressure {1e-6 * p.peak:,.0f} MPa",
        *_places(scene),
        f"  pressed in {duration(times[0])} once, rolled in {cost(times[1])} at each creepage, errors included",
        f"  forces on the wheel by {theory(scene.method)}; mu N = {limit:,.0f} N",
        f"    {'xi_x [-]':>10}{'xi_y [-]':>10}{'spin [1/m]':>11}{'Fx [N]':>10}{'Fy [N]':>10}{'Mz [N m]':>10}"
        f"{'stick':>7}{'loss [N]':>10}   errors: of cells, of theory [% of mu N], of Mz [N m]",
    ]
    step = max(1, (len(motions) - 1) // ROWS)
    for motion, (one, error) in list(zip(motions, found, strict=True))[::step]:
        lines.append(
            f"    {motion[0]:>10.3g}{motion[1]:>10.3g}{motion[2]:>11.3g}{round(one.fx):>10,}"
            f"{round(one.fy):>10,}{one.mz:>10.3f}{one.stick:>7.0%}{one.dissipation:>10.3g}"
            f"   {_percent(error.cells, limit):>6}{_percent(error.theory, limit):>8}"
            f"{error.moment:>9.2g}"
        )
    lines.append("  loss: power by the rolling speed; errors are of the force, that of Mz has both together")
    doubt = _doubt(body, found)
    return [*lines, f"  warning: {doubt}"] if doubt else lines


NAMES = {
    "fastsim": "FASTSIM",
    "linear": "the linear theory",
    "simplified": "the theory of 1983",
    "exact": "the exact theory",
}


def theory(method: Method) -> str:
    """Name of the theory, and its cells."""
    return NAMES[method.name] + ("" if method.name == "linear" else f", {method.cells} cells along each axis")


def _percent(error: float, limit: float) -> str:
    return f"{100 * error / limit:.2f}" if limit > 0 else "0"


def _places(scene: ContactScene) -> list[str]:
    """Where profiles touch, a line each."""
    if scene.profiles is None:
        return []
    return [
        f"  touches at {1e3 * touch.rail_y:.2f} mm from the rail's top and {1e3 * touch.wheel_y:.2f} mm from the "
        f"taping line, {touch.angle:.4f} rad steep, gap {round(1e6 * touch.gap, 1) + 0.0:.1f} um"
        for touch in touches(scene, built_of(scene))
    ]


def _figures(
    scene: ContactScene, body: Contact, motions: list[Motion], found: list[tuple[Rolled, Error]], folder: Path
) -> None:
    from studies.contact_figures import contact_figure, sweep_figure

    one, fields = found[-1][0], list(found[-1][0].fields)
    if fields:
        contact_figure(
            fields, body.friction, _caption(scene, motions[-1], one), _pressure(body), folder / "contact.png"
        )
    if scene.sweep is not None:
        title = f"{scene.title}\nForces by {theory(scene.method)}{_kept(scene)}"
        sweep_figure(scene.sweep, body, found, _checks(scene, body), title, folder / "forces.png")


SYMBOLS = {"xi_x": (r"$\xi_x$", ""), "xi_y": (r"$\xi_y$", ""), "spin": ("spin", " 1/m")}


def _kept(scene: ContactScene) -> str:
    """The creepages that are not swept, where they are not zero."""
    assert scene.sweep is not None
    kept = [
        f"{symbol} = {value:.3g}{unit}"
        for (symbol, unit), (name, value) in zip(SYMBOLS.values(), scene.creepage, strict=True)
        if value and name != scene.sweep.of
    ]
    return "".join(f"; {text}" for text in kept)


def _pressure(body: Contact) -> str:
    """Which pressure the cells have."""
    if isinstance(body, Fastsim) and body.choices["bound"] != "elliptic":
        return f"FASTSIM's pressure ({body.choices['bound']} bound)"
    return "pressure"


def _caption(scene: ContactScene, motion: Motion, one: Rolled) -> str:
    return (
        f"{scene.title}\n"
        rf"$\xi_x$ = {motion[0]:.3g}, $\xi_y$ = {motion[1]:.3g}, spin = {motion[2]:.3g} 1/m: "
        f"$F_x$ = {1e-3 * one.fx:.2f} kN, $F_y$ = {1e-3 * one.fy:.2f} kN, $M_z$ = {one.mz:.1f} N m "
        f"by {NAMES[scene.method.name]}"
    )


CHECKED = 40
"""Cells along each axis of the exact theory where it checks a sweep."""


def _checks(scene: ContactScene, body: Contact) -> list[tuple[float, Rolled]]:
    """The exact theory at a few values of a sweep on an ellipse."""
    points = read(Options, scene.options, scene.file, "options").exact
    if scene.sweep is None or not isinstance(body, OnEllipse) or isinstance(body, ExactOnEllipse) or not points:
        return []
    if built_of(scene).falling is not None:  # the exact theory here has constant friction
        return []
    exact = ExactOnEllipse(body.hertz, body.friction, body.pair)
    values, motions = scene.sweep.values(), creepages(scene)
    chosen = np.unique(np.linspace(0, len(values) - 1, points).round().astype(int))
    return [(float(values[i]), exact.roll(motions[i], CHECKED)) for i in chosen]


if __name__ == "__main__":
    from studies.command_line import study

    study("contact_ellipse")
