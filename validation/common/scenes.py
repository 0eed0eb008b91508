"""Pitch-plane scenes that the validation cases share, and the folder of measured data."""

import os
from contextlib import ContextDecorator
from pathlib import Path
from typing import Any

import numpy as np

from models.core.result import Result
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import Scene, build
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation.common.grounds import allowing_breaches

VEHICLE_SETS = ("itwm_drift", "asymmetric_twin")
STUDY_ROAD = {"source": "study", "speed": 20.0}
COURSE_FILE = "detrended_rms_course_2in.crg"
"""File of a measured road of 504 m, which is not part of the repository."""


def on_paper_road() -> ContextDecorator:
    """Context in which runs of the paper's vehicle may break assumptions on its tyres and springs, on the paper's road
    or under its wheel forces."""
    why = "the paper's linear tyres pull or lie on their rims at times on its road, on both sides of a comparison alike"
    return allowing_breaches(why, "tyres press", "springs compressed", "tyres not flat")


def road_scene(
    parameters: str = "itwm_drift",
    step: float = 1e-3,
    duration: float = 2.0,
    road: dict[str, Any] | None = None,
    scene_folder: Path = Path(),
) -> Scene:
    """Pitch-plane scene of the vehicle on a road, by default the road of the paper's study; step and duration in s."""
    return build(
        {
            "title": "validation",
            "vehicle": {"parameters": parameters},
            "run": {"duration": duration, "step": step},
            "effects": {"road": road or STUDY_ROAD},
        },
        "",
        scene_folder,
    )


def virtual_drive(
    output_folder: Path,
    duration: float,
    sample_period: float = 1e-3,
    step: float = 1e-3,
    parameters: str = "itwm_drift",
    road: dict[str, Any] | None = None,
) -> Result:
    """Virtual measurement on a road in the reference; its files, sampled every ``sample_period`` (s), are written to
    the folder.
    """
    measured = run(road_scene(parameters, step, duration, road), "reference")
    write_measurement(measured, output_folder, sample_period)
    return measured


def force_scene(
    scene_folder: Path,
    parameters: str = "itwm_drift",
    step: float = 1e-3,
    duration: float = 2.0,
    interpolation: str = "linear",
    parameter_changes: dict[str, float] | None = None,
    effects: dict[str, Any] | None = None,
) -> Scene:
    """Pitch-plane scene of the vehicle under the wheel forces that ``virtual_drive`` wrote to the folder; step and
    duration in s."""
    forces = {"wheel_forces": {"file": "wheel_forces.csv", "interpolation": interpolation}}
    return build(
        {
            "title": "validation",
            "vehicle": {"parameters": parameters, "override": parameter_changes or {}},
            "run": {"duration": duration, "step": step},
            "effects": forces | (effects or {}),
        },
        "",
        scene_folder,
    )


def data_folder() -> Path | None:
    """Folder of measured files, named by the environment variable TWINRIG_DATA; None where it is not set or
    missing."""
    named = os.environ.get("TWINRIG_DATA")
    return Path(named) if named and Path(named).is_dir() else None


def largest_difference(first_result: Result, second_result: Result) -> float:
    """Largest difference of any state (m, rad, m/s, rad/s) of two runs on the same times."""
    return float(np.abs(first_result.states - second_result.states).max())
