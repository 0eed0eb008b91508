"""White measurement noise on the samples of the wheel forces, drawn before the run.

It belongs to the samples and their rate, never to the integrator's step: the same seed gives the same
forces in every engine and at every step.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import Field

from models.assembly import Assembly
from models.signals import Sampled, Smooth
from models.strict import Strict, quantity

NEEDS = ("wheel_forces",)
EXCLUDES = ("road",)
AFTER = ("wheel_forces",)
COST = "nothing during the run: the samples are drawn before it"


class Parameters(Strict):
    """[effects.force_noise]."""

    deviation: float = quantity("N", "standard deviation of each sample", zero=True)
    seed: int = Field(0, ge=0, lt=2**128, description="whole number that names the noise")


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The assembly with noise on both forces."""
    signal = assembly.input
    assert isinstance(signal, Sampled | Smooth)
    noisy = signal.values + noise(signal.values.shape, p.deviation, p.seed)
    return replace(assembly, input=replace(signal, values=noisy))


def noise(shape: tuple[int, ...], deviation: float, seed: int) -> np.ndarray:
    """Gaussian samples (n, 2) in N from a counter-based stream that the seed names."""
    return deviation * np.random.Generator(np.random.Philox(key=seed)).standard_normal(shape)
