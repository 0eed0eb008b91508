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


def check_rate(scene: Scene, key_path: str, rate: float) -> None:
    """Raise InputError, before a run, for a sampling rate (Hz) whose sampling times are not at time steps of every
    engine.
    """
    if CATALOGUE["exudyn"][str(scene.settings("exudyn").integrator)].adaptive:
        raise InputError(scene.file, key_path, rate, NO_ROW_AT_SAMPLE_TEXT)
    for engine in CATALOGUE:
        step = float(scene.settings(engine).step or 0)
        if not step_divides(step, 1 / rate):
            allowed = (
                f"its period {1 / rate:g} s must be a multiple of {engine}'s step {step:g} s; use a step of "
                f"{dividing_step(step, 1 / rate)} s or another rate"
            )
            raise InputError(scene.file, key_path, rate, allowed)


def check_end(scene: Scene, key_path: str, file: str, end_time: float) -> None:
    """Raise InputError for an input file that ends at ``end_time`` (s), before the end of the run."""
    length = scene.run.duration
    if end_time < length * (1 - 1e-9):
        from models.core.time_series import wrong_time_unit_hint

        remedy = f"shorten run.duration{wrong_time_unit_hint(end_time, length)}"
        allowed = f"ends at {end_time:g} s, but the run lasts {length:g} s: {remedy}"
        raise InputError(scene.file, key_path, file, allowed)


def instant_numbers(times: np.ndarray, rate: float) -> np.ndarray:
    """Index of the sensor's last sampling time at or before each of the times (n,) in s; rate in Hz."""
    return np.floor(times * rate + INSTANT_TOLERANCE).astype(np.int64)


def read_samples(times: np.ndarray, values: np.ndarray, rate: float, scene: Scene, key_path: str) -> np.ndarray:
    """Sample-and-hold of values (n,): for each row the value at the sensor's last sampling time at or before it.

    Raises InputError where a run has no row at a sampling time, as with engines that choose their own steps.
    """
    number = instant_numbers(times, rate)
    row = np.searchsorted(times, (number - INSTANT_TOLERANCE) / rate)
    if np.abs(times[row] * rate - number).max() > INSTANT_TOLERANCE:
        raise InputError(scene.file, key_path, rate, NO_ROW_AT_SAMPLE_TEXT)
    return values[row]


def noisy_reading(
    p: Any, source: int, times: np.ndarray, values: np.ndarray, scene: Scene, key_path: str
) -> np.ndarray:
    """Sample-and-hold of values (n,) with white noise on each sample; ``p`` has sampling_rate, deviation, seed and
    path.
    """
    number = instant_numbers(times, p.sampling_rate)
    noise = p.deviation * normal_samples(p.seed, p.path, int(number[-1]) + 1, 1, noise_source=source)[:, 0]
    return read_samples(times, values, p.sampling_rate, scene, key_path) + noise[number]


def within_range(effect: str, channels: Mapping[str, str], unit: str, sensor_range: float) -> Assumption:
    """Assumption that readings of a sensor stay within its range; ``channels`` : channel of the run by sensor name."""
    says, remedy = f"{effect}: readings are within the sensor's range", f"take one of a larger effects.{effect}.range"
    return Assumption(f"{effect} in range", says, remedy, watch_function(**channels), unit, -sensor_range, sensor_range)


def write(result: Result, columns: Mapping[str, str], rate: float, path: Path) -> None:
    """Write samples of a result at a rate (Hz) to a file that other effects read; ``columns`` : channel of the result
    by column name.

    Raises InputError where the result's rows are not equally spaced at a whole part of the sampling period.
    """
    spacing = float(result.times[1] - result.times[0])
    if not step_divides(spacing, 1 / rate) or not np.allclose(
        np.diff(result.times), spacing, rtol=INSTANT_TOLERANCE, atol=0
    ):
        raise InputError(path, "sampling rate", rate, f"the result's rows, {spacing:g} s apart, do not fit its period")
    stride = round(1 / (rate * spacing))
    rows = {name: (result.data[channel].attrs["units"], result[channel][::stride]) for name, channel in columns.items()}
    write_time_series(path, rows, 1 / rate)
