"""Native engine elements compared with the hand-written equations, with the same Runge-Kutta tableau and the same
step."""

from pathlib import Path
from tempfile import TemporaryDirectory

from models.core.result import Result
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, System, not_run
from validation.common.scenes import (
    COURSE_FILE,
    VEHICLE_SETS,
    data_folder,
    force_scene,
    largest_difference,
    on_paper_road,
    road_scene,
)

TITLE = "Same tableau and step: whole paths against the reference"
SYSTEM: System = "pitch-plane"
TIME_STEPS = (2e-3, 1e-3, 5e-4)
ENGINE_TOLERANCE = 1e-12
SAMPLE_COUNT_TO_ROUGH_ROAD = 4_800
"""Number of samples of 0.5 ms until both wheels are well on the rough part of the course."""
FURTHER_MEASURED_ROADS = (("belgian_block.crg", 6.0, "mirrored"), ("Horstwalde.crg", 60.0, "refused"))
"""Further measured roads: file, speed (m/s), and how the road continues beyond its end."""
BOUND_REASON = "RK4 with the same stages differs only by the order of additions: 1e-16 a step over at most 20,000 steps"


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows for each road, excitation, vehicle and engine, each with the largest difference over the steps; a quick run
    has one vehicle at one step."""
    rows: list[Row] = []
    steps = TIME_STEPS[-1:] if quick else TIME_STEPS
    for parameter_set_name in VEHICLE_SETS[-1:] if quick else VEHICLE_SETS:
        rows += _path_difference_rows(
            f"study road, {parameter_set_name}", [road_scene(parameter_set_name, step) for step in steps]
        )
        measured = simulate(road_scene(parameter_set_name, TIME_STEPS[-1], 2.1), "reference")
        rows += _wheel_force_rows(parameter_set_name, "study road", measured, steps)
        rows += _measured_course_rows(parameter_set_name, steps)
    return rows, {}


def _wheel_force_rows(
    parameter_set_name: str, road_name: str, measured_run: Result, time_steps: tuple[float, ...]
) -> list[Row]:
    """Rows: runs driven by the wheel forces of a road-excited run, whose samples are held constant or interpolated
    linearly."""
    with TemporaryDirectory() as name:
        write_measurement(measured_run, Path(name), 2e-3)
        rows = []
        for interpolation in ("held", "linear"):
            scenes = [force_scene(Path(name), parameter_set_name, step, 2.0, interpolation) for step in time_steps]
            rows += _path_difference_rows(
                f"{interpolation} wheel forces of the {road_name}, {parameter_set_name}", scenes
            )
        return rows


@allowing_breaches(
    "edges of measured roads are shorter than a tyre's patch, and both sides read the same heights", "even road"
)
@allowing_breaches("the forces of a rough road topple a vehicle that nothing holds, on both sides alike", "upright")
def _measured_course_rows(parameter_set_name: str, time_steps: tuple[float, ...]) -> list[Row]:
    """Rows: runs on the measured course (250 m at 50 m/s), and runs driven by the wheel forces of its rough part."""
    data = data_folder()
    if data is None or not (data / COURSE_FILE).exists():
        reason = "TWINRIG_DATA names no folder with the measured course"
        return [
            not_run(
                f"twin.course.{parameter_set_name}",
                SYSTEM,
                f"paths on the measured course, {parameter_set_name}",
                reason,
            )
        ]
    road = {"source": "opencrg", "file": COURSE_FILE, "speed": 50.0, "beyond_end": "refused"}
    scenes = [road_scene(parameter_set_name, step, 5.0, road, data) for step in time_steps]
    measured = simulate(scenes[-1], "reference")
    rough = Result(
        measured.data.isel(time=slice(SAMPLE_COUNT_TO_ROUGH_ROAD, None)).assign_coords(
            time=measured.data.time[:-SAMPLE_COUNT_TO_ROUGH_ROAD]
        )
    )
    rows = _path_difference_rows(f"measured course, {parameter_set_name}", scenes) + _wheel_force_rows(
        parameter_set_name, "measured course", rough, time_steps
    )
    for name, speed, rule in FURTHER_MEASURED_ROADS:
        road = {"source": "opencrg", "file": name, "speed": speed, "beyond_end": rule, "track": "left"}
        rows += _path_difference_rows(
            f"{name}, left track, {rule}, {parameter_set_name}", [road_scene(parameter_set_name, 1e-3, 4.0, road, data)]
        )
    return rows


def _path_difference_rows(title: str, scenes: list[Scene]) -> list[Row]:
    """Rows for Exudyn and MuJoCo: largest difference of the states from the reference equations over all scenes."""
    truths = [simulate(scene, "reference") for scene in scenes]
    steps = ", ".join(f"{1e3 * scene.run.step:g}" for scene in scenes)
    return [
        Observed(
            f"twin.{engine}.{title}",
            SYSTEM,
            f"largest difference of the states in {engine} from the reference, RK4 at {steps} ms, {title}",
            max(
                largest_difference(simulate(scene, engine), truth) for scene, truth in zip(scenes, truths, strict=True)
            ),
            "m, rad, m/s, rad/s",
        ).at_most(ENGINE_TOLERANCE, BOUND_REASON, "native")
        for engine in ("exudyn", "mujoco")
    ]
