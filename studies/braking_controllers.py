"""Anti-lock controllers compared on several surfaces in all procedures, by stopping distance and course of the
vehicle."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import RunFailed
from models.core.result import Channel, Result, result
from models.core.strict import Strict, read
from models.core.told import Results, joined_result
from models.core.whole_files import write_whole
from models.systems.braking.plan import check as check_scene
from models.systems.braking.plan import check_reference
from models.systems.braking.run import run as drive
from models.systems.braking.scene import BrakingRoadTable, BrakingScene, ControllerTable, RoadStretch
from models.systems.braking.stop_report import StopHistory

SYSTEM = "braking"
ReportProgress = Callable[[str, float], None]
SHOWN_QUANTITIES = {
    "distance [m]": "stopping distance [m]",
    "v0^2/2d [m/s^2]": "v0^2/2d [m/s^2]",
    "y [m]": "y [m]",
    "yaw [deg]": "final yaw [deg]",
    "side slip [deg]": "largest side slip [deg]",
}
LOCKED_COLUMN = "locked [s]"


ESTIMATED_SPEED_NOTE = (
    "  true_speed = false: the speed is estimated from the wheels, which tell the vehicle's only when they "
    "come back to it; slip_pi holds them at a slip, and may lock them for seconds on ice"
)


class Options(Strict):
    """Keys of the table [options] of this study."""

    surfaces: dict[str, str] = Field(
        {"ice": "snow", "snow": "dry", "dry": "snow"},
        min_length=1,
        description="and what lies right of each in split procedures",
    )
    controllers: dict[str, ControllerTable] = Field(
        {kind: ControllerTable(kind=kind) for kind in ("slip_bang_bang", "acceleration_phases", "slip_pi")},
        min_length=1,
        description="tables as [controller], by their names",
    )


LABEL_COLUMNS = ("surface", "procedure", "controller")
"""Columns that identify a run."""


def scene_of_each_run(scene: BrakingScene) -> dict[tuple[str, str, str], BrakingScene]:
    """The scene of every run, by surface, procedure and label of the controller; if the scene has a trailer, without
    and with it."""
    options = read(Options, scene.options, scene.file, "options")
    trains = [scene] if scene.trailer is None else [scene.model_copy(update={"trailer": None}), scene]
    return {
        (surface, name, controller + " + trailer" * (train.trailer is not None)): _single_procedure_scene(
            train, surface, right, name, table
        )
        for surface, right in options.surfaces.items()
        for name in scene.procedures
        for train in trains
        for controller, table in options.controllers.items()
    }


def _single_procedure_scene(
    scene: BrakingScene, surface: str, right_surface: str, procedure_name: str, controller: ControllerTable
) -> BrakingScene:
    """The scene reduced to one procedure on one surface with one controller; right_surface : of the right track in
    split procedures."""
    procedure = scene.procedures[procedure_name]
    if procedure.kind == "split":
        procedure = procedure.model_copy(update={"right": right_surface})
    return scene.model_copy(
        update={
            "road": BrakingRoadTable(stretches=[RoadStretch(left=surface)]),
            "controller": controller,
            "procedures": {procedure_name: procedure},
        }
    )


def check(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for impossible options of a controller or a surface."""
    check_reference(scene, engines)
    for single_scene in scene_of_each_run(scene).values():
        check_scene(single_scene, ("reference",))


