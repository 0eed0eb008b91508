"""Uniformly sampled time series from CSV files, with the unit of every column in the header."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.tables import SECONDS, read_table, write_table

MISSING_VALUE_MARK = 1e28
"""Magnitude (SI units) beyond which a value is an exporter's mark for a missing one, such as 9.9E+34."""

SHORT_TIME_SHARE = 100.0
"""Ratio of the needed time to a file's time, or the reverse, beyond which the file's times may be in another unit."""
MANY_SAMPLES, WHEEL_SAMPLE_TIME, CHASSIS_SAMPLE_TIME = 1000, 0.02, 0.2
"""Number of samples, and time (s) between samples for wheel and for chassis signals, above which a record's times may
be in another unit: a wheel moves with up to 25 Hz and a chassis with up to 2.5 Hz on its springs, which longer sample
times do not show."""


def read_time_series(
    csv_path: str | Path, column_units: Mapping[str, Mapping[str, float]], *, gaps_allowed: bool = False
) -> tuple[np.ndarray, float]:
    """Values (n, columns) in SI and the sampling period (s) of a CSV file with a column ``time``.

    The first sample must lie at t = 0 and the period must be constant to 1e-6 of itself: a clock that
    jitters has to be repaired by someone who knows why. Where ``gaps_allowed`` are allowed, an empty cell or ``nan`` is
    NaN."""
    table = read_table(
        csv_path,
        {"time": SECONDS, **column_units},
        increasing_column="time",
        least_row_count=8,
        allows_gaps=gaps_allowed,
    )
    time = table["time"]
    period = (time[-1] - time[0]) / (len(time) - 1)
    if abs(time[0]) > 1e-6 * period:
        raise InputError(csv_path, "first row, column 'time'", float(time[0]), "the first sample must lie at time 0")
    _check_even(csv_path, time, period)
    for name in column_units:
        _check_marks(csv_path, name, table[name], time)
    return np.column_stack([table[name] for name in column_units]), float(f"{period:.12g}")


def wrong_time_unit_hint(file_duration: float, needed_duration: float) -> str:
    """Hint that a file's times may be in seconds, not in milliseconds as their heading says, if the file lasts (s) less
    than a hundredth of the needed time (s); else empty."""
    wrong = file_duration < needed_duration / SHORT_TIME_SHARE
    return "; if its times are in seconds, not in milliseconds, correct the unit that heads them" if wrong else ""


def sparse_record_warning(
    sample_count: int, sampling_period: float, needed_duration: float, needed_period: float = WHEEL_SAMPLE_TIME
) -> str:
    """Warning that nearly all of ``sample_count`` samples, ``sampling_period`` (s) apart, lie beyond the needed time
    (s), and are too far apart to resolve the motion (``needed_period``, s): their times may be in another unit. ""
    otherwise."""
    lasts = sampling_period * (sample_count - 1)
    if sample_count < MANY_SAMPLES or lasts < SHORT_TIME_SHARE * needed_duration or sampling_period < needed_period:
        return ""
    return (
        f"The samples lie {sampling_period:.4g} s apart and last for {lasts:.4g} s, "
        f"of which the run takes {needed_duration:.4g} s; "
        f"{'a wheel' if needed_period == WHEEL_SAMPLE_TIME else 'a chassis'} moves with up to "
        f"{0.5 / needed_period:g} Hz. If their times are in "
        "milliseconds, head the column time [ms]."
    )


def _check_marks(csv_path: str | Path, column_name: str, column_values: np.ndarray, times: np.ndarray) -> None:
    """Raise InputError for the special numbers that some exporters write for missing values."""
    marks = np.flatnonzero(np.abs(column_values) > MISSING_VALUE_MARK)
    if len(marks):
        raise InputError(
            csv_path,
            f"column {column_name!r} at {times[marks[0]]:g} s",
            float(column_values[marks[0]]),
            "is an exporter's "
            f"mark for no value ({len(marks)} of {len(column_values)} samples are): mend the file, or leave "
            "such times out",
        )


def _check_even(csv_path: str | Path, times: np.ndarray, sampling_period: float) -> None:
    """Raise InputError for times with jitter or missing samples, at the first row where this shows."""
    slack = 1e-6 * sampling_period + 1e-12 * times[-1]
    if np.abs(times - sampling_period * np.arange(len(times))).max() <= slack:
        return
    usual = float(np.median(np.diff(times)))  # one gap moves the mean period, and with it every row
    row = 1 + int(np.argmax(np.abs(np.diff(times) - usual) > slack))
    raise InputError(
        csv_path,
        f"row {row + 1} of the numbers, column 'time' (s)",
        float(f"{times[row]:.12g}"),
        f"the samples must be equally spaced: {times[row - 1] + usual:.9g} is expected here, {usual:.9g} "
        "after the row before it",
    )


def write_time_series(
    csv_path: str | Path, column_units: Mapping[str, tuple[str, np.ndarray]], sampling_period: float
) -> None:
    """Write a CSV file of columns name -> (unit, values), shape (n,) each, with a column of times at the sampling
    ``sampling_period`` (s)."""
    count = len(next(iter(column_units.values()))[1])
    write_table(csv_path, {"time": ("s", sampling_period * np.arange(count)), **column_units})
