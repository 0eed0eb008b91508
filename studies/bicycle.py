"""A bicycle: eigenvalues of its linear equations over speed, and a nonlinear run on tyres or with ideal rolling."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.result import Result, join_results
from models.core.tables import write_table
from models.drawing.figures import COLOURS, DARK, LABELS, add_heading, panels, save
from models.systems.bicycle.run import run as run_scene
from models.systems.bicycle.scene import BicycleScene

SYSTEM = "bicycle"
ReportProgress = Callable[[str, float], None]


def run(
    scene: BicycleScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute the eigenvalues over speed and a run in each engine; saves ``eigenvalues.csv``, ``runs.nc`` and
    ``bicycle.png``, and returns the summary."""
    failed, runs, speeds, values = dict[str, str](), dict[str, Result](), *eigenvalues(scene)
    write_table(
        output_folder / "eigenvalues.csv",
        {"speed": ("m/s", speeds)}
        | {
            f"{component} {i + 1}": ("1/s", getattr(values[:, i], component))
            for i in range(4)
            for component in ("real", "imag")
        },
    )
    for i, engine in enumerate(engines):
        report_progress(engine, i / len(engines))
        try:
            runs[engine] = run_scene(scene, engine, error=scene.error)
        except RunFailed as error:
            failed[engine] = str(error)
    if runs:
        report_progress("figure", 1.0)
        step = min(len(result.times) for result in runs.values())
        decimated = {
            e: r if len(r.times) == step else r.every(float(r.times[-1]) / (step - 1)) for e, r in runs.items()
        }
        join_results(decimated, "engine").save(output_folder / "runs.nc")
        eigenvalue_and_motion_figure(scene, speeds, values, runs, output_folder / "bicycle.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": failed,
        "answer": _key_figures_of_runs(scene, runs),
        "results": runs,
        "table": [_run_line(engine, result) for engine, result in runs.items()],
    }


def eigenvalues(scene: BicycleScene) -> tuple[np.ndarray, np.ndarray]:
    """Speeds (n,) in m/s, and eigenvalues (n, 4) in 1/s of the bicycle's linear equations with the scene's control."""
    speeds = np.linspace(scene.speeds.start, scene.speeds.stop, scene.speeds.count)
    return speeds, np.array([scene.whipple.eigenvalues(float(speed), scene.control) for speed in speeds])


def _key_figures_of_runs(scene: BicycleScene, runs_by_engine: dict[str, Result]) -> dict[str, Any]:
    bicycle = scene.whipple
    figures: dict[str, Any] = {
        "weave speed without control [m/s]": bicycle.weave_speed,
        "capsize speed without control [m/s]": bicycle.capsize_speed,
    }
    for engine, result in runs_by_engine.items():
        figures[f"largest lean, {engine} [rad]"] = float(np.abs(result["lean"]).max())
        figures[f"energy unaccounted for, {engine}"] = result.detail.unaccounted()
    return figures


def _run_line(engine: str, engine_run: Result) -> str:
    lean, steer = (np.abs(engine_run[name]).max() for name in ("lean", "steer"))
    gap = engine_run.detail.unaccounted()
    return f"    {engine:<12}largest lean {lean:.5f} rad, steer {steer:.5f} rad; energy unaccounted for {gap:.1e}"


def eigenvalue_and_motion_figure(
    scene: BicycleScene,
    speeds: np.ndarray,
    eigenvalues_over_speed: np.ndarray,
    runs_by_engine: dict[str, Result],
    figure_path: Path,
) -> Path:
    """Save a figure of the eigenvalues over speed, and of lean and steer angle over time; returns its path."""
    drawn, axes = panels(4, 2, 2.4)
    for axis, components in ((axes[0], eigenvalues_over_speed.real), (axes[1], eigenvalues_over_speed.imag)):
        axis.plot(speeds, components, ".", ms=2.0, color=DARK)
        axis.axhline(0.0, lw=0.6, color="k")
        axis.set_xlabel("speed [m/s]")
    axes[0].set(ylabel="real part [1/s]", title="Eigenvalues: what grows is above 0", ylim=(-12.0, 7.0))
    axes[1].set(ylabel="imaginary part [1/s]", title="Weave: frequency", ylim=(0.0, None))
    for axis, name in ((axes[2], "lean"), (axes[3], "steer")):
        for i, (engine, result) in enumerate(runs_by_engine.items()):  # the later ones thinner: they lie on the first
            width = max(2.6 - 1.5 * i, 0.6)
            axis.plot(result.times, np.degrees(result[name]), color=COLOURS[engine], label=LABELS[engine], lw=width)
        axis.set(xlabel="time [s]", ylabel=f"{name} [deg]", title=f"{name.capitalize()} angle")
    axes[2].legend()
    add_heading(drawn, scene.title, runs_by_engine)
    return save(drawn, figure_path)


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("bicycle")
