"""Readings of a sensor: a channel of a run, sampled at the sensor's sampling times and constant in between; and files
of such samples."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.assumptions import Assumption
from models.core.errors import InputError
from models.core.noise import normal_samples
from models.core.result import Result
from models.core.steps import dividing_step, step_divides
from models.core.time_series import write_time_series
from models.engines.catalogue import CATALOGUE
from models.systems.pitch_plane.assumptions import watch_function
from models.systems.pitch_plane.scene import Scene

SEED_FIELD = Field(0, ge=0, lt=2**64, description="whole number that names the noise")
PATH_FIELD = Field(0, ge=0, lt=2**64, description="number of the path within an ensemble of this seed")
"""Fields of an effect's table for the seed of its noise and the number of its noise path."""
INSTANT_TOLERANCE = 1e-6
"""Largest distance of a row's time from a sampling time, divided by the sampling period."""
NO_ROW_AT_SAMPLE_TEXT = (
    "each sample needs a row of the run: use an integrator of fixed steps, which must divide the sampling period"
)


def check_rate(scene: Scene, key_path: str, sampling_rate: float) -> None:
    """Raise InputError, before a run, for a sampling rate (Hz) whose sampling times are not at time steps of every
    engine.
    """
    if CATALOGUE["exudyn"][str(scene.settings("exudyn").integrator)].adaptive:
        raise InputError(scene.file, key_path, sampling_rate, NO_ROW_AT_SAMPLE_TEXT)
    for engine in CATALOGUE:
        step = float(scene.settings(engine).step or 0)
        if not step_divides(step, 1 / sampling_rate):
            allowed = (
                f"its period {1 / sampling_rate:g} s must be a multiple of {engine}'s step {step:g} s; use a step of "
                f"{dividing_step(step, 1 / sampling_rate)} s or another rate"
            )
            raise InputError(scene.file, key_path, sampling_rate, allowed)


def check_end(scene: Scene, key_path: str, input_path: str, end_time: float) -> None:
    """Raise InputError for an input file that ends at ``end_time`` (s), before the end of the run."""
    length = scene.run.duration
    if end_time < length * (1 - 1e-9):
        from models.core.time_series import wrong_time_unit_hint

        remedy = f"shorten run.duration{wrong_time_unit_hint(end_time, length)}"
        allowed = f"ends at {end_time:g} s, but the run lasts {length:g} s: {remedy}"
        raise InputError(scene.file, key_path, input_path, allowed)


def instant_numbers(row_times: np.ndarray, sampling_rate: float) -> np.ndarray:
    """Index of the sensor's last sampling time at or before each of the times (n,) in s; rate in Hz."""
    return np.floor(row_times * sampling_rate + INSTANT_TOLERANCE).astype(np.int64)


def sample_and_hold(
    row_times: np.ndarray, exact_values: np.ndarray, sampling_rate: float, scene: Scene, key_path: str
) -> np.ndarray:
    """Sample-and-hold of values (n,): for each row the value at the sensor's last sampling time at or before it.

    Raises InputError where a run has no row at a sampling time, as with engines that choose their own steps.
    """
    number = instant_numbers(row_times, sampling_rate)
    row = np.searchsorted(row_times, (number - INSTANT_TOLERANCE) / sampling_rate)
    if np.abs(row_times[row] * sampling_rate - number).max() > INSTANT_TOLERANCE:
        raise InputError(scene.file, key_path, sampling_rate, NO_ROW_AT_SAMPLE_TEXT)
    return exact_values[row]


def noisy_reading(
    sensor_parameters: Any,
    noise_stream: int,
    row_times: np.ndarray,
    exact_values: np.ndarray,
    scene: Scene,
    key_path: str,
) -> np.ndarray:
    """Sample-and-hold of values (n,) with white noise on each sample; ``sensor_parameters`` has sampling_rate,
    deviation, seed and path.
    """
    number = instant_numbers(row_times, sensor_parameters.sampling_rate)
    noise = (
        sensor_parameters.deviation
        * normal_samples(
            sensor_parameters.seed, sensor_parameters.path, int(number[-1]) + 1, 1, noise_source=noise_stream
        )[:, 0]
    )
    return sample_and_hold(row_times, exact_values, sensor_parameters.sampling_rate, scene, key_path) + noise[number]


def within_range(
    effect_name: str, channel_by_sensor: Mapping[str, str], channel_unit: str, sensor_range: float
) -> Assumption:
    """Assumption that readings of a sensor stay within its range; ``channel_by_sensor`` : channel of the run by sensor
    name.
    """
    says, remedy = (
        f"{effect_name}: readings are within the sensor's range",
        f"take one of a larger effects.{effect_name}.range",
    )
    return Assumption(
        f"{effect_name} in range",
        says,
        remedy,
        watch_function(**channel_by_sensor),
        channel_unit,
        -sensor_range,
        sensor_range,
    )


def write_samples(
    result: Result, channel_by_column: Mapping[str, str], sampling_rate: float, output_path: Path
) -> None:
    """Write samples of a result at a rate (Hz) to a file that other effects read; ``channel_by_column`` : channel of
    the result by column name.

    Raises InputError where the result's rows are not equally spaced at a whole part of the sampling period.
    """
    spacing = float(result.times[1] - result.times[0])
    if not step_divides(spacing, 1 / sampling_rate) or not np.allclose(
        np.diff(result.times), spacing, rtol=INSTANT_TOLERANCE, atol=0
    ):
        raise InputError(
            output_path,
            "sampling rate",
            sampling_rate,
            f"the result's rows, {spacing:g} s apart, do not fit its period",
        )
    stride = round(1 / (sampling_rate * spacing))
    rows = {
        name: (result.data[channel].attrs["units"], result[channel][::stride])
        for name, channel in channel_by_column.items()
    }
    write_time_series(output_path, rows, 1 / sampling_rate)
