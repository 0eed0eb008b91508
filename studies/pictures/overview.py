"""Overview picture of the README: one vehicle, three implementations, their agreement, and the cost of accuracy.

``python -m studies.pictures.overview FILE`` runs 2 s of a rough road in both engines and the reference and draws it
anew; nothing in it depends on the machine, as work is counted in force calls.
"""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Circle, FancyArrowPatch, FancyBboxPatch

from models.core.result import Result
from models.drawing.figures import (
    COLOURS,
    COLUMN_WIDTH,
    DARK,
    GREY,
    LABELS,
    PALE,
    SMALL_TEXT,
    add_heading,
    save,
    subplot_mosaic,
)
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import build

DURATION, COMPARED_FORCE = 2.0, "f1"
"""Duration of a run (s), and the compared channel, the force on the front wheel."""
SCENE: dict[str, Any] = {
    "title": "A vehicle on a rough road",
    "vehicle": {"parameters": "asymmetric_twin"},
    "run": {"duration": DURATION},
    "effects": {"road": {"source": "iso8608", "road_class": "B", "level": "one-sided", "seed": 1, "speed": 20.0}},
}
STEPS_TRIED = (1e-2, 5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4)
STABLE_STEPS = {"exudyn": STEPS_TRIED, "mujoco": STEPS_TRIED[2:], "reference": STEPS_TRIED[2:]}
"""Steps (s) of each curve at which its method is stable; all divide ``COMPARISON_SPACING``."""
COMPARISON_SPACING, REFERENCE_STEP = 1e-2, 5e-5
"""Spacing (s) of the times at which forces are compared, and step (s) of the reference solution."""
RUNGE_KUTTA = {"reference": "RK4", "exudyn": "RK44", "mujoco": "RK4"}
ENGINE_DEFAULTS = {"exudyn": ("GeneralizedAlpha", "usual solver", 1e-2), "mujoco": ("Euler", "usual solver", 2e-3)}
"""Default of each engine: method, label in the figure, step (s)."""
CURVE_STYLES = {"reference": ("-", 3.2), "exudyn": ("-", 1.5), "mujoco": (":", 1.5)}
"""Line style and width of each engine's curve, by which coinciding curves are seen."""


def draw_overview_picture(picture_path: Path) -> Path:
    """Run the scene in all implementations and save the overview picture; returns its path."""
    runs = {engine: _run_of_engine(engine, method, 1e-3) for engine, method in RUNGE_KUTTA.items()}
    figure, axes = subplot_mosaic(
        [["idea", "idea", "idea"], ["force", "gap", "price"]], figsize=(COLUMN_WIDTH, 4.5), height_ratios=(1, 1.5)
    )
    _draw_overview(axes["idea"])
    _plot_forces(axes["force"], runs)
    _plot_differences(axes["gap"], runs)
    _plot_errors_over_calls(axes["price"])
    add_heading(figure, "twinrig: one vehicle in two engines and by hand, each result with its error and its price")
    return save(figure, picture_path)


def _run_of_engine(engine: str, integrator: str, time_step: float) -> Result:
    """Result of the scene in an engine by a method with a step (s)."""
    scene = build(SCENE | {"engines": {engine: {"integrator": integrator, "step": time_step}}})
    return run(scene, engine)


def _plot_forces(axis: Any, runs_by_engine: dict[str, Result]) -> None:
    for engine, result in runs_by_engine.items():
        line, width = CURVE_STYLES[engine]
        axis.plot(
            result.times,
            1e-3 * result[COMPARED_FORCE],
            line,
            color=COLOURS[engine],
            linewidth=width,
            label=LABELS[engine],
        )
    axis.set(xlabel="time [s]", title="The same force [kN] ...", xlim=(0.0, DURATION))


def _plot_differences(axis: Any, runs_by_engine: dict[str, Result]) -> None:
    """Plot the largest difference of each engine's force from the reference up to each time, divided by the largest
    force."""
    reference = runs_by_engine["reference"]
    largest = np.abs(reference[COMPARED_FORCE]).max()
    for engine in ("exudyn", "mujoco"):
        gap = (
            np.maximum.accumulate(np.abs(runs_by_engine[engine][COMPARED_FORCE] - reference[COMPARED_FORCE])) / largest
        )
        axis.semilogy(reference.times, np.maximum(gap, 1e-18), color=COLOURS[engine], linewidth=1.6)
    digits = math.floor(-math.log10(max(line.get_ydata()[-1] for line in axis.lines)))
    axis.axhline(1e-2, color=DARK, linestyle=":")
    axis.text(0.03 * DURATION, 1.6e-2, "1 %", va="bottom")
    axis.set(
        xlabel="time [s]", ylim=(1e-17, 1.0), xlim=(0.0, DURATION), title=f"... to {digits} digits: difference [-]"
    )


