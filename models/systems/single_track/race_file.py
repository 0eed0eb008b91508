"""Conversion of the measurement of a race car to a table that scenes read, and the car's published parameters."""

import csv
import gzip
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.smoothing import low_passed
from models.core.tables import write_table
from models.measured.outliers import without_outliers

RACE_COLUMNS = {
    "time": ("t", "s"),
    "steer": ("delta", "rad"),
    "speed": ("vx", "m/s"),
    "yaw rate": ("yawRate", "rad/s"),
    "lateral acceleration": ("ayCG", "m/s^2"),
    "side slip": ("beta_true", "rad"),
}
"""Channel name in scenes -> column and unit in the file of the race car's measurement."""
DECIMATION_FACTOR = 2
"""Decimation factor of the race car's measurement, which is low-passed at a quarter of its sampling rate first."""
RACE_CAR = {
    "vehicle": {"mass": 982.0, "front": 1.33, "rear": 1.07, "yaw_inertia": 1250.0},
    "front": {"stiffness": 15.0, "friction": 1.3, "rise": 0.03},
    "rear": {"stiffness": 19.0, "friction": 1.3, "sharpness": 3.0, "rise": 0.03},
}
"""Parameters of the race car, as scene tables. Mass and lengths are published. The others are start values of the
identification, except the rise: 3 % of the stiffness remain beyond the bend, so that a car at its limit does not spin
for a small error of its tyres."""


IDENTIFIED_PARAMETERS = (
    "vehicle.yaw_inertia=300:3000",
    "vehicle.front_brake=0:1",
    "front.stiffness=5:50",
    "front.friction=0.5:3",
    "front.sharpness=1:12",
    "front.side=-0.3:0.3",
    "front.lift=-2:2",
    "rear.stiffness=5:50",
    "rear.friction=0.5:3",
    "rear.sharpness=1:12",
    "rear.side=-0.3:0.3",
    "rear.lift=-2:2",
    "sensors.steer_offset=-0.02:0.02",
    "sensors.side_slip_offset=-0.02:0.02",
    "sensors.acceleration_offset=-1:1",
)
"""Parameters of the race car that are identified from the measurement, each as "scene key=lower:upper bound"."""


def write_plain_table(race_file_path: Path, table_path: Path) -> Path:
    """Write the race car's measurement as a table that scenes can read. Outliers are removed, columns are low-passed
    against aliasing, and one of DECIMATION_FACTOR samples is written.
    """
    raw = _raw_columns(race_file_path)
    period = float(np.median(np.diff(raw["t"])))
    columns = {name: (unit, raw[column][::DECIMATION_FACTOR]) for name, (column, unit) in RACE_COLUMNS.items()}
    for name, (column, unit) in list(RACE_COLUMNS.items())[1:]:
        cleaned = without_outliers(raw[column])
        known = np.isfinite(cleaned)
        filled = np.interp(raw["t"], raw["t"][known], cleaned[known])
        columns[name] = (
            unit,
            low_passed(filled[:, None], period, 0.25 / period, str(race_file_path), column)[::DECIMATION_FACTOR, 0],
        )
    write_table(table_path, columns)
    return table_path


def _raw_columns(race_file_path: Path) -> dict[str, np.ndarray]:
    """Read the columns of the race car's measurement, gzipped or not. Raises InputError where a column is missing or
    times do not rise.
    """
    with gzip.open(race_file_path, "rt") if race_file_path.suffix == ".gz" else race_file_path.open() as file:
        head, *rows = list(csv.reader(file))
    for column, _ in RACE_COLUMNS.values():
        if column not in head:
            raise InputError(race_file_path, column, None, "no such column in the race's file", tuple(head))
    try:
        table = np.array(rows, float)
    except ValueError as error:
        raise InputError(race_file_path, "rows", None, f"every row holds {len(head)} numbers: {error}") from None
    raw = {column: table[:, head.index(column)] for column, _ in RACE_COLUMNS.values()}
    falls = np.flatnonzero(~(np.diff(raw["t"]) > 0.0))
    if len(falls):
        raise InputError(
            race_file_path, f"t, row {falls[0] + 3}", float(raw["t"][falls[0] + 1]), "times must rise from row to row"
        )
    return raw
