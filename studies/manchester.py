"""Contacts of a wheelset with its rails at prescribed lateral displacements: positions and forces at both wheels."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.result import Result
from models.core.tables import write_table
from models.machine.seconds import seconds_text
from models.rail.contact_table import WheelsetPlacement
from models.systems.wheel_rail import run as system
from models.systems.wheel_rail.plan import case_text
from models.systems.wheel_rail.run import (
    PATCH_QUANTITIES,
    POSITION_UNITS,
    WHEEL_NAMES,
    patches_by_force,
    position_quantities,
)
from models.systems.wheel_rail.scene import WheelRailScene

SYSTEM = "wheel-rail"
ReportProgress = Callable[[str, float], None]
FLANGE_ANGLE = 0.8
"""Contact angle (rad) above which a patch counts as flange contact."""
PANEL_TITLES = {
    "on_rail": "on the rail,\nfrom its top [mm]",
    "on_wheel": "on the wheel [mm]",
    "angle": "contact angle [deg]",
    "normal": "normal force [kN]",
    "peak": "largest pressure [MPa]",
}
"""Labels of the drawn quantities, one for each row of panels."""
PRINTED_COLUMNS = {
    "on_rail": "8.2f",
    "on_wheel": "8.2f",
    "angle": "7.2f",
    "normal": "8.3f",
    "peak": "7.0f",
    "area": "7.1f",
    "half_length": "6.2f",
    "half_width": "6.2f",
    "fx": "7.3f",
    "fy": "7.3f",
}
"""Formats of the printed quantities of a patch."""
TABLE_NOTES = [
    "  centre of pressure: on the rail from its highest point, on the wheel from the taping line, outwards (mm);",
    "  angle of the rail there (deg, down towards the middle); N: normal; Fx, Fy: on the wheel, out (kN); peak (MPa);",
    "  area (mm^2); a, b: half its length and width (mm); dr: rolling radius, right less left (mm)",
]


def run(
    scene: WheelRailScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute every case at every displacement; saves each as netCDF and as CSV tables of positions and patches, and a
    figure; returns the summary."""
    results, failed, table = dict[str, Result](), dict[str, str](), list[str]()
    for k, (name, case) in enumerate(scene.cases.items()):
        result = results[name] = system.run(
            scene, case=name, progress=partial(_report_progress, report_progress, scene, k), error=scene.error
        )
        contacts = result.detail
        failed |= {f"{name}, {shift:g} mm": why for shift, why in contacts.failures.items()}
        text = f"{case_text(case.yaw, case.friction)}; {seconds_text(contacts.seconds)} a position"
        table += [f"  {name}: {text}", *_table_lines(contacts.placements)]
        if contacts.placements:
            _save_tables(name, result, output_folder)
    if drawn := {name: result for name, result in results.items() if result.detail.placements}:
        _figure(scene, drawn, output_folder / "manchester.png")
    answer = {
        name: [position_quantities(placed) for placed in result.detail.placements] for name, result in results.items()
    }
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": failed,
        "answer": answer,
        "results": results,
        "table": [*table, *TABLE_NOTES],
    }


def _report_progress(
    report_progress: ReportProgress,
    scene: WheelRailScene,
    case_number: int,
    lateral_shift: float,
    finished_share: float,
) -> None:
    report_progress(
        f"{[*scene.cases][case_number]} at {lateral_shift:g} mm", (case_number + finished_share) / len(scene.cases)
    )


def _save_tables(case_name: str, case_result: Result, output_folder: Path) -> None:
    """Save the result of a case: netCDF, a CSV table with a row for each position, and one with a row for each patch
    for each wheel."""
    case_result.save(output_folder / f"{case_name}.nc")
    case_result.save_table(output_folder / f"{case_name}.csv", *POSITION_UNITS)
    units = {"shift": "mm", "patch": "-", **{key: unit for key, (unit, _, _) in PATCH_QUANTITIES.items()}}
    positions = [position_quantities(placed) for placed in case_result.detail.placements]
    for wheel in WHEEL_NAMES:
        rows = [
            {"shift": position["shift"], "patch": k, **patch}
            for position in positions
            for k, patch in enumerate(position[wheel], 1)
        ]
        columns = {key: (unit, np.array([row[key] for row in rows])) for key, unit in units.items()}
        write_table(output_folder / f"{case_name}_{wheel}.csv", columns)


