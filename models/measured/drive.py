"""Measured drive of a vehicle: steer angle and speed at even times, without spikes."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.measured.curve import channel_curve
from models.measured.formats import open_source
from models.measured.outliers import without_outliers

DRIVE_CHANNELS = {"steer": "rad", "speed": "m/s"}
"""Channels of a measured drive, with their units."""
LEAST_SPEED = 2.0
"""Least speed (m/s) of a drive, since slip angles are ratios to the speed."""
FEWEST_DRIVE_SAMPLES = 16
"""Least number of samples of a drive."""


@dataclass(frozen=True, eq=False)
class MeasuredDrive:
    """A measured drive. times (n,) : s, even; steer (n,) rad; speed (n,) m/s; left_out : number of samples of each
    channel that were spikes or not measured, and are replaced by straight lines."""

    times: np.ndarray
    steer: np.ndarray
    speed: np.ndarray
    left_out: dict[str, int]


def read_drive(drive_path: Path, time_interval: tuple[float, ...] = ()) -> MeasuredDrive:
    """The drive in a file, or in a time interval (s, s) of it; raises InputError if the file holds no drive."""
    return _read_drive(drive_path, time_interval, drive_path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _read_drive(drive_path: Path, time_interval: tuple[float, ...], modification_time: int) -> MeasuredDrive:
    """The drive in a file, cached until the file changes (``modification_time``: time of its last change)."""
    source = open_source(drive_path)
    read = {name: channel_curve(source, name, unit) for name, unit in DRIVE_CHANNELS.items()}
    first = max(times[0] for times, _ in read.values())
    last = min(times[-1] for times, _ in read.values())
    begin, end = time_interval or (first, last)
    period = float(np.median(np.diff(read["steer"][0])))
    if not (first - period <= begin < end <= last + period):
        allowed = f"must rise and lie within the file's time, from {first:g} to {last:g} s"
        raise InputError(drive_path, "drive.stretch", [begin, end], allowed)
    grid = begin + period * np.arange(int((min(end, last) - begin) / period + 1e-6) + 1)
    if len(grid) < FEWEST_DRIVE_SAMPLES:
        raise InputError(drive_path, "rows", len(grid), f"a drive needs at least {FEWEST_DRIVE_SAMPLES} samples")
    values, left_out = dict[str, np.ndarray](), dict[str, int]()
    for name, (times, raw) in read.items():
        values[name], left_out[name] = on_even_grid(times, raw, grid, f"{drive_path}, {name}")
    slow = int(values["speed"].argmin())
    if values["speed"][slow] < LEAST_SPEED:
        allowed = f"at {grid[slow]:g} s: a drive needs at least {LEAST_SPEED:g} m/s, forward, throughout"
        raise InputError(drive_path, "speed", float(values["speed"][slow]), allowed)
    return MeasuredDrive(grid, values["steer"], values["speed"], left_out)


def on_even_grid(
    times: np.ndarray, values: np.ndarray, even_times: np.ndarray, error_place: str
) -> tuple[np.ndarray, int]:
    """Values (n,) on an even time grid, with straight lines across spikes and gaps, and the number of samples left
    out."""
    cleaned = without_outliers(values)
    known = np.isfinite(cleaned)
    if known.sum() < FEWEST_DRIVE_SAMPLES:
        raise InputError(error_place, "", int(known.sum()), f"at least {FEWEST_DRIVE_SAMPLES} samples must be measured")
    return np.interp(even_times, times[known], cleaned[known]), int(len(cleaned) - known.sum())
