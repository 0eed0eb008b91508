"""A gyro that reads the chassis' pitch rate: white noise on each sample, so a random walk of the angle.

It is read only, and feeds nothing back. Between its samples the reading is held.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.core.noise import GYRO
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly, Channels
from models.systems.pitch_plane.sampling import PATH, SEED, check_rate, noisy_reading, within_range

COST = "one reading after the run; no state in any engine"
EXAMPLE = {"sampling_rate": 200.0, "deviation": 0.1}
COUNTS = {"all": {"channels": 1}}

CHANNELS = ("gyro",)
USUAL_RANGE = 35.0
"""rad/s, 2000 deg/s: the largest range of most micromechanical gyros."""
PLACE = "effects.gyro.sampling_rate"


class Parameters(Strict):
    """Keys of the scene's table [effects.gyro].. Random walk of the angle: deviation / sqrt(sampling_rate), in rad per
    sqrt(s)."""

    sampling_rate: float = quantity("Hz", "samples per second; the run's steps must divide its period")
    deviation: float = quantity("rad/s", "standard deviation of each sample", zero=True)
    range: float | None = quantity(
        "rad/s", "largest rate that it reads; 35, as of most, where none is given", default=None
    )
    seed: int = SEED
    path: int = PATH


@dataclass(frozen=True)
class Gyro:
    """Output of a run that gives the reading of the gyro."""

    parameters: Any

    def __call__(self, assembly: Assembly, times: np.ndarray, states: np.ndarray) -> Channels:
        """Channel ``gyro`` (rad/s), the gyro's reading of the pitch rate, positive nose up."""
        reading = noisy_reading(self.parameters, GYRO, times, states[:, 7], assembly.scene, PLACE)
        return {"gyro": ("rad/s", "pitch rate as a gyro reads it, nose up", reading)}


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The assembly with a gyro's reading among its results."""
    check_rate(assembly.scene, PLACE, p.sampling_rate)
    range_assumption = within_range("gyro", {"gyro": "gyro"}, "rad/s", p.range or USUAL_RANGE)
    return replace(
        assembly, outputs=(*assembly.outputs, Gyro(p)), assumptions=(*assembly.assumptions, range_assumption)
    )
