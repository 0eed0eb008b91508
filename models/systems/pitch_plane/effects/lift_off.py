"""Tyres that only push, so that a wheel may leave the road; the paper's linear tyre would pull.

A tyre of stiffness k (N/m) and damping d (N s/m) that is compressed by e (m, the static deflection included) has

    F = max(0, min(k e + d e', 2 k e)).

While |d e'| <= k e this is the paper's tyre, k e + d e'. The cut at 0 is that of tyre models in time (such as TMeasy,
Rill, Road Vehicle Dynamics). A cut at 0 alone would push across the gap below a falling wheel, and a damper that began
at contact would jump to d e'. So the damper comes in with the depth, as in the function IMPACT of Adams and in Hunt and
Crossley (J. Appl. Mech. 42, 1975): it is never stronger than the spring, which outgrows it after about d / k seconds
whatever the speed of touch-down. It takes energy and never gives any.

F is continuous and has corners. A fixed step across one errs by the square of its length, whatever its method's order.
"""

from dataclasses import replace
from typing import Any

from models.core.strict import Strict
from models.engines.assembly import Assembly

EXCLUDES = ("wheel_forces",)
WHY = "there is no tyre where wheel forces are prescribed"
COST = "the tyres' native springs give way to a law of their own, compiled in MuJoCo and in Python in Exudyn"
EXAMPLE: dict[str, float] = {}
COUNTS = {"exudyn": {"callbacks": 2}, "mujoco": {"native items": -2, "callbacks": 1}}


class Parameters(Strict):
    """[effects.lift_off]: no settings."""


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with tyres that only push."""
    struts = tuple(replace(strut, pushes_only=strut.lower.body is None) for strut in vehicle_assembly.vehicle.struts)
    return replace(vehicle_assembly, vehicle=replace(vehicle_assembly.vehicle, struts=struts))
