"""Readings of a sensor: a channel of a run, sampled at the sensor's instants and constant in between, and written as a
file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.assumptions import Assumption
from models.core.errors import InputError
from models.core.noise import normal_samples
from models.core.result import Result
from models.core.steps import divides, dividing_step
from models.core.time_series import write_time_series
from models.engines.catalogue import CATALOGUE
from models.systems.pitch_plane.assumptions import watch_function
from models.systems.pitch_plane.scene import Scene

SEED = Field(0, ge=0, lt=2**64, description="whole number that names the noise")
PATH = Field(0, ge=0, lt=2**64, description="number of the path within an ensemble of this seed")
INSTANT_TOLERANCE = 1e-6
"""Part of a period by which a row may lie beside its instant; a run's times are whole numbers of steps."""
NO_ROW = "each sample needs a row of the run: use an integrator of fixed steps, which must divide the sampling period"


def check_rate(scene: Scene, key_path: str, rate: float) -> None:
    """Refuse, before a run, a sampling rate whose sampling times are not at steps of an engine."""
    if CATALOGUE["exudyn"][str(scene.settings("exudyn").integrator)].adaptive:
        raise InputError(scene.file, key_path, rate, NO_ROW)
    for engine in CATALOGUE:
        step = float(scene.settings(engine).step or 0)
        if not divides(step, 1 / rate):
            allowed = (
                f"its period {1 / rate:g} s must be a multiple of {engine}'s step {step:g} s; use a step of "
                f"{dividing_step(step, 1 / rate)} s or another rate"
            )
            raise InputError(scene.file, key_path, rate, allowed)


def check_end(scene: Scene, key_path: str, file: str, end_time: float) -> None:
    """Refuse a file whose data end at a time ``end_time`` (s) before the run does."""
    length = scene.run.duration
    if end_time < length * (1 - 1e-9):
        from models.core.time_series import wrong_time_unit_hint

        remedy = f"shorten run.duration{wrong_time_unit_hint(end_time, length)}"
        allowed = f"ends at {end_time:g} s, but the run lasts {length:g} s: {remedy}"
        raise InputError(scene.file, key_path, file, allowed)


def instant_numbers(times: np.ndarray, rate: float) -> np.ndarray:
    """Number (n,) of the sensor's last sampling time at or before each of the times (n,) in s."""
    return np.floor(times * rate + INSTANT_TOLERANCE).astype(np.int64)


def read_samples(times: np.ndarray, values: np.ndarray, rate: float, scene: Scene, key_path: str) -> np.ndarray:
    """Values (n,) held by a sensor: for each row the value at the last sampling time at or before it.

    Raises InputError where a run has no row at an instant, as runs have whose engine picks its own rows.
    """
    number = instant_numbers(times, rate)
    row = np.searchsorted(times, (number - INSTANT_TOLERANCE) / rate)
    if np.abs(times[row] * rate - number).max() > INSTANT_TOLERANCE:
        raise InputError(scene.file, key_path, rate, NO_ROW)
    return values[row]


def noisy_reading(
    p: Any, source: int, times: np.ndarray, values: np.ndarray, scene: Scene, key_path: str
) -> np.ndarray:
    """The sampled reading with white noise on each sample; ``p`` has sampling_rate, deviation, seed and path."""
    number = instant_numbers(times, p.sampling_rate)
    noise = p.deviation * normal_samples(p.seed, p.path, int(number[-1]) + 1, 1, source=source)[:, 0]
    return read_samples(times, values, p.sampling_rate, scene, key_path) + noise[number]


def within_range(effect: str, channels: Mapping[str, str], unit: str, sensor_range: float) -> Assumption:
    """Assumption that a sensor stays within its range; ``channels`` gives the run's channel for each name of a
    sensor.
    """
    says, remedy = f"{effect}: readings are within the sensor's range", f"take one of a larger effects.{effect}.range"
    return Assumption(f"{effect} in range", says, remedy, watch_function(**channels), unit, -sensor_range, sensor_range)


def write(result: Result, columns: Mapping[str, str], rate: float, path: Path) -> None:
    """Write samples to a file that other effects read; ``columns`` gives the result's channel for each name of a
    column.

    Raises InputError where the result's rows are not equally spaced at a whole part of the sampling period.
    """
    spacing = float(result.times[1] - result.times[0])
    if not divides(spacing, 1 / rate) or not np.allclose(
        np.diff(result.times), spacing, rtol=INSTANT_TOLERANCE, atol=0
    ):
        raise InputError(path, "sampling rate", rate, f"the result's rows, {spacing:g} s apart, do not fit its period")
    stride = round(1 / (rate * spacing))
    rows = {name: (result.data[channel].attrs["units"], result[channel][::stride]) for name, channel in columns.items()}
    write_time_series(path, rows, 1 / rate)
