"""Moment that enforces a prescribed pitch: Exudyn's multiplier and MuJoCo's inverse dynamics compared with the
equations without multiplier."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.core.time_series import write_time_series
from models.engines.assembly import Settings
from models.engines.protocol import build
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, parameter_set
from models.systems.pitch_plane.virtual_measurement import perturbed_parameters, write_wheel_forces
from models.vehicles.parameters.itwm_drift import PARAMETERS
from models.vehicles.pitch_plane import equilibrium
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table
from validation.common.scenes import VEHICLE_SETS, force_scene, on_paper_road, virtual_drive

TITLE = "Enforced moment of a prescribed pitch"
SYSTEM: System = "pitch-plane"
DURATION, QUICK_DURATION, ABRUPT_SECONDS, ROUGH_ROAD_SECONDS = 4.0, 1.5, 1.0, 2.0
"""Lengths (s) of the runs: of the manoeuvre in a full and in a quick run, of the abrupt start (so long that its ringing
is not most of the run), and on the study road."""
SAMPLE_PERIOD = 1e-3
TIME_STEP = 1e-3
MOMENT_TOLERANCE = 1e-4
PRESCRIBED_PITCH_EFFECT = {"prescribed_pitch": {"file": "pitch.csv"}}
BEST_SOLVER_SETTINGS = {
    "exudyn": Settings("GeneralizedAlpha", TIME_STEP, DURATION, spectral_radius=0.6),
    "mujoco": Settings("RK4", TIME_STEP, DURATION),
}


def write_manoeuvre(work_folder: Path, parameter_set_name: str, starts_abruptly: bool = False) -> None:
    """Write pitch and wheel forces of a manoeuvre with frequencies up to 2.7 Hz, the range of a car's pitch and heave
    motion.

    The manoeuvre begins in the vehicle's equilibrium with zero angular acceleration, an ``starts_abruptly`` one with
    4.4 rad/s^2 at once.
    """
    p = parameter_set(parameter_set_name, "", work_folder)
    rest = equilibrium(p)
    t = SAMPLE_PERIOD * np.arange(round(DURATION / SAMPLE_PERIOD) + 1)
    s = np.clip(t / 1.0, 0, 1)
    rise = s**3 * (10 - 15 * s + 6 * s**2)
    pitch = rise * (0.06 * np.sin(2 * np.pi * 1.2 * t) + 0.02 * np.sin(2 * np.pi * 2.7 * t))
    if starts_abruptly:
        pitch = 0.05 * (1 - np.cos(2 * np.pi * 1.5 * t))
    pitch = pitch + rest[3]
    front = p.k1 * rest[0] + rise * (900 * np.sin(2 * np.pi * 1.4 * t) + 300 * np.sin(2 * np.pi * 2.3 * t))
    rear = p.k2 * rest[1] + rise * 700 * np.sin(2 * np.pi * 1.7 * t + 1)
    write_wheel_forces(work_folder, front, rear, SAMPLE_PERIOD)
    write_time_series(work_folder / "pitch.csv", {"pitch": ("rad", pitch)}, SAMPLE_PERIOD)


def enforced_moment(scene: Scene, engine_name: str, solver_settings: Settings) -> np.ndarray:
    """Enforced moment (n,) in N m at every millisecond of a scene."""
    finer = replace(solver_settings, duration=scene.run.duration)
    return simulate(scene, engine_name, finer)["enforced_moment"][:: round(SAMPLE_PERIOD / solver_settings.step)]


def exact_moment(scene: Scene) -> np.ndarray:
    """Exact enforced moment (n,) in N m, from the equations without multiplier (eq. 39) by Runge-Kutta with steps of a
    sixteenth of the sampling period."""
    return enforced_moment(scene, "reference", Settings("RK4", SAMPLE_PERIOD / 16, scene.run.duration))


def relative_rms_error(computed_moment: np.ndarray, true_moment: np.ndarray) -> float:
    """Rms difference of two moments divided by the rms of the true moment."""
    return float(np.sqrt(np.mean((computed_moment - true_moment) ** 2) / np.mean(true_moment**2)))


@on_paper_road()
@allowing_breaches("the moment is compared, and its size is another matter", "little artificial")
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows for both vehicles in Exudyn and in MuJoCo, the ringing after an abrupt start, and the study road; a quick
    run has one vehicle and no study road."""
    with TemporaryDirectory() as name:
        work = Path(name)
        rows = _manoeuvre_rows(
            work, VEHICLE_SETS[-1:] if quick else VEHICLE_SETS, QUICK_DURATION if quick else DURATION
        )
        ringing, paths = _multiplier_ringing_rows(work)
        rough, table = ([], []) if quick else _study_road_rows(work, (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5))
    return rows + ringing + rough, {"table": table, "ringing": paths}


