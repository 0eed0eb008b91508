"""A bias of the gyro, with a constant turn-on part and a slow first-order Gauss-Markov instability.

The grade of an inertial unit, 0.001 to 10 degrees per hour, is a statement on this bias, not on its white noise.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import Field

from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly, Channels
from models.sensors.inertial_unit import DEGREES_PER_HOUR, bias_path
from models.systems.pitch_plane.effects.gyro import Gyro
from models.systems.pitch_plane.sampling import PATH_FIELD, instant_numbers

NEEDS = ("gyro",)
COST = "one filter over the gyro's samples after the run; no state in any engine"
EXAMPLE = {"turn_on": 1.0}
COUNTS = {"all": {"channels": 1}}

CHANNELS = ("gyro_bias",)


class Parameters(Strict):
    """[effects.gyro_bias]: standard deviations of turn-on bias and bias instability, and correlation time."""

    turn_on: float = quantity("deg/h", "standard deviation of the part that is drawn once and stays", zero=True)
    instability: float = quantity("deg/h", "standard deviation of the part that wanders", default=0.0, zero=True)
    correlation_time: float = quantity("s", "time in which the wandering part forgets itself", default=300.0)
    seed: int = Field(0, ge=0, lt=2**64, description="whole number that names the bias")
    path: int = PATH_FIELD


@dataclass(frozen=True)
class BiasedGyro:
    """Function that computes the reading of a gyro with a bias on its samples."""

    gyro: Gyro
    parameters: Any

    def __call__(self, vehicle_assembly: Assembly, times: np.ndarray, states: np.ndarray) -> Channels:
        """Returns the channels ``gyro``, the reading with its bias, and ``gyro_bias``, the bias alone (both rad/s)."""
        p, rate = self.parameters, self.gyro.parameters.sampling_rate
        unit, meaning, read = self.gyro(vehicle_assembly, times, states)["gyro"]
        number = instant_numbers(times, rate)
        drift = bias_path(
            int(number[-1]) + 1,
            1 / rate,
            p.turn_on * DEGREES_PER_HOUR,
            p.instability * DEGREES_PER_HOUR,
            p.correlation_time,
            p.seed,
            p.path,
        )[number]
        return {"gyro": (unit, meaning, read + drift), "gyro_bias": ("rad/s", "bias of the gyro", drift)}


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with its gyro replaced by a gyro with a bias."""
    biased = tuple(
        BiasedGyro(output, parameters) if isinstance(output, Gyro) else output for output in vehicle_assembly.outputs
    )
    return replace(vehicle_assembly, outputs=biased)
