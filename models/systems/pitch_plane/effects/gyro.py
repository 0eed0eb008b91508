"""A gyro that reads the chassis' pitch rate: white noise on each sample, so a random walk of the angle.

It is read only, and feeds nothing back. Between its samples the reading is held.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import Field

from models.core.noise import GYRO, normal
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly
from models.systems.pitch_plane.sampling import check_rate, numbers, read

COST = "one reading after the run; no state in any engine"
EXAMPLE = {"sampling_rate": 200.0, "deviation": 0.1}
COUNTS = {"all": {"channels": 1}}

Channels = dict[str, tuple[str, str, np.ndarray]]
"""Name -> unit, meaning, values."""
CHANNELS = ("gyro",)
PLACE = "effects.gyro.sampling_rate"


class Parameters(Strict):
    """[effects.gyro]. Random walk of the angle: deviation / sqrt(sampling_rate), in rad per sqrt(s)."""

    sampling_rate: float = quantity("Hz", "samples per second; the run's steps must divide its period")
    deviation: float = quantity("rad/s", "standard deviation of each sample", zero=True)
    seed: int = Field(0, ge=0, lt=2**64, description="whole number that names the noise")
    path: int = Field(0, ge=0, lt=2**64, description="number of the path within an ensemble of this seed")


@dataclass(frozen=True)
class Gyro:
    """The gyro as an output of the run."""

    parameters: Any

    def __call__(self, assembly: Assembly, times: np.ndarray, states: np.ndarray) -> Channels:
        """Channel ``gyro`` (rad/s), nose up positive."""
        p = self.parameters
        true = read(times, states[:, 7], p.sampling_rate, assembly.scene, PLACE)
        number = numbers(times, p.sampling_rate)
        noise = p.deviation * normal(p.seed, p.path, int(number[-1]) + 1, 1, source=GYRO)[:, 0]
        return {"gyro": ("rad/s", "pitch rate as a gyro reads it, nose up", true + noise[number])}


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The assembly with a gyro among its results."""
    check_rate(assembly.scene, PLACE, p.sampling_rate)
    return replace(assembly, outputs=(*assembly.outputs, Gyro(p)))
