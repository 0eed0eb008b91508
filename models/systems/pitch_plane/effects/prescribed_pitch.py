"""Pitch prescribed from a file (eq. 39), by an enforced moment that is a result.

A measured pitch is differentiated twice: white noise of 0.1 degrees at 1 kHz would take 1e6 N m. So the pitch is
smoothed to ``bandwidth`` before.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pydantic import Field

from models.core.errors import InputError
from models.core.signals import Smooth, StackedSignal
from models.core.smoothing import low_passed
from models.core.strict import Strict, quantity
from models.core.tables import RADIANS
from models.engines.assembly import PRESCRIBED_COORDINATES, Assembly, Mode
from models.systems.pitch_plane.sampling import check_end

NEEDS = ("wheel_forces",)
EXCLUDES = ("pitch_spring",)
AFTER = ("wheel_forces", "force_noise")
COST = "one constraint in Exudyn; one degree of freedom less and an inverse-dynamics pass in MuJoCo"
EXAMPLE = {"file": "pitch.csv"}
BESIDE = {"wheel_forces": {"file": "forces.csv", "interpolation": "linear"}}
COUNTS = {
    "reference": {"degrees of freedom": -1},
    "exudyn": {"native items": 1, "callbacks": 2},
    "mujoco": {"degrees of freedom": -1},
    "all": {"channels": 2},
}


class Parameters(Strict):
    """[effects.prescribed_pitch]: file of the pitch, and bandwidth to which it is smoothed."""

    file: str = Field(description="CSV with the columns time [s], pitch [rad]; positive nose up")
    bandwidth: float | None = quantity("Hz", "a measured pitch is smoothed down to this before use", default=None)


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the force-excited vehicle with prescribed pitch, a quintic spline through the samples of a file."""
    return prescribe(vehicle_assembly, "prescribed_pitch", parameters, "pitch", {"pitch": RADIANS})


def prescribe(
    vehicle_assembly: Assembly,
    effect_name: str,
    motion_parameters: Any,
    drive_mode: Mode,
    units_of_columns: Mapping[str, Mapping[str, float]],
) -> Assembly:
    """Returns the force-excited vehicle with the coordinates of ``drive_mode`` prescribed by a quintic spline through
    the samples of a file.

    motion_parameters : has the effect's ``file`` and ``bandwidth`` (Hz or None); units_of_columns : names of the file's
    columns, with the factors of their units, in the order of the mode's coordinates. Raises InputError.
    """
    from models.core.time_series import CHASSIS_SAMPLE_TIME, read_time_series, sparse_record_warning

    scene = vehicle_assembly.scene
    _check_scene(scene, units_of_columns)
    values, period = read_time_series(
        scene.path(motion_parameters.file, f"effects.{effect_name}.file"), units_of_columns
    )
    if motion_parameters.bandwidth is not None:
        values = low_passed(values, period, motion_parameters.bandwidth, scene.file, f"effects.{effect_name}.bandwidth")
    motion = Smooth(values, period, derivatives=2, degree=5)
    check_end(scene, f"effects.{effect_name}.file", motion_parameters.file, motion.end)
    assert vehicle_assembly.input is not None
    guided = vehicle_assembly.with_input(drive_mode, StackedSignal((vehicle_assembly.input, motion)))
    guided.initial[[*PRESCRIBED_COORDINATES[drive_mode], *(4 + i for i in PRESCRIBED_COORDINATES[drive_mode])]] = (
        motion.at(0.0)[: 2 * len(units_of_columns)]
    )
    doubt = sparse_record_warning(len(values), period, scene.run.duration, CHASSIS_SAMPLE_TIME)
    return replace(guided, doubts=(*guided.doubts, doubt)) if doubt else guided


def _check_scene(scene: Any, units_of_columns: Mapping[str, Any]) -> None:
    if scene.effects["wheel_forces"].frame == "body":
        allowed = "a prescribed pitch makes the frame a matter of the file: use 'inertial'"
        raise InputError(scene.file, "effects.wheel_forces.frame", "body", allowed)
    for name in (full for column in units_of_columns for full in (column, f"{column}_rate") if full in scene.start):
        allowed = f"the {name.removesuffix('_rate')} is prescribed, and its file says where it starts: drop this key"
        raise InputError(scene.file, f"start.{name}", scene.start[name], allowed)
