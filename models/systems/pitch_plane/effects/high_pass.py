"""The paper's high-pass filter against drift, which removes slow pitch during the run.

Integrating the pitch acceleration through a second-order high-pass, s^2 / (s^2 + 2 zeta wc s + wc^2) in place of
1, is algebraically a rotational spring and damper to the ground. The inertia that it works against is that of the
chassis with the wheels on its arms, I + J (``models.drift.growth.rigid_pitch``): pitch drift moves the wheels along.
"""

from typing import Any

from models.core.strict import Strict, quantity
from models.drift.growth import pitch_spring
from models.engines.assembly import Assembly
from models.vehicles.description import PitchSpring

NEEDS = ("wheel_forces",)
EXCLUDES = ("pitch_spring", "prescribed_pitch", "prescribed_heave_and_pitch")
COST = "one native spring-damper"
EXAMPLE = {"cut_off": 0.5}
COUNTS = {"exudyn": {"native items": 1}, "mujoco": {"native items": 1}}


class Parameters(Strict):
    """[effects.high_pass]: cut-off frequency and damping ratio of the high-pass."""

    cut_off: float = quantity("Hz", "pitch slower than this is taken for drift")
    damping_ratio: float = quantity("1", "damping ratio of the high-pass", default=0.7, zero=True)


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the force-excited vehicle with the rotational spring and damper to the ground that are equivalent to the
    high-pass.
    """
    return vehicle_assembly.with_spring(
        PitchSpring("chassis", *pitch_spring(vehicle_assembly.parameters, parameters.cut_off, parameters.damping_ratio))
    )
