"""Integrators that each engine offers, and their properties, known before an engine is imported."""

from dataclasses import dataclass
from typing import Literal

Nodes = Literal["start", "half-steps", "any"]
"""Times within a step at which an integrator reads its input."""


@dataclass(frozen=True)
class Integrator:
    """Properties of one time integrator.

    order : of its global error; nodes : when within a step it reads the input; adaptive : picks its own
    steps; constraints : gives correct moments of a prescribed pitch; holds : takes a held sample as constant
    over its step (Newmark methods blend it with the one before it, half a step late).
    """

    order: int
    nodes: Nodes = "half-steps"
    adaptive: bool = False
    constraints: bool = False
    holds: bool = True


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
        "VelocityVerlet": Integrator(1, holds=False),
        "GeneralizedAlpha": Integrator(2, constraints=True, holds=False),
        "TrapezoidalIndex2": Integrator(2, holds=False),
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

UNAVAILABLE_INTEGRATORS = {("exudyn", "DVERK6"): "DVERK6 is named but not implemented in Exudyn; use DOPRI5 or RK67"}
"""Integrators that an engine names but does not have, with the message to a user who chooses one."""

ADAPTIVE = {
    engine: tuple(
        name for name, known in methods.items() if known.adaptive and (engine, name) not in UNAVAILABLE_INTEGRATORS
    )
    for engine, methods in CATALOGUE.items()
    if any(known.adaptive for known in methods.values())
}
"""Integrators that choose their own steps, by engine."""

OUTSIDE_CLASSES: dict[str, type] = {}
"""Registered engine and integrator classes from files outside the tree, by their names ``module:Class`` (see
outside.py)."""

RECOMMENDED = {"reference": "RK4", "exudyn": "RK44", "mujoco": "RK4"}
"""Recommended integrator of each engine."""
DEFAULT_METHODS = {"exudyn": "GeneralizedAlpha", "mujoco": "Euler"}
"""Integrator that an engine uses by default (Exudyn 1.13, MuJoCo 4)."""
