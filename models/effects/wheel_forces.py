"""Wheel forces prescribed from a file (eq. 37): the vehicle is cut off the road."""

from typing import Any, Literal

from pydantic import Field

from models.assembly import Assembly
from models.errors import InputError
from models.signals import Interpolation, sampled
from models.strict import Strict
from models.tables import NEWTONS

EXCLUDES = ("road",)
COST = "one force per wheel, read from a table; no tyre"
EXAMPLE = {"file": "forces.csv", "interpolation": "held"}
COUNTS = {"exudyn": {"callbacks": 3}}
"""Two forces stand in the place of two tyres. Held ones take one callback before each of Exudyn's steps beside one per
wheel, and none in MuJoCo."""


class Parameters(Strict):
    """[effects.wheel_forces]."""

    file: str = Field(description="CSV with the columns time [s], front [N], rear [N]; forces up on the wheels")
    interpolation: Interpolation = Field(description="held, linear or smooth between the samples")
    frame: Literal["inertial", "body"] = Field("inertial", description="axis of the forces: vertical, or the chassis'")


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The vehicle without tyres, driven by the two forces."""
    from models.time_series import read_time_series

    scene = assembly.scene
    columns = {"front": NEWTONS, "rear": NEWTONS}
    values, period = read_time_series(scene.path(p.file, "effects.wheel_forces.file"), columns)
    signal = sampled(values, period, p.interpolation)
    if signal.end < scene.run.duration * (1 - 1e-9):
        raise InputError(scene.file, "effects.wheel_forces.file", p.file,
                         f"ends at {signal.end:g} s, but the run lasts {scene.run.duration:g} s: shorten run.duration")
    turns = p.frame == "body" and assembly.vehicle.geometry == "exact"
    return assembly.without_tyres().with_input("force-body" if turns else "force", signal)
