"""Measured chamber pressures that brake the vehicle open loop, and measured wheel speeds for comparison.

A table has ``time`` and ``pressure_NAME`` of every wheel; it may also have ``speed_NAME`` of every wheel. The names are
those of ``wheel_names``. It begins at time 0, when the brake is applied; between its rows pressures are linear.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.brake.controller import LARGEST_PRESSURE, SAMPLING_PERIOD, Command, Sample
from models.core.errors import InputError
from models.core.tables import SECONDS, read_table, write_table

FACTOR_TO_BAR = {"bar": 1.0, "Pa": 1e-5, "kPa": 1e-2, "MPa": 10.0}
FACTOR_TO_METRES_PER_SECOND = {"m/s": 1.0, "km/h": 1.0 / 3.6}
"""Units of pressures and speeds that files may have, with their factors to bar and m/s."""
FASTEST_WHEEL_SPEED = 150.0
"""Largest circumferential speed (m/s) of a wheel that a file may have."""


def wheel_names(wheel_count: int) -> tuple[str, ...]:
    """Names of the wheels in files: fl, fr, rl, rr for four wheels; 1l, 1r, 2l and so on for another number."""
    axles = ("f", "r") if wheel_count == 4 else tuple(str(axle + 1) for axle in range((wheel_count + 1) // 2))
    return tuple(axles[i // 2] + "lr"[i % 2] for i in range(wheel_count))


@dataclass(frozen=True, eq=False)
class MeasuredPressures:
    """A controller that ignores the wheel speeds and commands measured pressures, averaged over each sample.

    times (n,) : s, rising from 0; pressures (n, W) : bar; speeds (n, W) : circumferential speeds of the wheels (m/s),
    None if they were not measured. After the last row the last pressures stay.
    """

    times: np.ndarray
    pressures: np.ndarray
    speeds: np.ndarray | None = None
    period: float = SAMPLING_PERIOD

    def sample(self, sample: Sample) -> Command:
        """Returns the command of a sample: the means (W,) of the measured pressures over the sample."""
        start, end = sample.time * 1e-9, sample.time * 1e-9 + self.period
        times_within = self.times[(self.times > start) & (self.times < end)]
        interpolation_times = np.concatenate(([start], times_within, [end]))
        rows = np.column_stack([np.interp(interpolation_times, self.times, column) for column in self.pressures.T])
        return Command(pressures=np.trapezoid(rows, interpolation_times, axis=0) / self.period)

    def wheel_speed_error(self, times: np.ndarray, wheel_speeds: np.ndarray) -> np.ndarray:
        """Root mean square difference (W,) in m/s between computed wheel speeds (m, W) at times (m,) and the measured
        wheel speeds.

        Only the time of the measurement counts; NaN where no speeds were measured.
        """
        if self.speeds is None:
            return np.full(wheel_speeds.shape[1], np.nan)
        shared = times <= self.times[-1]
        measured = np.column_stack([np.interp(times[shared], self.times, column) for column in self.speeds.T])
        return np.sqrt(((wheel_speeds[shared] - measured) ** 2).mean(axis=0))


def read_pressures(csv_path: str | Path, wheel_count: int, sample_period: float = SAMPLING_PERIOD) -> MeasuredPressures:
    """Reads measured pressures of a number of wheels from a CSV file with units. Raises InputError for a file that
    cannot be used.
    """
    names, header = wheel_names(wheel_count), _header_line(csv_path)
    columns = {"time": SECONDS, **{f"pressure_{name}": FACTOR_TO_BAR for name in names}}
    measured = "speed" in header
    if measured:
        columns |= {f"speed_{name}": FACTOR_TO_METRES_PER_SECOND for name in names}
    table = read_table(csv_path, columns, increasing_column="time", least_row_count=2)
    if table["time"][0] != 0.0:
        raise InputError(csv_path, "time", float(table["time"][0]), "must begin at 0, when the brake is applied")
    pressures = _columns_of_wheels(csv_path, table, "pressure", names, LARGEST_PRESSURE, "bar above the air's")
    speeds = _columns_of_wheels(csv_path, table, "speed", names, FASTEST_WHEEL_SPEED, "m/s") if measured else None
    return MeasuredPressures(table["time"], pressures, speeds, sample_period)


def write_pressures(csv_path: str | Path, times: np.ndarray, pressures: np.ndarray, wheel_speeds: np.ndarray) -> None:
    """Write a run's pressures to a file for ``read_pressures``: times (n,) in s, pressures (n, W) in bar, and wheel
    speeds (n, W) in m/s."""
    names, later = wheel_names(pressures.shape[1]), np.diff(times, prepend=-1.0) > 0.0
    columns = {"time": ("s", times[later])}
    for head, unit, values in (("pressure", "bar", pressures), ("speed", "m/s", wheel_speeds)):
        columns |= {f"{head}_{name}": (unit, values[later, i]) for i, name in enumerate(names)}
    write_table(csv_path, columns)


def _columns_of_wheels(
    csv_path: str | Path,
    csv_columns: dict[str, np.ndarray],
    heading_prefix: str,
    wheel_names_in_file: tuple[str, ...],
    largest_value: float,
    unit: str,
) -> np.ndarray:
    """Returns the columns (n, W) of a quantity for all wheels. Raises InputError for a value that is not from 0 to
    ``largest_value``.
    """
    for name in wheel_names_in_file:
        column = csv_columns[f"{heading_prefix}_{name}"]
        wrong = np.flatnonzero((column < 0.0) | (column > largest_value))
        if wrong.size:
            location = f"{heading_prefix}_{name} at {csv_columns['time'][wrong[0]]:g} s"
            raise InputError(csv_path, location, float(column[wrong[0]]), f"must be from 0 to {largest_value:g} {unit}")
    return np.column_stack([csv_columns[f"{heading_prefix}_{name}"] for name in wheel_names_in_file])


def _header_line(csv_path: str | Path) -> str:
    """Returns the first line of a file that is no comment; "" if the file cannot be read, as ``read_table`` then says
    what is wrong.
    """
    try:
        lines = Path(csv_path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return ""
    return next((line for line in lines if line.strip() and not line.startswith("#")), "")