def run(
    scene: BrakingScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Run all combinations of surface, procedure and controller; saves ``controllers.nc``, ``controllers.csv`` and
    ``controllers.png``, and returns the summary."""
    scenes, answer, failed, estimated = scene_of_each_run(scene), list[dict[str, Any]](), dict[str, str](), False
    results = dict[str, Result]()
    for i, (labels, single_scene) in enumerate(scenes.items()):
        name = ", ".join(labels)
        report_progress(name, i / len(scenes))
        try:
            results[name] = drive(single_scene, error=scene.error)
            stop = StopHistory(results[name].detail)
        except RunFailed as error:
            failed[name] = str(error)
            continue
        if not stop.path.ended_at_rest:
            failed[name] = f"not stopped by {stop.times[-1]:g} s"
            continue
        values, estimated = stop.vehicle_results(), estimated or not single_scene.controller.true_speed
        shown = {head: values[quantity] for head, quantity in SHOWN_QUANTITIES.items()}
        answer.append(
            dict(zip(LABEL_COLUMNS, labels, strict=True)) | shown | {LOCKED_COLUMN: float(stop.lock_times().time.max())}
        )
    _save_stops(scene, answer, output_folder, results)
    _figure(scene, answer, output_folder / "controllers.png", results)
    summary = {
        "results": results,
        "answer": answer,
        "table": stop_table_lines(answer) + [ESTIMATED_SPEED_NOTE] * estimated,
    }
    return {"scene": scene.title, "folder": str(output_folder), "failed": failed, **summary}


def stop_table_lines(stop_rows: list[dict[str, Any]]) -> list[str]:
    """Lines for the screen: a table of the stops with a line per run."""
    heads = [*SHOWN_QUANTITIES, LOCKED_COLUMN]
    lines = [f"  {'surface':<10}{'procedure':<12}{'controller':<32}" + "".join(f"{head:>17}" for head in heads)]
    for stop in stop_rows:
        labels = f"  {stop['surface']:<10}{stop['procedure'].replace('_', ' '):<12}{stop['controller']:<32}"
        lines.append(labels + "".join(f"{stop[head]:>17.2f}" for head in heads))
    return [*lines, "  locked: longest of the wheels, above 15 km/h"]


def _save_stops(
    scene: BrakingScene, stop_rows: list[dict[str, Any]], output_folder: Path, stop_results: Results
) -> None:
    """Save the stops: a CSV line for each, and a netCDF result with an axis of stops, which also holds the assumptions
    that any stop broke."""
    heads = [*SHOWN_QUANTITIES, LOCKED_COLUMN] if stop_rows else []
    texts = {name: Channel("stop", [stop[name] for stop in stop_rows]) for name in LABEL_COLUMNS}
    columns = {head: np.array([stop[head] for stop in stop_rows]) for head in heads}
    channels = {
        head.partition(" [")[0].replace("/", " by "): Channel("stop", column, head.partition(" [")[2][:-1])
        for head, column in columns.items()
    }
    stops_result = result(scene, channels, texts, engine="reference")
    (joined_result(stops_result, stop_results) if stop_results else stops_result).save(output_folder / "controllers.nc")
    rows = [(*(stop[name] for name in LABEL_COLUMNS), *(f"{stop[head]:.17g}" for head in heads)) for stop in stop_rows]
    write_whole(
        output_folder / "controllers.csv", "".join(",".join(row) + "\n" for row in [(*LABEL_COLUMNS, *heads), *rows])
    )


PANEL_TITLES = {"v0^2/2d [m/s^2]": "equivalent deceleration [m/s²]", "yaw [deg]": "final yaw angle [deg]"}


def _figure(scene: BrakingScene, stop_rows: list[dict[str, Any]], figure_path: Path, shown_results: Results) -> None:
    """Save a bar chart of the stops by procedure, with a column of panels per surface and a colour per controller."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, legend_below, save, subplots
    from studies.braking_figures import readable_name

    options = read(Options, scene.options, scene.file, "options")
    surfaces, _, kinds = (list(dict.fromkeys(stop[name] for stop in stop_rows)) for name in LABEL_COLUMNS)
    names, controllers_per_group = list(scene.procedures), len(options.controllers)
    figure, axes = subplots(
        len(PANEL_TITLES), max(len(surfaces), 1), figsize=(COLUMN_WIDTH, 6.0), squeeze=False, sharey="row"
    )
    width = 0.8 / max(len(kinds), 1)
    for column, surface in enumerate(surfaces):
        for row, (key, quantity) in enumerate(PANEL_TITLES.items()):
            axis = axes[row, column]
            for k, kind in enumerate(kinds):
                bars = {
                    stop["procedure"]: stop[key]
                    for stop in stop_rows
                    if (stop["surface"], stop["controller"]) == (surface, kind)
                }
                heights = [bars.get(name, np.nan) for name in names]
                axis.bar(
                    np.arange(len(names)) + (k - (len(kinds) - 1) / 2) * width,
                    heights,
                    width * 0.95,
                    label=" + ".join(map(readable_name, kind.split(" + "))),
                    color=f"C{k % controllers_per_group}",
                    alpha=1.0 if k < controllers_per_group else 0.5,
                )
            axis.set_xticks(range(len(names)), [readable_name(name).replace(" ", "\n") for name in names])
            axis.set(
                title=f"{surface.capitalize()}; split: {options.surfaces[surface]} right" if row == 0 else "",
                ylabel=quantity if column == 0 else "",
            )
    if stop_rows:
        legend_below(figure, axes[0, 0], column_count=max(len(kinds) // controllers_per_group, 1))
    add_heading(figure, scene.title, shown_results)
    save(figure, figure_path)


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("braking_controllers")
