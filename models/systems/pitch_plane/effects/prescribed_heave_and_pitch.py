"""Heave and pitch of the chassis prescribed from a file, by an enforced force and moment.

The enforced force and moment show errors of the model. With true motion and true wheel forces, a chassis that is too
light by dm takes a mean force dm g (down), and a centre of mass that lies x too far forward a mean moment m3 g x (nose
up).
"""

from typing import Any

from pydantic import Field

from models.core.strict import Strict, quantity
from models.core.tables import METRES, RADIANS
from models.engines.assembly import Assembly

NEEDS = ("wheel_forces",)
EXCLUDES = ("pitch_spring", "prescribed_pitch")
AFTER = ("wheel_forces", "force_noise")
COST = "two constraints in Exudyn; two degrees of freedom less and an inverse-dynamics pass in MuJoCo"
EXAMPLE = {"file": "motion.csv"}
BESIDE = {"wheel_forces": {"file": "forces.csv", "interpolation": "linear"}}
COUNTS = {
    "reference": {"degrees of freedom": -2},
    "exudyn": {"native items": 2, "callbacks": 4},
    "mujoco": {"degrees of freedom": -2},
    "all": {"channels": 3},
}


class Parameters(Strict):
    """[effects.prescribed_heave_and_pitch]: file of the motion, and bandwidth to which it is smoothed."""

    file: str = Field(description="CSV with the columns time [s], z3 [m], pitch [rad]; positive down and nose up")
    bandwidth: float | None = quantity("Hz", "a measured motion is smoothed down to this before use", default=None)


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the force-excited vehicle with heave and pitch of the chassis prescribed, twice differentiable."""
    from models.systems.pitch_plane.effects.prescribed_pitch import prescribe

    columns = {"z3": METRES, "pitch": RADIANS}
    return prescribe(vehicle_assembly, "prescribed_heave_and_pitch", parameters, "heave-pitch", columns)
