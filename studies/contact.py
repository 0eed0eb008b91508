"""A contact of wheel and rail: area, pressure, and creep forces with their errors, at one creepage or many."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.contact.accuracy import ContactErrors
from models.contact.theories import ExactTheoryOnEllipse, FastsimTheory, RollingContact, RollingOnEllipse
from models.core.errors import InputError
from models.core.result import Result
from models.core.strict import Strict, read
from models.machine.seconds import duration_text, seconds_text
from models.systems import run as run_scene
from models.systems.contact.run import ContactResults, fields_by_cell, inputs_of_scene_contact, touching_points
from models.systems.contact.scene import ContactMethod, ContactScene

SYSTEM = "contact"
ReportProgress = Callable[[str, float], None]
PRINTED_ROW_LIMIT = 12
"""Approximate number of rows of a sweep that are printed; the saved file has all."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    exact: int = Field(9, ge=0, le=100, description="points of a sweep that the exact theory checks, on an ellipse")


def check(scene: ContactScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for a scene with a table of cases, which the study ``contact_table`` computes."""
    if scene.cases is not None:
        allowed = "computes one contact; for a table of cases use contact_table"
        raise InputError(scene.file, "study", scene.study, allowed)


def run(
    scene: ContactScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute the normal contact and the creep forces; saves forces and fields as CSV and netCDF, and figures; returns
    the summary."""
    check(scene, engines)
    forces = run_scene(scene, error=scene.error, fields=True, progress=report_progress)
    rolls: ContactResults = forces.detail
    for name, saved in (("forces", forces), ("fields", fields_by_cell(scene, rolls))):
        if saved is not None:
            saved.save(output_folder / f"{name}.nc")
            saved.save_table(output_folder / f"{name}.csv")
    report_progress("figures", 0.9)
    _draw_figures(scene, forces, output_folder)
    body, doubts = rolls.contact, json.loads(forces.data.attrs["doubts"])
    rows = forces.data.to_dataframe().to_dict("records")
    answer = asdict(body.pressing) | {"friction": body.friction, "forces": rows, "doubt": "".join(doubts)}
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "answer": answer,
        "results": {"forces": forces},
        "table": _table_lines(scene, forces),
    }


