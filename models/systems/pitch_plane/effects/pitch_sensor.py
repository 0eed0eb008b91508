"""A sensor that reads the chassis' pitch with white noise on each sample, as an inertial unit does.

It has no effect on the motion. Between samples the reading is constant.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from models.core.noise import PITCH_SENSOR
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly, Channels
from models.systems.pitch_plane.sampling import PATH_FIELD, SEED_FIELD, check_rate, noisy_reading

COST = "one reading after the run; no state in any engine"
EXAMPLE = {"sampling_rate": 200.0, "deviation": 0.01}
COUNTS = {"all": {"channels": 1}}

CHANNELS = ("pitch_reading",)
RATE_KEY = "effects.pitch_sensor.sampling_rate"


class Parameters(Strict):
    """[effects.pitch_sensor]: sampling rate and noise of the sensor."""

    sampling_rate: float = quantity("Hz", "samples per second; the run's steps must divide its period")
    deviation: float = quantity("rad", "standard deviation of each sample", zero=True)
    seed: int = SEED_FIELD
    path: int = PATH_FIELD


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with the sensor's reading of the pitch among its channels."""
    check_rate(vehicle_assembly.scene, RATE_KEY, parameters.sampling_rate)
    return replace(vehicle_assembly, outputs=(*vehicle_assembly.outputs, partial(pitch_reading, parameters)))


def pitch_reading(
    sensor_parameters: Any, vehicle_assembly: Assembly, times: np.ndarray, states: np.ndarray
) -> Channels:
    """Returns the channel ``pitch_reading``: the sensor's reading of the pitch (rad), positive nose up."""
    reading = noisy_reading(sensor_parameters, PITCH_SENSOR, times, states[:, 3], vehicle_assembly.scene, RATE_KEY)
    return {"pitch_reading": ("rad", "pitch as a sensor reads it, nose up", reading)}
