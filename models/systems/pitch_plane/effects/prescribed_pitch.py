"""Pitch prescribed from a file (eq. 39): the vehicle is guided, and the moment that this takes is a result.

A measured pitch is differentiated twice: white noise of 0.1 degrees at 1 kHz would take 1e6 N m. ``bandwidth``
smooths it before.
"""

from typing import Any

from pydantic import Field

from models.core.strict import Strict, quantity
from models.core.tables import RADIANS
from models.engines.assembly import Assembly

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
    """[effects.prescribed_pitch]."""

    file: str = Field(description="CSV with the columns time [s], pitch [rad]; positive nose up")
    bandwidth: float | None = quantity("Hz", "a measured pitch is smoothed down to this before use", default=None)


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The force-excited vehicle with its pitch as an input, twice differentiable by a quintic spline."""
    from models.systems.pitch_plane.prescribed import prescribe

    return prescribe(assembly, "prescribed_pitch", p, "pitch", {"pitch": RADIANS})
