"""Friction of a tyre on the surfaces of a braking scene: longitudinal and lateral, over slip, slip angle and load."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.assumptions import with_assumptions
from models.core.discretisation import not_estimated
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.strict import Strict, read
from models.core.tables import write_table
from models.systems.braking.of_scene import tyre_tables_of
from models.systems.braking.plan import check_reference
from models.systems.braking.scene import BrakingScene
from models.tyre.assumptions import tyre_table_assumptions
from models.tyre.tyre_table import TyreTable

SYSTEM = "braking"
ReportProgress = Callable[[str, float], None]


class Options(Strict):
    """Keys of the table [options] of this study."""

    slip_angles: list[float] = Field([0.0, 2.0, 4.0, 8.0, 16.0], min_length=1, description="slip angles in deg")
    load: float = Field(15e3, gt=0, le=1e6, description="load of the figure in N")


def check(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for impossible slip angles and tyres."""
    check_reference(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    if not all(0.0 <= angle <= 90.0 for angle in options.slip_angles):
        raise InputError(scene.file, "options.slip_angles", options.slip_angles, "must be from 0 to 90 deg")
    tyre_tables_of(scene)


def run(
    scene: BrakingScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Tabulate every tyre of the scene; saves ``tyre.png``, and for each tyre a netCDF and a CSV file that can be read
    as a tyre again; returns the summary."""
    from studies.tyre_figure import tyre_figure

    options = read(Options, scene.options, scene.file, "options")
    tables = tyre_tables_of(scene)
    answer = {name: table.characteristic_values(options.load) for name, table in tables.items()}
    results = {
        name: save_tyre_friction(
            scene, table, options, output_folder / f"{name.replace('/', '_').replace(' ', '_')}.csv"
        )
        for name, table in tables.items()
    }
    tyre_figure(tables, (options.slip_angles, options.load), scene.title, output_folder / "tyre.png", results)
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "answer": answer,
        "results": results,
        "table": friction_lines(answer, options.load),
    }


def friction_lines(figures_by_tyre: dict[str, dict[str, float]], wheel_load: float) -> list[str]:
    """Lines for the screen: a table of the friction figures under a load (N), with a column per tyre."""
    width = max(12, *(len(name) + 2 for name in figures_by_tyre))
    rows = [
        f"  {'mu under ' + format(wheel_load / 1e3, '.4g') + ' kN':<22}"
        + "".join(f"{name:>{width}}" for name in figures_by_tyre)
    ]
    keys = next(iter(figures_by_tyre.values()))
    return rows + [
        f"  {key:<22}" + "".join(f"{figures[key]:>{width}.4g}" for figures in figures_by_tyre.values()) for key in keys
    ]


def save_tyre_friction(scene: BrakingScene, tyre_table: TyreTable, study_options: Options, output_path: Path) -> Result:
    """Save a tyre's friction at zero and the options' slip angles, at all slips of its table, as netCDF and CSV;
    returns the result."""
    angles, axes = np.unique([0.0, *study_options.slip_angles]), ("slip_angle", "slip")
    x, y = tyre_table.friction(np.deg2rad(angles), tyre_table.slips, study_options.load)
    channels = {"mu_x": Channel(axes, x, "-", "along the wheel"), "mu_y": Channel(axes, y, "-", "across it")}
    nodes = {"slip_angle": Channel("slip_angle", angles, "deg"), "slip": Channel("slip", tyre_table.slips, "-")}
    read_off = result(scene, channels, nodes, load=study_options.load)
    with_assumptions(read_off, tyre_table_assumptions(tyre_table, study_options.load))
    not_estimated(read_off, "a table has no steps: it is read at its nodes, and linear between").save(
        output_path.with_suffix(".nc")
    )
    angle, slip = (axis.ravel() for axis in np.meshgrid(angles, tyre_table.slips, indexing="ij"))
    write_table(
        output_path,
        {"slip angle": ("deg", angle), "slip": ("-", slip), "mu_x": ("-", x.ravel()), "mu_y": ("-", y.ravel())},
    )
    return read_off


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("tyre")