def _table_lines(scene: ContactScene, creep_forces: Result) -> list[str]:
    """Lines for the screen: the normal contact, then creep forces with errors, at all creepages or at some of a
    sweep."""
    rolls: ContactResults = creep_forces.detail
    body, p = rolls.contact, rolls.contact.pressing
    limit = body.friction * p.load
    size = f"a = {1e3 * body.a:.3f} mm, b = {1e3 * body.b:.3f} mm, " if isinstance(body, RollingOnEllipse) else ""
    lines = [
        f"  normal load {p.load:,.0f} N, approach {1e6 * p.approach:.2f} um, {size}area {1e6 * p.area:.2f} mm^2, "
        f"largest pressure {1e-6 * p.peak:,.0f} MPa",
        *_contact_point_lines(scene),
        f"  pressed in {duration_text(rolls.pressing_seconds)} once, "
        f"rolled in {seconds_text(rolls.rolling_seconds)} at each creepage" + ", errors included" * bool(rolls.errors),
        f"  forces on the wheel by {theory_text(scene.method)}; mu N = {limit:,.0f} N",
        f"    {'xi_x [-]':>10}{'xi_y [-]':>10}{'spin [1/m]':>11}{'Fx [N]':>10}{'Fy [N]':>10}{'Mz [N m]':>10}"
        f"{'stick':>7}{'loss [N]':>10}"
        + "   errors: of cells, of theory [% of mu N], of Mz [N m]"
        * bool(rolls.errors),
    ]
    step = max(1, (len(rolls.motions) - 1) // PRINTED_ROW_LIMIT)
    errors: Sequence[ContactErrors | None] = rolls.errors or [None] * len(rolls.motions)
    for motion, force, error in list(zip(rolls.motions, rolls.rolled, errors, strict=True))[::step]:
        lines.append(
            f"    {motion[0]:>10.3g}{motion[1]:>10.3g}{motion[2]:>11.3g}{round(force.fx):>10,}"
            f"{round(force.fy):>10,}{force.mz:>10.3f}{force.stick:>7.0%}{force.dissipation:>10.3g}"
            + ("" if error is None else _force_errors_text(error, limit))
        )
    loss = "  loss: power by the rolling speed"
    return [*lines, loss + "; errors are of the force, that of Mz has both together" * bool(rolls.errors)]


def _force_errors_text(force_error: ContactErrors, friction_limit_force: float) -> str:
    cells, theory = (
        _percent_text(error_part, friction_limit_force) for error_part in (force_error.cells, force_error.theory)
    )
    return f"   {cells:>6}{theory:>8}{force_error.moment:>9.2g}"


THEORY_NAMES = {
    "fastsim": "FASTSIM",
    "linear": "the linear theory",
    "simplified": "the theory of 1983",
    "exact": "the exact theory",
}


def theory_text(contact_theory: ContactMethod) -> str:
    """Name of a contact theory, with its number of cells along each axis if it has cells."""
    return THEORY_NAMES[contact_theory.name] + (
        "" if contact_theory.name == "linear" else f", {contact_theory.cells} cells along each axis"
    )


def _percent_text(force_error: float, friction_limit_force: float) -> str:
    return f"{100 * force_error / friction_limit_force:.2f}" if friction_limit_force > 0 else "0"


def _contact_point_lines(scene: ContactScene) -> list[str]:
    """Lines for the screen, one for each point at which the profiles of wheel and rail touch."""
    if scene.profiles is None:
        return []
    return [
        f"  touches at {1e3 * touch.rail_y:.2f} mm from the rail's top and {1e3 * touch.wheel_y:.2f} mm from the "
        f"taping line, {touch.angle:.4f} rad steep, gap {round(1e6 * touch.gap, 1) + 0.0:.1f} um"
        for touch in touching_points(scene, inputs_of_scene_contact(scene))
    ]


def _draw_figures(scene: ContactScene, creep_forces: Result, output_folder: Path) -> None:
    from studies.contact_figures import contact_figure, creepage_sweep_figure

    rolls: ContactResults = creep_forces.detail
    motion, last_rolled, sweep = rolls.motions[-1], rolls.rolled[-1], scene.sweep
    if last_rolled.fields:
        title = (
            f"{scene.title}\n"
            f"ξx = {motion[0]:.3g}, ξy = {motion[1]:.3g}, spin = {motion[2]:.3g} 1/m\n"
            f"Fx = {1e-3 * last_rolled.fx:.2f} kN, Fy = {1e-3 * last_rolled.fy:.2f} kN, Mz = {last_rolled.mz:.1f} N m "
            f"by {THEORY_NAMES[scene.method.name]}"
        )
        friction = rolls.contact.friction
        contact_figure(
            list(last_rolled.fields),
            friction,
            title,
            _pressure_name(rolls.contact),
            creep_forces,
            output_folder / "contact.png",
        )
    if sweep is not None:
        note_on_others = "".join(
            f"; {symbol} = {value:.3g}{unit}"
            for (symbol, unit), (name, value) in zip(CREEPAGE_SYMBOLS, scene.creepage, strict=True)
            if value and name != sweep.of
        )
        title = f"{scene.title}\nForces by {theory_text(scene.method)}{note_on_others}"
        creepage_sweep_figure(
            sweep, creep_forces, _exact_theory_results(scene, rolls), title, output_folder / "forces.png"
        )


CREEPAGE_SYMBOLS = (("ξx", ""), ("ξy", ""), ("spin", " 1/m"))


def _pressure_name(rolling_contact: RollingContact) -> str:
    """Name of the pressure distribution over a contact's cells, for a figure's title."""
    if isinstance(rolling_contact, FastsimTheory) and rolling_contact.choices["bound"] != "elliptic":
        return f"FASTSIM's pressure ({rolling_contact.choices['bound']} bound)"
    return "pressure"


EXACT_THEORY_CELLS = 40
"""Number of cells along each axis of the exact theory that checks a sweep."""


def _exact_theory_results(scene: ContactScene, contact_results: ContactResults) -> dict[int, Any]:
    """Results of the exact theory at a few creepages of a sweep, by the number of the creepage. Empty if the contact is
    no Hertzian ellipse, is exact already, or has falling friction."""
    body, points = contact_results.contact, read(Options, scene.options, scene.file, "options").exact
    if (
        not isinstance(body, RollingOnEllipse)
        or isinstance(body, ExactTheoryOnEllipse)
        or inputs_of_scene_contact(scene).falling is not None
    ):
        return {}
    exact = ExactTheoryOnEllipse(body.hertz, body.friction, body.pair)
    chosen = np.unique(np.linspace(0, len(contact_results.motions) - 1, points).round().astype(int))
    return {int(i): exact.roll(contact_results.motions[i], EXACT_THEORY_CELLS) for i in chosen}


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("contact_ellipse")
