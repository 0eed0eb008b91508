"""Resampling to an even clock: linear interpolation of slower signals, and a low-pass without phase for faster ones."""

import numpy as np

from models.measured.timing import EVEN_CLOCK_DEVIATION_SHARE, LEAST_GAP_PERIODS

PASS_BAND, STOP_BAND, STOP_ATTENUATION = 0.4, 0.5, 60.0
"""Edges of the low-pass in ratio to the new sampling rate: passed up to the first, attenuated (dB) from the second
on."""
EQUAL_RATE_RATIO = 1e-6
"""Relative difference up to which two sampling rates count as equal."""


def resample_to(times: np.ndarray, values: np.ndarray, source_period: float, new_times: np.ndarray) -> np.ndarray:
    """Values (n,) of a signal resampled to the times (n,) in s of an even grid.

    times (m,) : s, strictly rising, mostly ``source_period`` apart; values (m,) : NaN where nothing was measured. NaN
    wherever two samples more than 1.5 periods apart lie around a point, and outside.
    """
    known = np.isfinite(values)
    if np.count_nonzero(known) < 2:
        return np.full(len(new_times), np.nan)
    times, values = times[known], values[known]
    new = float(new_times[1] - new_times[0]) if len(new_times) > 1 else source_period
    if source_period < new * (1.0 - EQUAL_RATE_RATIO):
        samples = _decimated_values(times, values, source_period, new, new_times)
    else:
        samples = np.interp(new_times, times, values)
    samples[_unknown_points(times, source_period, new_times)] = np.nan
    return samples


def _unknown_points(times: np.ndarray, source_period: float, new_times: np.ndarray) -> np.ndarray:
    """Which points (n,) of the grid lie in a gap or outside the measurement, with a tolerance for rounding."""
    right = np.clip(np.searchsorted(times, new_times), 1, len(times) - 1)
    near = (
        np.minimum(np.abs(new_times - times[right - 1]), np.abs(times[right] - new_times))
        <= EVEN_CLOCK_DEVIATION_SHARE * source_period
    )
    wide = times[right] - times[right - 1] > LEAST_GAP_PERIODS * source_period
    return ((new_times < times[0]) | (new_times > times[-1]) | wide) & ~near


def _decimated_values(
    times: np.ndarray, samples: np.ndarray, source_period: float, new_period: float, new_times: np.ndarray
) -> np.ndarray:
    """Values at the times of a slower grid: filtered by a symmetric low-pass kernel, which adds no phase, then
    interpolated by a cubic spline."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import firwin, kaiserord, oaconvolve

    count = round((times[-1] - times[0]) / source_period) + 1
    even = times[0] + source_period * np.arange(count)
    nyquist, rate = 0.5 / source_period, 1.0 / new_period
    taps, beta = kaiserord(STOP_ATTENUATION, (STOP_BAND - PASS_BAND) * rate / nyquist)
    kernel = firwin(taps | 1, 0.5 * (PASS_BAND + STOP_BAND) * rate, window=("kaiser", beta), fs=2.0 * nyquist)
    reach = min(len(kernel) // 2, count - 1)
    padded = np.pad(np.interp(even, times, samples), reach, mode="reflect", reflect_type="odd")
    padded = np.pad(padded, len(kernel) // 2 - reach, mode="edge")
    return np.asarray(CubicSpline(even, oaconvolve(padded, kernel, mode="valid"))(new_times))
