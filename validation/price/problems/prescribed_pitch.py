"""Problem C: the force-excited vehicle with its pitch prescribed, as measured on the road, and the moment that this
takes.

Forces and pitch are those of the study road at 100 Hz, the pitch as a quintic spline: twice differentiable, and the
same for all. A constraint is solved by Exudyn's generalised-alpha alone, whose multiplier needs a radius below one;
MuJoCo and the reference have the reduced model, in which the pitch is an input.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from models.core.signals import Sampled, Smooth, Stacked
from models.engines.assembly import Assembly, Settings, Trajectory
from models.engines.protocol import build
from models.systems.pitch_plane.scene import assemble
from validation.price.problems.force_excited import DURATION, MS, PERIOD, STEPS, ForceExcited
from validation.price.problems.force_excited import driven as by_forces
from validation.price.problems.road_excited import scene

CHOSEN = {
    ("reference", "RK4"): STEPS,
    ("exudyn", "GeneralizedAlpha 0.9"): (10 * MS, *STEPS),
    ("exudyn", "GeneralizedAlpha 0.6"): (10 * MS, *STEPS),
    ("exudyn", "RK44"): (1 * MS,),
    ("mujoco", "RK4"): STEPS[:-2],
    ("mujoco", "Euler"): STEPS[:-2],
    ("mujoco", "implicit"): STEPS[:-2],
    ("mujoco", "implicitfast"): STEPS[:-2],
    ("mujoco", "discrete"): STEPS[:-2],
}
"""RK44 is there to be refused: it does not solve for a prescribed pitch. MuJoCo calls Python in every step."""


class PrescribedPitch(ForceExcited):
    """The problem with its reference; see ``validation.price.problems.Problem``."""

    key = "pitch"
    note = "The moment of Exudyn is a multiplier, that of the others follows from the reduced model."
    tolerances: tuple[float, ...] = (100.0, 10.0, 1.0, 0.1, 0.01)
    what = "driven by its wheel forces, pitch prescribed"

    def __init__(self, quick: bool) -> None:
        super().__init__(quick, ("enforced moment", "N m"))

    def chosen(self, quick: bool) -> dict[tuple[str, str], tuple[float, ...]]:
        """Steps (s) of every method."""
        return CHOSEN

    def driven(self) -> Assembly:
        """The vehicle with forces and pitch as inputs, on the pitch at the start."""
        forces = by_forces()
        assert isinstance(forces.input, Sampled)
        run = build("reference", assemble(scene(DURATION)), Settings("RK4", PERIOD / 80, DURATION)).run()
        pitch = Smooth(run.states[::80, 3, None], PERIOD, derivatives=2, degree=5)
        guided = replace(forces, initial=forces.initial.copy()).with_input("pitch", Stacked((forces.input, pitch)))
        guided.initial[[3, 7]] = pitch.at(0.0)[:2]
        return guided

    def read(self, run: Trajectory) -> dict[str, np.ndarray]:
        """Moment and states."""
        assert run.moment is not None
        return {"enforced moment": run.moment, "state": run.states}


@cache
def problem(quick: bool) -> PrescribedPitch:
    """The problem, its reference computed once per process."""
    return PrescribedPitch(quick)
