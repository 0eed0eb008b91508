"""Measured weave eigenvalues of a bicycle: decaying sinusoids fitted to the lean rate in windows of free decay.

A folder holds ``windows.csv`` (file, speed of the treadmill in m/s, first and last sample of a window) and for each
``file`` a recording whose name ends in ``_{file}kph.csv`` or ``.csv.gz``, sampled at 100 Hz, with columns ``lean_rate``
and ``fork_rate`` (rad/s) and ``speed`` (m/s).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from models.core.errors import InputError

SAMPLING_RATE = 100.0
"""Samples per second of the recordings."""
SHORTEST_WINDOW = 20
"""Least number of samples in a window of free decay."""
FIT_STARTS = [(decay, frequency) for decay in (-1.0, -3.0, -6.0) for frequency in (4.0, 7.0, 10.0)]
"""Start values of the fits: real part (1/s) and angular frequency (rad/s)."""
COLUMN_HEADINGS = ("lean_rate", "fork_rate", "speed")


@dataclass(frozen=True, eq=False)
class WeaveObservation:
    """Measurements of the weave in windows (n,) at one speed (m/s) of the treadmill.

    weave : eigenvalues (1/s); measured_speed : mean of the speed sensor (m/s); inverse_steer_rate : mean of |steer
    rate| by mean of its square (s/rad), by which dry friction is worth a viscous one.
    """

    speed: float
    weave: np.ndarray
    measured_speed: np.ndarray
    inverse_steer_rate: np.ndarray

    @property
    def parts(self) -> np.ndarray:
        """Measurements (n, 3) per window: real and imaginary part of the weave eigenvalue (1/s), measured speed
        (m/s).
        """
        return np.column_stack([self.weave.real, self.weave.imag, self.measured_speed])

    @property
    def mean(self) -> np.ndarray:
        """Means (3,) over the windows of the weave's real and imaginary part (1/s) and of the measured speed (m/s)."""
        return self.parts.mean(axis=0)

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations (3,) between the windows of the weave's real and imaginary part (1/s) and of the measured
        speed (m/s).
        """
        return self.parts.std(axis=0, ddof=1)


def decaying_sinusoid(rate_samples: np.ndarray, sampling_rate: float = SAMPLING_RATE) -> complex:
    """Eigenvalue s + i w (1/s) of the function e^{s t} (a cos w t + b sin w t) + c fitted to samples (n,) by least
    squares; w is not negative.
    """
    times = np.arange(len(rate_samples)) / sampling_rate

    def left(decay_and_frequency: np.ndarray) -> np.ndarray:
        swing = np.exp(decay_and_frequency[0] * times)
        basis = np.column_stack(
            [
                swing * np.cos(decay_and_frequency[1] * times),
                swing * np.sin(decay_and_frequency[1] * times),
                np.ones_like(times),
            ]
        )
        return np.asarray(rate_samples - basis @ np.linalg.lstsq(basis, rate_samples, rcond=None)[0])

    best = min(
        (least_squares(left, start, x_scale=(1.0, 3.0)) for start in FIT_STARTS), key=lambda fit: float(fit.cost)
    )
    return complex(best.x[0], abs(best.x[1]))


def read_observations(data_folder: str | Path) -> list[WeaveObservation]:
    """Observations of the weave from a folder, by ascending speed; InputError with file, position and value where it
    cannot be read.
    """
    data_folder, rows = Path(data_folder), _rows_of_windows(Path(data_folder) / "windows.csv")
    recordings = {label: _columns_of_recording(data_folder, label) for label in {row[0] for row in rows}}
    by_speed = dict[float, list[tuple[complex, float, float]]]()
    for line, (label, speed, first_sample, last_sample) in enumerate(rows, 2):
        recording = recordings[label]
        if last_sample >= len(recording["speed"]):
            allowed = f"the recording has {len(recording['speed'])} samples"
            raise InputError(data_folder / "windows.csv", f"line {line}, last sample", last_sample, allowed)
        lean, steer, sensor = (recording[name][first_sample : last_sample + 1] for name in COLUMN_HEADINGS)
        if not np.isfinite([lean, steer, sensor]).all() or not np.any(steer) or np.ptp(lean) == 0.0:
            raise InputError(
                data_folder / "windows.csv", f"line {line}", first_sample, "gaps, or no motion, in this window"
            )
        slowness = np.abs(steer).mean() / np.mean(steer**2)
        by_speed.setdefault(speed, []).append((decaying_sinusoid(lean), float(sensor.mean()), float(slowness)))
    for speed, of_speed in by_speed.items():
        if len(of_speed) < 3:
            allowed = f"has {len(of_speed)} window(s); a scatter needs 3 or more"
            raise InputError(data_folder / "windows.csv", "speed [m/s]", speed, allowed)
    return [WeaveObservation(speed, *map(np.array, zip(*by_speed[speed], strict=True))) for speed in sorted(by_speed)]


def _rows_of_windows(windows_path: Path) -> list[tuple[str, float, int, int]]:
    """Rows of the file windows.csv: label of the recording, speed (m/s), first and last sample."""
    if not windows_path.is_file():
        raise InputError(windows_path, "", None, "no such file: it lists file, speed [m/s], first and last sample")
    rows = []
    for line, text in enumerate(windows_path.read_text().splitlines()[1:], 2):
        cells = [cell.strip() for cell in text.split(",")]
        try:
            row = cells[0], float(cells[1]), int(cells[2]), int(cells[3])
        except (ValueError, IndexError):
            raise InputError(
                windows_path, f"line {line}", text, "must be: file, speed (m/s), first and last sample"
            ) from None
        if not 0.0 < row[1] < np.inf or not 0 <= row[2] <= row[3] - SHORTEST_WINDOW:
            allowed = f"needs a speed above 0 and at least {SHORTEST_WINDOW} samples from first to last"
            raise InputError(windows_path, f"line {line}", text, allowed)
        rows.append(row)
    if not rows:
        raise InputError(windows_path, "", None, "lists no window")
    return rows


def _columns_of_recording(data_folder: Path, recording_label: str) -> dict[str, np.ndarray]:
    """Columns lean rate, fork rate (rad/s) and speed (m/s) of the recording with a given label."""
    paths = sorted(
        path for path in data_folder.glob("*.csv*") if path.name.partition(".csv")[0].endswith(f"_{recording_label}kph")
    )
    if len(paths) != 1:
        allowed = f"{len(paths)} recordings end in _{recording_label}kph.csv or .csv.gz, one is needed"
        raise InputError(data_folder / "windows.csv", "file [km/h]", recording_label, allowed)
    table = np.genfromtxt(paths[0], delimiter=",", names=True, invalid_raise=False)
    names: Iterable[str] = table.dtype.names or ()
    for name in COLUMN_HEADINGS:
        if name not in names:
            raise InputError(paths[0], "header", None, f"has no column {name!r}", tuple(names))
    return {name: np.atleast_1d(table[name]) for name in COLUMN_HEADINGS}
