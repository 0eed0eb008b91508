"""A rotational spring and damper between chassis and ground, the usual remedy against drift."""

from typing import Any

from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly
from models.vehicles.description import PitchSpring

EXCLUDES = ("prescribed_pitch", "prescribed_heave_and_pitch")
COST = "one native spring-damper; with a dead band a law of its own, compiled in MuJoCo and in Python in Exudyn"
EXAMPLE = {"stiffness": 2e4, "damping": 1e3}
COUNTS = {"exudyn": {"native items": 1}, "mujoco": {"native items": 1}}


class Parameters(Strict):
    """[effects.pitch_spring]: stiffness, damping and dead band of the spring."""

    stiffness: float = quantity("N m/rad", "rotational stiffness to the ground")
    damping: float = quantity("N m s/rad", "rotational damping to the ground", default=0.0, zero=True)
    dead_band: float = quantity("rad", "no moment within this pitch to either side of zero", default=0.0, zero=True)


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with a rotational spring and damper between chassis and ground."""
    return vehicle_assembly.with_spring(
        PitchSpring("chassis", parameters.stiffness, parameters.damping, parameters.dead_band)
    )
