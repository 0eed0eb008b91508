"""Problem B with a fixed noise file: the same vehicle and forces, with the error of a sensor on every sample.

The noise is one file for all: no sampling error enters, and what differs is the integrator. An engineer reads the
forces of the suspension, which the measured wheel forces do not tell.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from models.core.noise import normal
from models.core.signals import Sampled
from models.engines.assembly import Assembly, Trajectory
from models.systems.pitch_plane.run import outputs
from validation.price.problems import force_excited
from validation.price.problems.force_excited import PERIOD, ForceExcited

SEED, DEVIATION = 77, 100.0
"""Of the noise; its standard deviation, N."""


class NoisyForces(ForceExcited):
    """The problem with its reference; see ``validation.price.problems.Problem``."""

    key = "noise"
    note = f"The forces carry the noise of one fixed file, {DEVIATION:g} N on every sample at 100 Hz."
    tolerances: tuple[float, ...] = (100.0, 10.0, 1.0, 0.1, 0.01)
    what = "driven by noisy wheel forces"

    def __init__(self, quick: bool) -> None:
        super().__init__(quick, ("suspension force", "N"))

    def driven(self) -> Assembly:
        """The vehicle driven by forces with noise on them."""
        clean = force_excited.driven()
        assert isinstance(clean.input, Sampled)
        noise = DEVIATION * normal(SEED, 0, *clean.input.values.shape)
        return replace(clean, input=Sampled(clean.input.values + noise, PERIOD, held=False))

    def read(self, run: Trajectory) -> dict[str, np.ndarray]:
        """Both suspension forces, and states."""
        found = outputs(self.assembly, run)
        return {"suspension force": np.column_stack([found[name][2] for name in ("f3", "f4")]), "state": run.states}


@cache
def problem(quick: bool) -> NoisyForces:
    """The problem, its reference computed once per process."""
    return NoisyForces(quick)
