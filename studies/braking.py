"""Braking with an anti-lock system in the loop: runs of all procedures, with the paper's figures of merit and plots."""

from collections.abc import Callable
from pathlib import Path as File
from typing import Any

import numpy as np
from pydantic import Field

from models.brake.figures_of_merit import NOT_CHECKED_REMARK
from models.core.errors import RunFailed
from models.core.result import Result
from models.core.strict import Strict, read
from models.systems.braking.adhesion import NoAdhesion, figures_of_merit
from models.systems.braking.measured_pressures import MeasuredPressures, write_pressures
from models.systems.braking.of_scene import measured_pressures_of, plane_of
from models.systems.braking.procedures import engines_of
from models.systems.braking.run import run as drive
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import StopHistory, wheel_names

SYSTEM = "braking"
ReportProgress = Callable[[str, float], None]


class Options(Strict):
    """Keys of the table [options] of this study."""

    adhesion: bool = Field(True, description="measure adhesion utilisation too, by many short runs")


def run(
    scene: BrakingScene, engines: tuple[str, ...], output_folder: File, report_progress: ReportProgress
) -> dict[str, Any]:
    """Run every procedure in each engine; saves NAME.nc, NAME.png and NAME_pressures.csv of each procedure, also of a
    failed run up to its failure, and returns the summary."""
    from studies.braking_figures import stop_figure

    options = read(Options, scene.options, scene.file, "options")
    failed, table, answer = dict[str, str](), list[str](), dict[str, dict[str, Any]]()
    all_stops = dict[str, Result]()
    engines = engines_of(scene, engines)
    for i, name in enumerate(scene.procedures):
        results = dict[str, Result]()
        for j, engine in enumerate(engines):
            report_progress(f"{name}, {engine}", (i * len(engines) + j) / (len(scene.procedures) * len(engines)))
            try:
                result: Result | None = drive(scene, engine, procedure=name, error=scene.error)
            except RunFailed as error:
                failed[f"{name}, {engine}"], result = str(error), error.partial
            if result is not None and len(result.times) > 2:
                results[engine] = result
                result.save(output_folder / (f"{name}.nc" if len(engines) == 1 else f"{name}_{engine}.nc"))
        if not results:
            if not any(run_name.startswith(f"{name}, ") for run_name in failed):
                table.append(f"  {name}: stands within two samples of {scene.run.sample:g} s: it has no figures")
            continue
        all_stops |= {name if len(engines) == 1 else f"{name}, {engine}": stop for engine, stop in results.items()}
        stop = StopHistory(next(iter(results.values())).detail)
        radius = plane_of(scene).radius
        measured, rims = measured_pressures_of(scene, name, radius.size), stop.path.turning * radius
        write_pressures(output_folder / f"{name}_pressures.csv", stop.times, stop.path.pressures, rims)
        stop_figure(scene, name, results, output_folder / f"{name}.png", measured)
        figures, remarks = dict[str, float](), list[str]()
        try:
            figures = figures_of_merit(scene, name, stop) if options.adhesion else {}
        except NoAdhesion as error:
            remarks = [f"    {error}"]
        except RunFailed as error:
            failed[f"{name}, figures of merit"] = str(error)
        train = stop.hitch_results()
        remarks += [f"    {key:<40}{value:>10.2f}" for key, value in train.items()]
        wheels = stop.wheel_results() | rim_speed_differences(measured, stop, rims)
        answer[name] = {
            **stop.vehicle_results(),
            **{key: value.tolist() for key, value in wheels.items()},
            **figures,
            **train,
        }
        table += (
            figures_of_merit_lines(name, stop, figures, wheels)
            + remarks
            + measurement_end_line(measured, stop)
            + comparison_lines(results)
        )
    summary = {"failed": failed, "results": all_stops, "answer": answer, "table": table}
    return {"scene": scene.title, "folder": str(output_folder), **summary}


def rim_speed_differences(
    measured_pressures: MeasuredPressures | None, stop: StopHistory, computed_rim_speeds: np.ndarray
) -> dict[str, np.ndarray]:
    """Rms differences (m/s) between the computed and the measured rim speed of each wheel; empty if none were measured.
    computed_rim_speeds (n, W) : computed, in m/s, of the W wheels."""
    if measured_pressures is None or measured_pressures.speeds is None:
        return {}
    return {"rim less measured, rms [m/s]": measured_pressures.wheel_speed_error(stop.times, computed_rim_speeds)}


def measurement_end_line(measured_pressures: MeasuredPressures | None, stop: StopHistory) -> list[str]:
    """Line for the screen, in a list, that warns if the run lasts longer than its file of measured pressures; else an
    empty list."""
    if measured_pressures is None or measured_pressures.times[-1] > stop.times[-2]:
        return []
    return [f"    measured pressures end at {measured_pressures.times[-1]:.3f} s: from then on the last ones stay"]


def comparison_lines(results_by_engine: dict[str, Result]) -> list[str]:
    """Lines for the screen, one per engine: position and yaw at which the vehicle stopped, stopping time, and computing
    time."""
    rows = []
    for engine, result in results_by_engine.items():
        path = result.detail
        x, y, yaw = path.states[-1, 0, :3]
        clock = f"; {path.clock}" if path.clock else ""
        rows.append(
            f"    {engine:<12}x {x:8.3f} m, y {y:8.3f} m, yaw {np.degrees(yaw):8.3f} deg after "
            f"{path.times[-1]:.3f} s; {len(path.times) - 1} samples in {result.seconds:.2f} s, once{clock}"
        )
    return rows


def figures_of_merit_lines(
    procedure_name: str, stop: StopHistory, vehicle_figures: dict[str, float], wheel_figures: dict[str, np.ndarray]
) -> list[str]:
    """Lines for the screen on one procedure: a table of figures for the vehicle, and a table with a column per
    wheel."""
    remaining_text = f"still {stop.speed[-1]:.2f} m/s; all figures are those until then"
    unfinished = "" if stop.path.ended_at_rest else f": not stopped by {stop.times[-1]:g} s, {remaining_text}"
    rows = [f"  {procedure_name.replace('_', ' ')}{unfinished}"]
    rows += [f"    {stop.path.clock}"] if stop.path.clock else []
    rows += [f"    {key:<40}{value:>10.2f}" for key, value in stop.vehicle_results().items()]
    rows += [
        f"    {key:<40}{f'{value:.3f}' if np.isfinite(value) else 'not steady':>10}"
        for key, value in vehicle_figures.items()
    ]
    rows += [f"    ({NOT_CHECKED_REMARK})"] if vehicle_figures else []
    rows += (
        ["    (without steering correction, and of the vehicle without trailer)"] if "z_MALS" in vehicle_figures else []
    )
    names = wheel_names(stop.path.turning.shape[1])
    rows += ["    " + f"{'wheel':<40}" + "".join(f"{wheel.replace('trailer ', 'tr. '):>17}" for wheel in names)]
    return rows + [
        f"    {key:<40}" + "".join(f"{value:>17.2f}" for value in values) for key, values in wheel_figures.items()
    ]


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("braking")