def _manoeuvre_rows(work_folder: Path, parameter_set_names: tuple[str, ...], duration: float) -> list[Row]:
    """Rows: error of the enforced moment in Exudyn and MuJoCo during the manoeuvre, for every vehicle."""
    rows = []
    for parameter_set_name in parameter_set_names:
        write_manoeuvre(work_folder, parameter_set_name)
        scene = force_scene(
            work_folder, parameter_set_name, TIME_STEP, duration, "smooth", effects=PRESCRIBED_PITCH_EFFECT
        )
        true = exact_moment(scene)
        if parameter_set_name == parameter_set_names[0]:
            rows.append(_moment_uncertainty_row(scene, true))
        for engine, settings in BEST_SOLVER_SETTINGS.items():
            route = "Lagrange multiplier" if engine == "exudyn" else "reduced model and inverse dynamics"
            rows.append(
                Observed(
                    f"moment.{engine}.{parameter_set_name}",
                    SYSTEM,
                    f"error of the enforced moment at 1 ms, {engine} {settings.integrator} ({route}), "
                    f"{parameter_set_name}",
                    relative_rms_error(enforced_moment(scene, engine, settings), true),
                    "of its rms",
                ).at_most(
                    MOMENT_TOLERANCE,
                    f"the rms is {np.sqrt(np.mean(true**2)):.0f} N m; a second-order scheme leaves (2 pi f h)^2 / 12, "
                    "which is 2e-5 at 2.7 Hz and 1 ms",
                    "native",
                )
            )
    return rows


def _moment_uncertainty_row(scene: Scene, true_moment: np.ndarray) -> Row:
    """Row: uncertainty of the true moment, measured by its difference from an adaptive solver of another family at a
    tolerance of 1e-11."""
    by_other_solver = enforced_moment(scene, "reference", Settings("DOP853", SAMPLE_PERIOD, DURATION, 1e-11))
    return Observed(
        "moment.reference",
        SYSTEM,
        "uncertainty of the moment of the eliminated form: Runge-Kutta at 1/16 ms against Dormand-Prince 8 at 1e-11",
        relative_rms_error(by_other_solver, true_moment),
        "of its rms",
    ).at_most(MOMENT_TOLERANCE / 100, "a hundredth of the bound that it has to judge", "shared kernel")


def _multiplier_ringing_rows(work_folder: Path) -> CaseAnswer:
    """Rows and data on an abrupt start: error of Exudyn's multiplier over the first 0.1 s, with and without consistent
    initial accelerations."""
    write_manoeuvre(work_folder, "itwm_drift", starts_abruptly=True)
    scene = force_scene(
        work_folder, step=TIME_STEP, duration=ABRUPT_SECONDS, interpolation="smooth", effects=PRESCRIBED_PITCH_EFFECT
    )
    true = exact_moment(scene)
    first = slice(1, 101)
    paths: Saved = {"time": (TIME_STEP * np.arange(1, 101)).tolist()}
    for radius in (0.6, 0.9):
        settings = Settings("GeneralizedAlpha", TIME_STEP, ABRUPT_SECONDS, spectral_radius=radius)
        paths[f"inconsistent start, spectral radius {radius}"] = (_inconsistent_multiplier(scene, settings) - true)[
            first
        ].tolist()
        consistent = enforced_moment(scene, "exudyn", settings) - true
        paths[f"consistent start, spectral radius {radius}"] = consistent[first].tolist()
    peak = {name: float(np.abs(path).max()) for name, path in paths.items() if name != "time"}
    rows = [
        Observed(
            "moment.ringing",
            SYSTEM,
            "largest error of Exudyn's multiplier in the first 0.1 s from its own initial "
            "accelerations, spectral radius 0.6 (0.9: "
            f"{peak['inconsistent start, spectral radius 0.9']:.0f} N m)",
            peak["inconsistent start, spectral radius 0.6"],
            "N m",
        ).beside(
            "rings and dies out",
            "Exudyn starts without the constraint's own acceleration, I beta'' = 2,221 N m here",
            "native",
        ),
        Observed(
            "moment.consistent",
            SYSTEM,
            "largest error of Exudyn's multiplier in the first 0.1 s from the accelerations that belong to the pitch",
            peak["consistent start, spectral radius 0.6"],
            "N m",
        ).at_most(2.221, "a thousandth of the moment that the start demands", "native"),
    ]
    return rows, paths


