"""Measured roads from CSV files: arc length and the heights of two tracks, each with its unit.

    # anything
    s [m], left [mm], right [mm]
    0.0, 12.5, 11.0
    0.1, 12.9, 10.2

Heights are positive **up** in the file, as surveyors write them, and become zeta = -height here. The
stations may begin anywhere; the first one becomes s = 0. How strict the text is: models/core/tables.py.
"""

from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.tables import DISTANCES, METRES, read_table
from models.road.profile import SplineProfile

TRACK_NAMES = ("left", "right", "mean")

_ROAD_COLUMNS = {"s": DISTANCES, "left": METRES, "right": METRES}


def read_csv_road(road_path: str | Path, track_name: str = "mean") -> SplineProfile:
    """Road, a C2 spline, through one track of a CSV file.

    Parameters
    ----------
    road_path : file with the columns ``s``, ``left`` and ``right``: s in m or km, heights in m, cm or mm
    track_name : "left", "right" or "mean", the mean of the two at each station

    Returns
    -------
    profile with stations from 0 (m) and zeta positive down (m)

    Raises
    ------
    InputError : naming file, line, value and what is allowed; fewer than 4 points are no road
    """
    if track_name not in TRACK_NAMES:
        raise InputError(road_path, "track", track_name, "must be a track of the file", TRACK_NAMES)
    left, right = read_csv_tracks(road_path)
    mean = SplineProfile.through(
        left.station, (left.points[1] + right.points[1]) / 2.0, f"{Path(road_path).name}, mean"
    )
    return {"left": left, "right": right, "mean": mean}[track_name]


def read_csv_tracks(road_path: str | Path) -> tuple[SplineProfile, SplineProfile]:
    """Left and right track of a road in a CSV file; file, frame and errors as in :func:`read_csv_road`."""
    table = read_table(road_path, _ROAD_COLUMNS, increasing_column="s", least_row_count=4)
    station = table["s"] - table["s"][0]
    name = Path(road_path).name
    return _track_profile(station, table["left"], f"{name}, left"), _track_profile(
        station, table["right"], f"{name}, right"
    )


def _track_profile(stations: np.ndarray, heights_up: np.ndarray, road_name: str) -> SplineProfile:
    return SplineProfile.through(stations, -heights_up, road_name)
