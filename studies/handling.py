"""A car on four rolling tyres: manoeuvres in both engines, with path, slip angles, wheel loads and used friction."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.result import Result, join_results
from models.systems.handling.run import run as run_scene
from models.systems.handling.scene import HandlingScene

SYSTEM = "handling"
ReportProgress = Callable[[str, float], None]
DIFFERENCE_TITLE = "largest difference of the engines"


def run(
    scene: HandlingScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Run every manoeuvre in every engine; saves NAME.nc with all engines' runs and NAME.png for each manoeuvre, and
    returns the summary."""
    from studies.handling_figures import manoeuvre_figure

    failed, lines, answer, results = dict[str, str](), list[str](), dict[str, Any](), dict[str, Result]()
    for i, name in enumerate(scene.manoeuvres):
        runs = dict[str, Result]()
        for j, engine in enumerate(engines):
            report_progress(f"{name}, {engine}", (i + j / len(engines)) / len(scene.manoeuvres))
            try:
                runs[engine] = run_scene(scene, engine, name, error=scene.error)
            except RunFailed as error:
                failed[f"{name}, {engine}"] = str(error)
        if runs:
            join_results(runs, "engine").save(output_folder / f"{name}.nc")
            title = name.replace("_", " ").capitalize() if len(scene.manoeuvres) > 1 else scene.title
            manoeuvre_figure(runs, title, output_folder / f"{name}.png")
            results |= {f"{name}, {engine}": run for engine, run in runs.items()}
            answer[name] = _key_figures_of_runs(runs)
            lines.append(_manoeuvre_line(name, answer[name]))
    head = (
        f"    {'':<16}{'largest':>26}{'least':>12}{'friction':>10}{'engines':>10}\n"
        f"    {'':<16}{'yaw rate':>12}{'lateral acc.':>14}{'load':>12}{'used':>10}{'differ':>10}"
    )
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": failed,
        "answer": answer,
        "results": results,
        "table": [head, *lines],
    }


def _key_figures_of_runs(runs_by_engine: dict[str, Result]) -> dict[str, float]:
    first, *other_runs = runs_by_engine.values()
    drive = first.detail
    figures = {
        "largest yaw rate [rad/s]": np.abs(drive.velocity()[:, 2]).max(),
        "largest lateral acceleration [m/s^2]": np.abs(drive.lateral_acceleration()).max(),
        "least wheel load [N]": first["load"].min(),
        "largest use of friction": drive.friction_used().max(),
        "last speed [m/s]": drive.velocity()[-1, 0],
        "largest power of a contact [W]": first["power"].max(),
    }
    if other_runs:
        figures[DIFFERENCE_TITLE] = max(
            np.abs(first[key] - run[key]).max() for run in other_runs for key in ("positions", "rates")
        )
    return {key: float(value) for key, value in figures.items()}


def _manoeuvre_line(manoeuvre_name: str, run_figures: dict[str, float]) -> str:
    yaw, lateral, load, used = list(run_figures.values())[:4]
    gap = f"{run_figures[DIFFERENCE_TITLE]:>10.1e}" if DIFFERENCE_TITLE in run_figures else ""
    return f"    {manoeuvre_name:<16}{yaw:>6.3f} rad/s{lateral:>8.2f} m/s^2{load:>10.0f} N{100 * used:>8.0f} %{gap}"


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("handling")
