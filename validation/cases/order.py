"""Observed order of convergence of every fixed-step integrator on the study road."""

from pathlib import Path

import numpy as np

from models.engines.assembly import Settings
from models.systems.pitch_plane.run import run as simulate
from validation.common.rows import CaseAnswer, Observed, Saved, System, Table
from validation.common.scenes import on_paper_road, road_scene

TITLE = "Observed order of the largest state error on the study road"
SYSTEM: System = "pitch-plane"
DURATION = 2.0
COMPARED_TIME_GRID = 1e-3
"""Time grid (s) on which all runs are compared."""

JUDGED_INTEGRATORS: tuple[tuple[str, str, dict[str, float], float, float], ...] = (
    ("reference", "RK4", {}, 4.0, 0.15),
    ("exudyn", "RK44", {}, 4.0, 0.15),
    ("mujoco", "RK4", {}, 4.0, 0.15),
    ("exudyn", "GeneralizedAlpha", {"spectral_radius": 0.6}, 2.0, 0.1),
    ("exudyn", "GeneralizedAlpha", {"spectral_radius": 0.9}, 2.0, 0.1),
    ("exudyn", "TrapezoidalIndex2", {}, 2.0, 0.1),
    ("exudyn", "ExplicitMidpoint", {}, 2.0, 0.15),
    ("exudyn", "RK33", {}, 3.0, 0.15),
    ("exudyn", "ExplicitEuler", {}, 1.0, 0.1),
    ("exudyn", "VelocityVerlet", {}, 1.0, 0.1),
    ("mujoco", "Euler", {}, 1.0, 0.1),
    ("mujoco", "implicit", {}, 1.0, 0.1),
    ("mujoco", "implicitfast", {}, 1.0, 0.1),
    ("mujoco", "discrete", {}, 1.0, 0.1),
)
"""Engine, integrator, options, expected order, and tolerance of the observed order."""
TIME_STEPS = (5e-4, 2.5e-4, 1.25e-4, 6.25e-5)
QUICK_TIME_STEPS, QUICK_DURATION = TIME_STEPS[1:3], 0.5
"""Steps (s) and length (s) of a quick run: one halving of the step over half a second."""
ORDER_REASON = "halvings inside the asymptotic range; the band leaves room for the next term of the error"


def state_errors_by_time_step(
    engine_name: str,
    integrator_name: str,
    integrator_options: dict[str, float],
    exact_states: np.ndarray,
    duration: float,
    time_steps: tuple[float, ...],
) -> list[float]:
    """Largest state error of an integrator at each step, over a duration (s), on the common time grid."""
    errors_of_steps = []
    for step in time_steps:
        run = simulate(
            road_scene(step=step, duration=duration),
            engine_name,
            Settings(integrator_name, step, duration, **integrator_options),
        )
        errors_of_steps.append(float(np.abs(run.states[:: round(COMPARED_TIME_GRID / step)] - exact_states).max()))
    return errors_of_steps


def fitted_order(time_steps: tuple[float, ...], errors_by_time_step: list[float]) -> float:
    """Order of convergence: slope of log(error) over log(step) by least squares."""
    return float(np.polyfit(np.log(time_steps), np.log(errors_by_time_step), 1)[0])


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """A row for each integrator, compared with DOP853 at a tolerance of 1e-13. A quick run has one halving of the step
    over half a second."""
    steps, duration = (QUICK_TIME_STEPS, QUICK_DURATION) if quick else (TIME_STEPS, DURATION)
    truth = simulate(
        road_scene(step=COMPARED_TIME_GRID, duration=duration),
        "reference",
        Settings("DOP853", COMPARED_TIME_GRID, duration, 1e-13),
    ).states
    rows, table = [], []
    for engine, integrator, options, order, band in JUDGED_INTEGRATORS:
        errors_of_steps = state_errors_by_time_step(engine, integrator, options, truth, duration, steps)
        name = " ".join([integrator, *(f"{value:g}" for value in options.values())])
        rows.append(
            Observed(
                f"order.{engine}.{name}",
                SYSTEM,
                f"observed order of {name} in {engine}",
                fitted_order(steps, errors_of_steps),
                "",
            ).within(order, band, ORDER_REASON, "closed form")
        )
        table.append([engine, name, *errors_of_steps])
    return rows, {"table": table, "steps": steps, "duration": duration}


def tables(case_data: Saved) -> list[Table]:
    """Table of the largest state error by integrator and step."""
    heads = ("engine", "integrator", *(f"{1e3 * step:g} ms" for step in case_data["steps"]))
    rows = tuple(
        (engine, name, *(f"{value:.2e}" for value in errors_of_steps))
        for engine, name, *errors_of_steps in case_data["table"]
    )
    note = (
        f"Largest error of any state (m, rad, m/s, rad/s) over the first {case_data['duration']:g} s. Equal rows are "
        "the same method."
    )
    return [Table(TITLE, note, heads, rows)]