def _figure(scene: WheelRailScene, results_by_case: dict[str, Result], figure_path: Path) -> None:
    """Save a figure of the contact patches, with a column of panels per wheel; bars in the first row are patch
    widths."""
    from models.drawing.figures import COLUMN_WIDTH, CURVE_COLOURS, add_heading, legend_below, save, subplots

    drawn, axes = subplots(len(PANEL_TITLES), 2, figsize=(COLUMN_WIDTH, 9.6), sharex=True, sharey="row")
    for column, wheel in enumerate(WHEEL_NAMES[::-1]):
        for axis, (quantity, label) in zip(axes[:, column], PANEL_TITLES.items(), strict=True):
            for k, (name, result) in enumerate(results_by_case.items()):
                case, data = scene.cases[name], result.data.sel(wheel=wheel)
                # later cases hollow and beside, so that equal ones show
                shift = np.repeat(data["shift"].values + 0.08 * k, data.sizes["patch"])
                half = data["half_width"] * np.cos(np.radians(data["touch_angle"]))
                axis.errorbar(
                    shift,
                    data[quantity].values.ravel(),
                    yerr=half.values.ravel() if quantity == "on_rail" else None,
                    fmt="os"[k % 2],
                    markersize=4,
                    color=CURVE_COLOURS[k % len(CURVE_COLOURS)],
                    linewidth=1.6,
                    markerfacecolor=CURVE_COLOURS[0] if k == 0 else "white",
                    label=f"{name}: {case_text(case.yaw, case.friction)}",
                )
            if column == 0:
                axis.set_ylabel(label)
        axes[0, column].set_title(f"{wheel.capitalize()} wheel")
        axes[-1, column].set_xlabel("displacement of the wheelset to the right [mm]")
    legend_below(drawn, axes[0, 0], column_count=2)
    title = f"{scene.title}\nEvery patch; bars in the first row are its width"
    add_heading(drawn, title, results_by_case)
    save(drawn, figure_path)


def _table_lines(placements: list[WheelsetPlacement]) -> list[str]:
    """Lines for the screen: a line per contact patch, the positions at which a wheel has several patches, and the first
    flange contact."""
    heads = (
        f"    {'shift':>6} {'wheel':<5}{'rail':>8}{'wheel':>8}{'angle':>7}{'N':>8}{'peak':>7}{'area':>7}{'a':>6}"
        f"{'b':>6}{'Fx':>7}{'Fy':>7}{'dr':>8}"
    )
    wheels_of_positions = [(position, wheel) for position in placements for wheel in WHEEL_NAMES]
    several = [
        f"{1e3 * laid.shift:g} ({wheel})" for laid, wheel in wheels_of_positions if len(getattr(laid, wheel)) > 1
    ]
    flange = [
        laid.shift for laid, wheel in wheels_of_positions if patches_by_force(laid, wheel)[0].angle < -FLANGE_ANGLE
    ]
    lines = [heads, *(line for position in map(position_quantities, placements) for line in _patch_lines(position))]
    if several:
        lines.append(f"    several patches on one wheel at, in mm: {', '.join(several)}")
    if flange:
        lines.append(
            f"    a flange carries its wheel from {1e3 * min(flange, key=abs):g} mm on; beyond, the wheel climbs it"
        )
    return lines


def _patch_lines(position_row: dict[str, Any]) -> Iterator[str]:
    """Yield a line for the screen for each contact patch at a position."""
    for wheel in WHEEL_NAMES:
        for k, patch in enumerate(position_row[wheel]):
            lead = f"{position_row['shift']:6.2f} {wheel:<5}" if k == 0 else " " * 12
            values = "".join(f"{patch[key]:{form}}" for key, form in PRINTED_COLUMNS.items())
            end = f"{position_row['radius_difference']:8.3f}" if k == 0 and wheel == "right" else ""
            yield f"    {lead}{values}{end}"


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("manchester")