def _plot_errors_over_calls(axis: Any) -> None:
    """Plot the relative error of the force over the number of force calls: of the classical Runge-Kutta method, and of
    each engine's default solver."""
    truth = _run_of_engine("reference", "RK4", REFERENCE_STEP)
    curves = {engine: (method, f"{LABELS[engine]}, {name}") for engine, (method, name, _) in ENGINE_DEFAULTS.items()}
    curves |= {"reference": ("RK4", "Runge-Kutta, all three")}
    for engine, (method, name) in curves.items():
        points = [_calls_and_error(_run_of_engine(engine, method, step), truth, step) for step in STABLE_STEPS[engine]]
        calls, errors = zip(*points, strict=True)
        axis.loglog(calls, errors, "o-", color=COLOURS[engine], markersize=3.5)
        axis.text(1.4 * calls[-1], errors[-1], name, color=COLOURS[engine], va="center", fontsize=SMALL_TEXT)
    for engine, (method, _, step) in ENGINE_DEFAULTS.items():
        calls_and_error = _calls_and_error(_run_of_engine(engine, method, step), truth, step)
        axis.plot(*calls_and_error, "o", markersize=10, markerfacecolor="none", color=COLOURS[engine])
    axis.set(xlabel="work: force calls [-] (ring: usual step)", xlim=(4e2, 4e6), title="What accuracy costs: error [-]")


def _calls_and_error(engine_run: Result, reference_run: Result, time_step: float) -> tuple[float, float]:
    """Number of force calls of a run, and largest error of its force at common times divided by the largest force."""
    rows, fine = round(COMPARISON_SPACING / time_step), round(COMPARISON_SPACING / REFERENCE_STEP)
    error = (
        np.abs(engine_run[COMPARED_FORCE][::rows] - reference_run[COMPARED_FORCE][::fine]).max()
        / np.abs(reference_run[COMPARED_FORCE]).max()
    )
    return float(engine_run.counts()["force calls"]), float(error)


def _draw_overview(axis: Any) -> None:
    """Draw a sketch of the vehicle on its road, and of one scene file that three implementations run and compare."""
    axis.set(xlim=(0, 24), ylim=(0, 4.2), aspect="equal")
    axis.axis("off")
    x = np.linspace(0.0, 8.2, 300)
    road = 0.5 + 0.16 * np.sin(1.9 * x) + 0.1 * np.sin(4.3 * x + 1.0)
    axis.fill_between(x, road, 0.0, color=PALE, alpha=0.6, linewidth=0)
    axis.plot(x, road, color=GREY)
    for wheel_x in (2.1, 6.1):
        height = float(np.interp(wheel_x, x, road))
        axis.add_patch(Circle((wheel_x, height + 0.45), 0.45, facecolor="white", edgecolor=DARK, linewidth=2.0))
        spring = np.linspace(height + 0.9, 2.45, 9)
        axis.plot(wheel_x + 0.16 * np.array([0, 0, 1, -1, 1, -1, 1, 0, 0]), spring, color=DARK)
    axis.add_patch(FancyBboxPatch((1.3, 2.45), 5.6, 0.8, boxstyle="round,pad=0.1", facecolor="#dddddd", edgecolor=DARK))
    axis.text(4.1, 2.85, "one scene file", ha="center", va="center", fontsize=9)
    for engine, height in (("exudyn", 3.45), ("mujoco", 2.1), ("reference", 0.75)):
        name = LABELS[engine] if engine != "reference" else "equations by hand"
        _draw_arrow(axis, (8.4, 2.1), (10.3, height), COLOURS[engine])
        _draw_box(axis, (13.2, height), 5.6, name, COLOURS[engine])
        _draw_arrow(axis, (16.1, height), (17.5, 2.1), COLOURS[engine])
    _draw_box(axis, (20.7, 2.1), 6.0, "one result: compared,\nits error and its price", DARK, 1.7)


def _draw_arrow(axis: Any, start_point: tuple[float, float], end_point: tuple[float, float], colour: str) -> None:
    axis.add_patch(
        FancyArrowPatch(start_point, end_point, color=colour, arrowstyle="-|>", mutation_scale=10, linewidth=1.4)
    )


def _draw_box(
    axis: Any, centre: tuple[float, float], box_width: float, text: str, colour: str, box_height: float = 0.95
) -> None:
    corner = centre[0] - box_width / 2, centre[1] - box_height / 2
    shape = FancyBboxPatch(
        corner, box_width, box_height, boxstyle="round,pad=0.08", facecolor="white", edgecolor=colour
    )
    axis.add_patch(shape)
    axis.text(*centre, text, color=colour, ha="center", va="center", fontsize=9, fontweight="bold")


if __name__ == "__main__":
    draw_overview_picture(Path(sys.argv[1]))
