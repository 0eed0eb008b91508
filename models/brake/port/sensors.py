"""Sensors of the controller port, for wheel speeds and commanded pressures: gain, offset, noise and conversion to bits.

A signal x arrives as ``gain x + offset + noise``, and with ``bits`` it is converted: cut to 0 to ``range`` and rounded
to one of the 2^bits codes, of which the last is ``range``. Nothing named, nothing changes, not by a bit.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from models.brake.controller import Command, Controller, Sample
from models.brake.port.teeth import ToothCounter
from models.core.noise import BRAKE_PRESSURES, BRAKE_SIGNALS, SAMPLES_PER_BLOCK, normal_samples
from models.core.strict import Strict, quantity


class SensorConversion(Strict):
    """Conversion of a signal by its sensor; with ``bits`` it needs a ``range``."""

    gain: float = quantity("", "factor", default=1.0)
    offset: float = quantity("unit of the signal", "added", default=0.0, signed=True)
    noise: float = quantity("unit of the signal", "standard deviation of white noise", default=0.0, zero=True)
    seed: int = Field(default=0, ge=0, lt=2**64, description="of the noise")
    bits: int | None = Field(default=None, ge=1, le=32, description="of the conversion; exact without")
    range: float | None = quantity("unit of the signal", "value of the last code", default=None)

    @model_validator(mode="after")
    def _converted(self) -> "SensorConversion":
        if (self.bits is None) != (self.range is None):
            raise ValueError("bits and range are given together")
        return self


class SensorChannels:
    """Conversion of several signals by sensors, sample by sample from 0 on. source: of the noise, see
    ``models.core.noise``.
    """

    def __init__(self, conversion: SensorConversion, channel_count: int, noise_stream: int) -> None:
        self.conversion, self._count, self._source = conversion, channel_count, noise_stream
        self._block, self._noise = -1, np.zeros((0, channel_count))

    def __call__(self, sample_number: int, true_values: np.ndarray) -> np.ndarray:
        """Values (count,) of one sample after gain, offset, noise and rounding of their sensors."""
        conversion = self.conversion
        if conversion.gain != 1.0 or conversion.offset != 0.0:
            true_values = conversion.gain * true_values + conversion.offset
        if conversion.noise > 0.0:
            true_values = true_values + conversion.noise * self._drawn(sample_number)
        if conversion.bits is not None and conversion.range is not None:
            largest_code = 2.0**conversion.bits - 1.0
            true_values = (
                np.rint(np.clip(true_values / conversion.range, 0.0, 1.0) * largest_code)
                * conversion.range
                / largest_code
            )
        return true_values

    def _drawn(self, sample_number: int) -> np.ndarray:
        """Standard normal numbers (count,) for a sample's noise, taken from the block of numbers that contains them."""
        block, row_in_block = divmod(sample_number, SAMPLES_PER_BLOCK)
        if block != self._block:
            first = block * SAMPLES_PER_BLOCK
            self._block = block
            self._noise = normal_samples(self.conversion.seed, 0, SAMPLES_PER_BLOCK, self._count, first, self._source)
        return self._noise[row_in_block]


@dataclass
class SensedController:
    """A controller that receives wheel speeds through sensors, and whose pressures are measured; a new one is made for
    every run.

    tooth_counter : counts the wheels' teeth first; None: their speed is known.
    """

    controller: Controller
    wheels: SensorChannels
    pressures: SensorChannels
    tooth_counter: ToothCounter | None = None

    def sample(self, sample: Sample) -> Command:
        """The controller's command for measured signals; pressures of the command are measured, too, and cut at
        zero.
        """
        wheel_signals = sample.wheels if self.tooth_counter is None else self.tooth_counter(sample)
        command = self.controller.sample(sample._replace(wheels=self.wheels(sample.number, wheel_signals)))
        if command.pressures is None:
            return command
        return Command(pressures=np.maximum(self.pressures(sample.number, np.asarray(command.pressures)), 0.0))


def controller_behind_sensors(
    controller: Controller,
    wheel_count: int,
    speed_conversion: SensorConversion,
    pressure_conversion: SensorConversion,
    **extras: Any,
) -> SensedController:
    """A controller that receives the signals of W wheels through sensors."""
    return SensedController(
        controller,
        SensorChannels(speed_conversion, wheel_count, BRAKE_SIGNALS),
        SensorChannels(pressure_conversion, wheel_count, BRAKE_PRESSURES),
        **extras,
    )