def _inconsistent_multiplier(scene: Scene, solver_settings: Settings) -> np.ndarray:
    """Exudyn's multiplier (n,) in N m if its initial accelerations are not made consistent with the constraint."""
    model: Any = build("exudyn", assembly_of_scene(scene), solver_settings)
    model._first = 0.0
    model._consistent_start = lambda options: None
    multiplier = model.run().moment
    assert multiplier is not None
    return multiplier


def _study_road_rows(work_folder: Path, time_steps: tuple[float, ...]) -> tuple[list[Row], list[list[Any]]]:
    """Rows and table on the paper's run with prescribed pitch on the study road: error of the enforced moment at each
    step, divided by the rms of the moment."""
    virtual_drive(work_folder, ROUGH_ROAD_SECONDS + 0.1, SAMPLE_PERIOD, SAMPLE_PERIOD)
    paper = perturbed_parameters(PARAMETERS)
    scene = force_scene(
        work_folder,
        step=SAMPLE_PERIOD,
        duration=ROUGH_ROAD_SECONDS,
        interpolation="smooth",
        parameter_changes=paper,
        effects=PRESCRIBED_PITCH_EFFECT,
    )
    true = exact_moment(scene)
    table: list[list[Any]] = []
    for engine, best in BEST_SOLVER_SETTINGS.items():
        for step in time_steps:
            settings = Settings(best.integrator, step, ROUGH_ROAD_SECONDS, spectral_radius=best.spectral_radius)
            table.append(
                [
                    engine,
                    best.integrator,
                    step,
                    relative_rms_error(enforced_moment(scene, engine, settings)[20:], true[20:]),
                ]
            )
    rows = [
        Observed(
            f"moment.rough.{engine}",
            SYSTEM,
            f"error of the enforced moment on the study road at 1 ms, {engine}, perturbed model",
            next(row[3] for row in table if row[0] == engine and row[2] == TIME_STEP),
            "of its rms",
        ).beside(
            MOMENT_TOLERANCE,
            "40 Hz of roughness at 1 ms: (2 pi f h)^2 / 12 is 5e-3 of I beta'', twenty times the moment; the "
            "table shows the step that it takes",
            "native",
        )
        for engine in BEST_SOLVER_SETTINGS
    ]
    return rows, table


def tables(case_data: Saved) -> list[Table]:
    """Table of the moment's error by step on the study road; none if it was not simulated."""
    if not case_data["table"]:
        return []
    rows = tuple((engine, name, f"{1e3 * step:g}", f"{error:.1e}") for engine, name, step, error in case_data["table"])
    title = "Enforced moment on the study road, perturbed model, after the first 20 ms"
    note = (
        "Rms of the error / rms of the moment. The rows above use a manoeuvre of up to 2.7 Hz; roughness of 40 Hz "
        "needs a smaller step."
    )
    return [Table(title, note, ("engine", "integrator", "step [ms]", "relative error"), rows)]


def draw(case_data: Saved) -> Drawn:
    """Plot how the multiplier rings after an abrupt start."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, axis = subplots(figsize=(COLUMN_WIDTH, 3.2))
    paths = case_data["ringing"]
    for i, (name, path) in enumerate((name, path) for name, path in paths.items() if name != "time"):
        style, width = ("--", 2) if name.startswith("consistent") else ("-", 1)
        axis.plot(1e3 * np.array(paths["time"]), path, style, label=name, color=f"C{i // 2}", linewidth=width)
    axis.set(xlabel="time [ms]", ylabel="error of the moment [N m]")
    add_heading(figure, "Exudyn's enforced moment rings after an abrupt start, and not after a consistent one")
    axis.legend()
    caption = (
        "A start whose accelerations do not belong to the constraint makes the multiplier ring; it dies out with the "
        "spectral radius, and is gone with consistent accelerations."
    )
    return [(caption, figure)]
