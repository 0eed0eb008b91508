"""Accelerations of Exudyn and MuJoCo at random states compared with the paper's equations, before any time
simulation."""

from pathlib import Path

from models.systems.pitch_plane.scene import assembly_of_scene, settings_of
from models.systems.pitch_plane.scene import build as build_scene
from validation.common import checks
from validation.common.checks import acceleration_gap
from validation.common.rows import CaseAnswer, Observed, System

TITLE = "Accelerations at 100 random states"
SYSTEM: System = "pitch-plane"
STATE_COUNT = 100


def study_road_scene(parameter_set_name: str, geometry_name: str = "exact"):
    """Scene of a vehicle on the study road; the road makes its heights enter the comparison."""
    return build_scene(
        {
            "title": TITLE,
            "vehicle": {"parameters": parameter_set_name, "geometry": geometry_name},
            "run": {"duration": 2.0, "step": 1e-3},
            "effects": {"road": {"source": "study", "speed": 20.0}},
        }
    )


def acceleration_difference(engine_name: str, parameter_set_name: str, geometry_name: str = "exact") -> float:
    """Largest difference of an engine's accelerations from the reference's over all random states, divided by the
    largest acceleration."""
    audited = study_road_scene(parameter_set_name, geometry_name)
    return acceleration_gap(
        checks.engine(engine_name), assembly_of_scene(audited), settings_of(audited, engine_name), STATE_COUNT
    )


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows for each engine, vehicle and geometry; a quick run is the same."""
    rows = [
        Observed(
            f"audit.{engine}.{parameter_set_name}.{geometry}",
            SYSTEM,
            f"largest difference of the acceleration in {engine} from the paper's equations, "
            f"{parameter_set_name}, {geometry} geometry",
            acceleration_difference(engine, parameter_set_name, geometry),
            "of the largest",
        ).at_most(
            1e-12,
            "both sides are a dozen products of doubles; 1e-12 leaves four digits for cancellation",
            "handed over" if (engine, geometry) == ("exudyn", "linear") else "native",
        )
        for engine in ("exudyn", "mujoco")
        for parameter_set_name in ("itwm_drift", "asymmetric_twin")
        for geometry in ("exact", "linear")
    ]
    return rows, {}
