"""A gyro that reads the chassis' pitch rate with white noise on each sample, so a random walk of the angle.

It has no effect on the motion. Between samples the reading is constant.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.core.noise import GYRO
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly, Channels
from models.systems.pitch_plane.sampling import PATH_FIELD, SEED_FIELD, check_rate, noisy_reading, within_range

COST = "one reading after the run; no state in any engine"
EXAMPLE = {"sampling_rate": 200.0, "deviation": 0.1}
COUNTS = {"all": {"channels": 1}}

CHANNELS = ("gyro",)
USUAL_RANGE = 35.0
"""Usual range (rad/s) of a gyro: 2000 deg/s, the largest of most micromechanical ones."""
RATE_KEY = "effects.gyro.sampling_rate"


class Parameters(Strict):
    """[effects.gyro]: sampling rate, noise and range. The angle's random walk is deviation / sqrt(sampling_rate), in
    rad per sqrt(s)."""

    sampling_rate: float = quantity("Hz", "samples per second; the run's steps must divide its period")
    deviation: float = quantity("rad/s", "standard deviation of each sample", zero=True)
    range: float | None = quantity(
        "rad/s", "largest rate that it reads; 35, as of most, where none is given", default=None
    )
    seed: int = SEED_FIELD
    path: int = PATH_FIELD


@dataclass(frozen=True)
class Gyro:
    """Function that computes the reading of the gyro over a run."""

    parameters: Any

    def __call__(self, vehicle_assembly: Assembly, times: np.ndarray, states: np.ndarray) -> Channels:
        """Returns the channel ``gyro``: the gyro's reading of the pitch rate (rad/s), positive nose up."""
        reading = noisy_reading(self.parameters, GYRO, times, states[:, 7], vehicle_assembly.scene, RATE_KEY)
        return {"gyro": ("rad/s", "pitch rate as a gyro reads it, nose up", reading)}


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with a gyro's reading among its channels."""
    check_rate(vehicle_assembly.scene, RATE_KEY, parameters.sampling_rate)
    range_assumption = within_range("gyro", {"gyro": "gyro"}, "rad/s", parameters.range or USUAL_RANGE)
    return replace(
        vehicle_assembly,
        outputs=(*vehicle_assembly.outputs, Gyro(parameters)),
        assumptions=(*vehicle_assembly.assumptions, range_assumption),
    )
