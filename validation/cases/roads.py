"""Roads: heights written to files are read back unchanged, and measured roads have the properties that their owners
state."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.road.csv_road import read_csv_road
from models.road.iso8608 import DENSITY_OF_CLASS, iso8608_road
from models.road.opencrg import read_opencrg, write_opencrg
from models.road.profile import RoadProfile
from models.road.study import study_road
from models.systems.pitch_plane.run import run as simulate
from validation.common.rows import Observed, Row, System, not_run
from validation.common.scenes import COURSE_FILE, data_folder, largest_difference, on_paper_road, road_scene

TITLE = "Roads: formula, class, OpenCRG and CSV"
SYSTEM: System = "pitch-plane"
ROAD_LENGTH, STATION_INCREMENT = 60.0, 0.05
ROAD_SEED = 3
"""Seed of the class C road's random phases."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of round trips through files, sampling by recurrence, variance of a road class, and the measured course; a
    quick run is the same."""
    with TemporaryDirectory() as name:
        rows = _round_trip_rows(Path(name))
    return [*rows, _road_recurrence_row(), _class_variance_row(), *_measured_course_rows()], {}


@on_paper_road()
def _round_trip_rows(work_folder: Path) -> list[Row]:
    """Rows: the study road is written to OpenCRG and CSV files and read back unchanged."""
    road = study_road()
    write_opencrg(road, work_folder / "study.crg", ROAD_LENGTH, STATION_INCREMENT)
    _write_csv(road, work_folder / "study.csv")
    back = {"OpenCRG": read_opencrg(work_folder / "study.crg"), "CSV": read_csv_road(work_folder / "study.csv")}
    station = STATION_INCREMENT * np.arange(round(ROAD_LENGTH / STATION_INCREMENT) + 1)
    true = road.height_and_slope(station)[0]
    rows = [
        Observed(
            f"roads.{kind}.round-trip",
            SYSTEM,
            f"largest change of the study road's heights, written to {kind} and read back",
            float(np.abs(profile.height_and_slope(station)[0] - true).max()),
            "m",
        ).at_most(1e-14, "both formats keep doubles; only the unit conversion rounds", "closed form")
        for kind, profile in back.items()
    ]
    paths = [
        simulate(
            road_scene(
                duration=2.5,
                road={"source": source, "file": f"study.{suffix}", "speed": 20.0, "beyond_end": "refused"},
                scene_folder=work_folder,
            ),
            "reference",
        )
        for source, suffix in (("opencrg", "crg"), ("csv", "csv"))
    ]
    rows.append(
        Observed(
            "roads.same-run",
            SYSTEM,
            "largest difference of the vehicle's states over the OpenCRG road from those over the CSV road",
            largest_difference(*paths),
            "m, rad, m/s, rad/s",
        ).at_most(1e-11, "the same heights to 1e-14 through the same springs", "shared kernel")
    )
    return rows


def _write_csv(road: RoadProfile, csv_path: Path) -> None:
    """Write road heights to a CSV file as a surveyor would: upward, in mm."""
    station = STATION_INCREMENT * np.arange(round(ROAD_LENGTH / STATION_INCREMENT) + 1)
    up = -1e3 * road.height_and_slope(station)[0]
    np.savetxt(
        csv_path,
        np.column_stack([station, up, up]),
        fmt="%.17g",
        delimiter=",",
        header="s [m],left [mm],right [mm]",
        comments="",
    )


def _road_recurrence_row() -> Row:
    """Row: study road sampled by recurrence, compared with the formula."""
    road = study_road()
    station = 300.0 + 0.01 * np.arange(4000)
    error = np.abs(road.sample_uniform(300.0, 0.01, 4000)[0] - road.height_and_slope(station)[0]).max()
    return Observed(
        "roads.recurrence",
        SYSTEM,
        "largest difference of the study road sampled by rotation from the formula",
        float(error),
        "m",
    ).at_most(1e-13, "64 rotations of a unit vector lose 64 roundings before they start anew", "closed form")


def _class_variance_row() -> Row:
    """Row: variance of a class C road, compared with the integral of its spectral density over the band."""
    low, high = 0.05, 2.0
    road = iso8608_road("C", seed=ROAD_SEED, n_min=low, n_max=high, waves=80, window_length=0.0)
    height = road.sample_uniform(0.0, 0.05, 400_000)[0]
    expected = DENSITY_OF_CLASS["C"] * 0.1**2 * (1 / low - 1 / high)
    return Observed(
        "roads.iso8608",
        SYSTEM,
        "variance of a class C road over 20 km, one-sided density 0.05 to 2 1/m",
        float(np.var(height) / expected),
        "of the integral",
    ).within(
        1.0, 0.01, "sines of unequal wavelength are uncorrelated to 1 over the number of waves in 20 km", "closed form"
    )


def _measured_course_rows() -> list[Row]:
    """Rows: properties of the measured course, compared with those that its owners state."""
    data = data_folder()
    if data is None:
        return [not_run("roads.measured", SYSTEM, "measured roads", "TWINRIG_DATA names no folder")]
    left, right = (read_opencrg(data / COURSE_FILE, track) for track in ("left", "right"))
    station = np.arange(0.0, 504.0, 0.05)
    heights = [profile.height_and_slope(station)[0] for profile in (left, right)]
    undulated = heights[0][(station >= 100) & (station <= 404.8)]
    return [
        Observed(
            "roads.course.tracks",
            SYSTEM,
            "difference between the left and the right track of the measured course",
            float(np.abs(heights[0] - heights[1]).max()),
            "m",
        ).at_most(0.0, "its owners say that they are identical", "published"),
        Observed(
            "roads.course.rms",
            SYSTEM,
            "rms of the undulated part of the measured course, detrended",
            float(_heights_without_trend(undulated).std()),
            "m",
        ).within(
            1.7441 * 0.0254,
            0.002,
            "the file's header says 1.7441 in; how it was detrended is not said, which moves it by some percent",
            "published",
        ),
    ]


def _heights_without_trend(heights: np.ndarray) -> np.ndarray:
    """Heights from which a straight line has been subtracted."""
    index = np.arange(len(heights))
    return heights - np.polyval(np.polyfit(index, heights, 1), index)
