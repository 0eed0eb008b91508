"""Pitch prescribed from a file (eq. 39): the vehicle is guided, and the moment that this takes is a result."""

from typing import Any

from pydantic import Field

from models.assembly import Assembly
from models.errors import InputError
from models.signals import Smooth, Stacked
from models.strict import Strict
from models.tables import RADIANS

NEEDS = ("wheel_forces",)
EXCLUDES = ("pitch_spring",)
AFTER = ("wheel_forces", "force_noise")
COST = "one constraint in Exudyn; one degree of freedom less and an inverse-dynamics pass in MuJoCo"


class Parameters(Strict):
    """[effects.prescribed_pitch]."""

    file: str = Field(description="CSV with the columns time [s], pitch [rad]; positive nose up")


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The force-excited vehicle with its pitch as an input, twice differentiable by a quintic spline."""
    from models.time_series import read_time_series

    scene = assembly.scene
    if scene.effects["wheel_forces"].frame == "body":
        raise InputError(scene.file, "effects.wheel_forces.frame", "body",
                         "a prescribed pitch makes the frame a matter of the file: use 'inertial'")
    for name in ("pitch", "pitch_rate"):
        if name in scene.start:
            raise InputError(scene.file, f"start.{name}", scene.start[name],
                             "the pitch is prescribed, and its file says where it starts: drop this key")
    values, period = read_time_series(scene.path(p.file, "effects.prescribed_pitch.file"), {"pitch": RADIANS})
    pitch = Smooth(values, period, derivatives=2, degree=5)
    if pitch.end < scene.run.duration * (1 - 1e-9):
        raise InputError(scene.file, "effects.prescribed_pitch.file", p.file,
                         f"ends at {pitch.end:g} s, but the run lasts {scene.run.duration:g} s: shorten run.duration")
    assert assembly.input is not None
    guided = assembly.with_input("pitch", Stacked((assembly.input, pitch)))
    start = pitch.at(0.0)
    guided.initial[[3, 7]] = start[:2]
    return guided
