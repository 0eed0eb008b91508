"""White measurement noise on the samples of the wheel forces, drawn before the run.

It belongs to the samples and their rate, never to the integrator's step: the same seed gives the same
forces in every engine and at every step.
"""

from dataclasses import replace
from typing import Any

from pydantic import Field

from models.core.noise import normal
from models.core.signals import Sampled, Smooth
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly

NEEDS = ("wheel_forces",)
EXCLUDES = ("road",)
COST = "nothing during the run: the samples are drawn before it"
EXAMPLE = {"deviation": 8.0}


class Parameters(Strict):
    """[effects.force_noise]."""

    deviation: float = quantity("N", "standard deviation of each sample", zero=True)
    seed: int = Field(0, ge=0, lt=2**64, description="whole number that names the noise")
    path: int = Field(0, ge=0, lt=2**64, description="number of the path within an ensemble of this seed")


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The assembly with noise on both forces."""
    signal = assembly.input
    assert isinstance(signal, Sampled | Smooth)
    noisy = signal.values + p.deviation * normal(p.seed, p.path, len(signal.values), 2)
    return replace(assembly, input=replace(signal, values=noisy))
