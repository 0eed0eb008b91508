"""Which integrators each engine offers, and what is known of each before an engine is imported."""

from dataclasses import dataclass
from typing import Literal

Nodes = Literal["start", "half-steps", "any"]


@dataclass(frozen=True)
class Integrator:
    """order : of its global error; nodes : when within a step it reads the input; adaptive : picks its steps;
    constraints : gives correct multipliers of a prescribed motion; compliant : stiff-stable (no step limit)."""

    order: int
    nodes: Nodes = "half-steps"
    adaptive: bool = False
    constraints: bool = False


CATALOGUE: dict[str, dict[str, Integrator]] = {
    "reference": {
        "RK4": Integrator(4, constraints=True),
        "DOP853": Integrator(8, "any", adaptive=True, constraints=True),
        "Radau": Integrator(5, "any", adaptive=True, constraints=True),
        "LSODA": Integrator(12, "any", adaptive=True, constraints=True),
    },
    "exudyn": {
        "RK44": Integrator(4),
        "RK67": Integrator(6, "any"),
        "RK33": Integrator(3, "any"),
        "ExplicitMidpoint": Integrator(2),
        "ExplicitEuler": Integrator(1),
        "VelocityVerlet": Integrator(1),
        "GeneralizedAlpha": Integrator(2, constraints=True),
        "TrapezoidalIndex2": Integrator(2),
        "DOPRI5": Integrator(5, "any", adaptive=True),
        "DVERK6": Integrator(6, "any", adaptive=True),
        "ODE23": Integrator(3, "any", adaptive=True),
    },
    "mujoco": {
        "RK4": Integrator(4, constraints=True),
        "Euler": Integrator(1, constraints=True),
        "implicit": Integrator(1, constraints=True),
        "implicitfast": Integrator(1, constraints=True),
        "discrete": Integrator(1, constraints=True),
    },
}
"""Constrained MuJoCo and reference runs use the reduced model, in which the pitch is an input."""

MISSING = {("exudyn", "DVERK6"): "DVERK6 is named but not implemented in Exudyn; use DOPRI5 or RK67"}
"""Integrators that an engine names and does not have, with what to say to who asks for one."""

RECOMMENDED = {"reference": "RK4", "exudyn": "RK44", "mujoco": "RK4"}
DEFAULT = {"exudyn": "GeneralizedAlpha", "mujoco": "Euler"}
"""What an engine does if it is not told otherwise (Exudyn 1.13, MuJoCo 4)."""
