"""Two measured tracks of a road: their spectra and coherency, with confidence bands.

Densities are two-sided over the wavenumber in rad/m, by Welch's method: Hann windows that overlap by half, a straight
line taken from each. With K windows a density is chi-square distributed with about nu = 2 K / (1 + (1 - 1/K) / 18)
degrees of freedom (Welch 1967; neighbours share 1/36 of their power's variance).
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.road.csv_road import read_csv_tracks
from models.road.opencrg import TRACK_WIDTH, read_opencrg

WELCH_WINDOWS = 8
"""Count of windows into which a road is divided unless a window length is given."""


@dataclass(frozen=True)
class MeasuredTracks:
    """Heights (m, **up**) of the left and right track of a road, (n,) each, every ``increment`` m; the tracks lie at y
    = +- half_track (m)."""

    left: np.ndarray
    right: np.ndarray
    increment: float
    half_track: float
    name: str

    @property
    def length(self) -> float:
        """Distance from the first to the last station, m."""
        return (len(self.left) - 1) * self.increment


@dataclass(frozen=True)
class TrackSpectra:
    """Two-sided spectral densities of two tracks over ``wavenumber`` (rad/m, above 0): tracks, mean and roll process,
    cross densities.

    left, right, mean and the complex ``cross`` (left with right) in m^3, roll in m; ``mean_roll`` in m^2 is 0 for
    the road of mean and roll process. ``degrees_of_freedom``: degrees of freedom of every density.
    """

    wavenumber: np.ndarray
    left: np.ndarray
    right: np.ndarray
    cross: np.ndarray
    mean: np.ndarray
    roll: np.ndarray
    mean_roll: np.ndarray
    window_count: int
    degrees_of_freedom: float

    @property
    def coherency(self) -> np.ndarray:
        """Coherency |S_lr| / sqrt(S_l S_r) of left and right track, biased up: pure chance gives about sqrt(2 /
        degrees_of_freedom)."""
        return np.abs(self.cross) / np.sqrt(self.left * self.right)

    def confidence_factors(self, probability: float = 0.95) -> tuple[float, float]:
        """Factors by which to multiply a density to get the ends of its confidence interval at a probability."""
        from scipy.stats import chi2

        low, high = chi2.ppf([(1.0 - probability) / 2.0, (1.0 + probability) / 2.0], self.degrees_of_freedom)
        return self.degrees_of_freedom / high, self.degrees_of_freedom / low

    def chance_coherency(self, probability: float = 0.95) -> float:
        """Coherency that two unrelated tracks exceed by chance only with probability 1 - ``probability``."""
        independent = self.degrees_of_freedom / 2.0
        return math.sqrt(1.0 - (1.0 - probability) ** (1.0 / (independent - 1.0)))


def read_tracks(
    road_path: str | Path,
    track_width: float = TRACK_WIDTH,
    *,
    lateral_offset: float = 0.0,
    first_station: float | None = None,
    last_station: float | None = None,
) -> MeasuredTracks:
    """Left and right track of an OpenCRG or CSV road, from ``first_station`` to ``last_station`` (m along the road).

    track_width : m between the tracks; a CSV file does not tell it. lateral_offset : m, of their middle, to the left;
    OpenCRG only. Heights between unevenly spaced stations come from the reader's spline, at the smallest spacing.

    Raises
    ------
    InputError : as the readers; a file of another kind; a section that is not on the road; no width
    """
    if not (math.isfinite(track_width) and track_width > 0.0):
        raise InputError(road_path, "track_width", track_width, "must be above 0, in m")
    suffix = Path(road_path).suffix.lower()
    if suffix == ".csv":
        left, right = read_csv_tracks(road_path)
    elif suffix == ".crg":
        left, right = (
            read_opencrg(road_path, side, lateral_offset=lateral_offset, track_width=track_width)
            for side in ("left", "right")
        )
    else:
        raise InputError(road_path, "", None, "must be a road in OpenCRG (.crg) or in CSV (.csv)")
    start, end = (
        (left.start if first_station is None else first_station),
        (left.end if last_station is None else last_station),
    )
    if not left.start <= start < end <= left.end:
        raise InputError(road_path, "section (m)", (start, end), f"must lie between {left.start:g} and {left.end:g}")
    step = left.finest
    count = math.floor((end - start) / step * (1.0 + 1e-12)) + 1
    heights_up = [-track.sample_uniform(start, step, count)[0] for track in (left, right)]
    return MeasuredTracks(heights_up[0], heights_up[1], step, track_width / 2.0, Path(road_path).name)


def track_spectra(measured_tracks: MeasuredTracks, window_length: float | None = None) -> TrackSpectra:
    """Spectral densities of two tracks by Welch's method; ``window_length`` in m, by default such that eight windows
    fit.

    Raises InputError for windows of fewer than 16 stations or fewer than two of them: no density at all.
    """
    count = len(measured_tracks.left)
    wanted = 2.0 * measured_tracks.length / (WELCH_WINDOWS + 1) if window_length is None else window_length
    size = math.floor(wanted / measured_tracks.increment + 1e-9)
    windows = (count - size // 2) // (size - size // 2) if size >= 16 else 0
    if windows < 2:
        allowed = f"two windows or more must fit on the {measured_tracks.length:g} m, each of 16 stations or more"
        raise InputError(measured_tracks.name, "window_length (m)", wanted, allowed)
    b = measured_tracks.half_track

    def density(first_signal: np.ndarray, second_signal: np.ndarray) -> np.ndarray:
        from scipy.signal import csd

        n, cross_density = csd(
            first_signal, second_signal, 1.0 / measured_tracks.increment, "hann", size, size // 2, detrend="linear"
        )
        inner = (n > 0.0) & (n < n[-1])  # the ends stand once where all others stand for +- n
        return np.asarray(cross_density[inner] / (4.0 * math.pi))  # one-sided over n, to two-sided over 2 pi n

    left, right = (
        density(measured_tracks.left, measured_tracks.left).real,
        density(measured_tracks.right, measured_tracks.right).real,
    )
    cross = density(measured_tracks.left, measured_tracks.right)
    wavenumber = 2.0 * math.pi / (size * measured_tracks.increment) * np.arange(1, len(left) + 1)
    mean, roll = (left + right + 2.0 * cross.real) / 4.0, (left + right - 2.0 * cross.real) / (4.0 * b**2)
    mean_roll = (left - right - 2j * cross.imag) / (4.0 * b)
    freedom = 2.0 * windows / (1.0 + (1.0 - 1.0 / windows) / 18.0)
    return TrackSpectra(wavenumber, left, right, cross, mean, roll, mean_roll, windows, freedom)
