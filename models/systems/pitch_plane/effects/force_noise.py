"""White measurement noise on the samples of the wheel forces, drawn before the run.

It belongs to the samples and their rate, never to the integrator's step: the same seed gives the same
forces in every engine and at every step.
"""

from dataclasses import replace
from typing import Any

from models.core.noise import normal_samples
from models.core.signals import SampledSignal, Smooth
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly
from models.systems.pitch_plane.sampling import PATH_FIELD, SEED_FIELD

NEEDS = ("wheel_forces",)
EXCLUDES = ("road",)
COST = "nothing during the run: the samples are drawn before it"
EXAMPLE = {"deviation": 8.0}


class Parameters(Strict):
    """[effects.force_noise]: standard deviation of the noise, its seed and its path."""

    deviation: float = quantity("N", "standard deviation of each sample", zero=True)
    seed: int = SEED_FIELD
    path: int = PATH_FIELD


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with noise added to both wheel forces."""
    signal = vehicle_assembly.input
    assert isinstance(signal, SampledSignal | Smooth)
    noisy = signal.values + parameters.deviation * normal_samples(
        parameters.seed, parameters.path, len(signal.values), 2
    )
    return replace(vehicle_assembly, input=replace(signal, values=noisy))
