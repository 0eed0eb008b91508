"""A sensor that reads the chassis' pitch: white noise on each sample, as of an inertial unit that gives angles.

It is read only, and feeds nothing back. Between its samples the reading is held.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from models.core.noise import PITCH_SENSOR
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly, Channels
from models.systems.pitch_plane.sampling import PATH, SEED, check_rate, noisy_reading

COST = "one reading after the run; no state in any engine"
EXAMPLE = {"sampling_rate": 200.0, "deviation": 0.01}
COUNTS = {"all": {"channels": 1}}

CHANNELS = ("pitch_reading",)
PLACE = "effects.pitch_sensor.sampling_rate"


class Parameters(Strict):
    """[effects.pitch_sensor]."""

    sampling_rate: float = quantity("Hz", "samples per second; the run's steps must divide its period")
    deviation: float = quantity("rad", "standard deviation of each sample", zero=True)
    seed: int = SEED
    path: int = PATH


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The assembly with a pitch reading among its results."""
    check_rate(assembly.scene, PLACE, p.sampling_rate)
    return replace(assembly, outputs=(*assembly.outputs, partial(pitch_reading, p)))


def pitch_reading(p: Any, assembly: Assembly, times: np.ndarray, states: np.ndarray) -> Channels:
    """Channel ``pitch_reading`` (rad), a sensor's reading of the pitch, positive nose up."""
    reading = noisy_reading(p, PITCH_SENSOR, times, states[:, 3], assembly.scene, PLACE)
    return {"pitch_reading": ("rad", "pitch as a sensor reads it, nose up", reading)}
