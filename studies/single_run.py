"""A scene in one or all implementations: results, a figure, and differences between the implementations."""

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.result import Result
from models.systems.pitch_plane.plan import doubt_lines, trust_line
from models.systems.pitch_plane.run import channel_summary
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assembly_of_scene
from models.vehicles.pitch_plane import STATE_NAMES

ReportProgress = Callable[[str, float], None]


def run(scene: Scene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Run the scene in each engine; saves ``ENGINE.nc`` and ``states.png``, and returns the summary. A failed run is
    reported, and the others are run."""
    results: dict[str, Result] = {}
    failed: dict[str, str] = {}
    for i, engine in enumerate(engines):
        report_progress(f"{scene.title}: {engine}", i / len(engines))
        try:
            results[engine] = simulate(scene, engine, error=scene.error)
        except RunFailed as error:
            failed[engine] = str(error)
            continue
        results[engine].save(output_folder / f"{engine}.nc")
    report_progress("figure", 1.0)
    assembly = assembly_of_scene(scene)
    if results:
        _figure(scene, results, output_folder / "states.png")
    texts = {engine: result.data.attrs.get("beside reference") for engine, result in results.items()}
    outside_engines = [
        f"  {engine}: {text}" for engine, text in texts.items() if text
    ]  # of engines from outside the tree
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "runs": {engine: _run_summary(result) for engine, result in results.items()},
        "failed": failed,
        "results": results,
        "largest difference of states": differences_of_engines(results),
        "doubts": list(assembly.doubts),
        "table": [*trust_line(assembly), *doubt_lines(assembly), *outside_engines],
    }


def _run_summary(engine_run: Result) -> dict[str, Any]:
    attributes = {name: engine_run.data.attrs[name] for name in ("integrator", "step", "seconds")}
    return {**attributes, "counts": engine_run.counts(), "channels": channel_summary(engine_run)}


def differences_of_engines(results_by_engine: dict[str, Result]) -> dict[str, float]:
    """Largest difference of any state (m, rad, m/s, rad/s) between each two engines' results, at the same times."""
    return {
        f"{a} - {b}": largest_state_difference(results_by_engine[a], results_by_engine[b])
        for a, b in combinations(results_by_engine, 2)
    }


def largest_state_difference(first_run: Result, second_run: Result) -> float:
    """Largest difference of any state between two runs; if their times differ, the denser run is interpolated by a
    cubic spline."""
    if have_same_times(first_run, second_run):
        return float(np.abs(first_run.states - second_run.states).max())
    from scipy.interpolate import CubicSpline

    fine, coarse = (first_run, second_run) if len(first_run.times) > len(second_run.times) else (second_run, first_run)
    return float(np.abs(CubicSpline(fine.times, fine.states)(coarse.times) - coarse.states).max())


def have_same_times(first_run: Result, second_run: Result) -> bool:
    """Whether the rows of both runs are at the same times."""
    return len(first_run.times) == len(second_run.times) and bool(
        np.allclose(first_run.times, second_run.times, rtol=0, atol=1e-9)
    )


def _figure(scene: Scene, results_by_engine: dict[str, Result], figure_path: Path) -> None:
    from models.drawing.figures import COLOURS, COLUMN_WIDTH, LABELS, add_heading, legend_below, save, subplots

    panels = [
        ("z3", "Heave of the chassis, down [m]", 1.0),
        ("pitch", "Pitch, nose up [rad]", 1.0),
        ("f1", "Front wheel force [kN]", 1e-3),
    ]
    if all("enforced_moment" in result.data for result in results_by_engine.values()):
        panels.append(("enforced_moment", "Enforced moment [N m]", 1.0))
    rows = len(panels) + (1 if len(results_by_engine) > 1 else 0)
    figure, axes = subplots(rows, 1, figsize=(COLUMN_WIDTH, 1.7 * rows + 0.7), sharex=True)
    for axis, (channel, label, scale) in zip(axes, panels, strict=False):
        for i, (engine, result) in enumerate(results_by_engine.items()):
            style = {"color": COLOURS[engine], "label": LABELS[engine], "linewidth": 2.4 - 0.8 * i, "alpha": 0.9}
            axis.plot(result.times, scale * result[channel], **style)
        axis.set_title(label)
    if len(results_by_engine) > 1:
        _plot_differences(axes[-1], results_by_engine)
    axes[-1].set_xlabel("time [s]")
    legend_below(figure, axes[0])
    add_heading(figure, scene.title, results_by_engine)
    save(figure, figure_path)


def _plot_differences(axis: Any, results_by_engine: dict[str, Result]) -> None:
    """Plot the largest state difference of each run from the first run over time, on a logarithmic scale."""
    from models.drawing.figures import COLOURS, LABELS

    (base, first), *other_results = results_by_engine.items()
    for engine, result in other_results:
        if have_same_times(result, first):
            gap = np.abs(result.states - first.states).max(axis=1)
            axis.semilogy(
                result.times, np.maximum(gap, 1e-18), color=COLOURS[engine], label=f"{LABELS[engine]} - {LABELS[base]}"
            )
    axis.set_title(f"Largest difference of the {len(STATE_NAMES)} states [m, rad, m/s, rad/s]")
    axis.legend(loc="lower right", ncols=2)


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("study_road")
