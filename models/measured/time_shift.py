"""Time shift between a measurement and a run, by cross-correlation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

LEAST_OVERLAP_SHARE = 0.5
"""Least overlap of run and measurement, as a share of the shorter one: larger shifts match by chance."""
SEARCH_GRID_SAMPLE_LIMIT = 2**18
"""Most samples of the time grid on which shifts are searched."""
CONSTANT_VARIANCE = 1e-9
"""Ratio of a channel's variance to its mean square below which it is constant and shows no shift."""
SHIFT_RESOLUTION = 1e-4
"""Resolution of the refined shift, in steps of the search grid."""


@dataclass(frozen=True)
class ChannelPair:
    """The same channel in a run (n,) and in a measurement (m,), NaN where nothing was measured; times in s, values in
    the same unit."""

    run_times: np.ndarray
    run_values: np.ndarray
    measured_times: np.ndarray
    measured_values: np.ndarray


@dataclass(frozen=True)
class TimeShift:
    """Time shift between run and measurement. seconds : time on the measurement's clock at the run's time 0;
    correlation : mean over the channels that vary, at best 1; NaN where none varies and the shift is 0."""

    seconds: float
    correlation: float


def time_shift(channel_pairs: Sequence[ChannelPair]) -> TimeShift:
    """Time shift at which the channels of run and measurement correlate best, with a resolution finer than a sample.
    Means and scales do not matter."""
    moving = [
        pair for pair in channel_pairs if _signal_varies(pair.run_values) and _signal_varies(pair.measured_values)
    ]
    if not moving:
        return TimeShift(0.0, np.nan)
    step = _search_step(moving)
    coarse = _coarse_shift(moving, step)
    return _refined_shift(moving, coarse, step)


def _signal_varies(channel_values: np.ndarray) -> bool:
    """Whether the finite values of a channel are not constant."""
    finite = channel_values[np.isfinite(channel_values)]
    return bool(len(finite) > 2 and np.var(finite) > CONSTANT_VARIANCE * np.mean(finite**2))


def _search_step(channel_pairs: Sequence[ChannelPair]) -> float:
    """Step (s) of the search grid: that of the finer clock, unless the grid would become too long."""
    clocks = [times for pair in channel_pairs for times in (pair.run_times, pair.measured_times)]
    finest = min(float(np.median(np.diff(times))) for times in clocks)
    longest = max(float(times[-1] - times[0]) for times in clocks)
    return max(finest, longest / SEARCH_GRID_SAMPLE_LIMIT)


def _coarse_shift(channel_pairs: Sequence[ChannelPair], grid_step: float) -> float:
    """Shift (s) with the largest mean correlation, among those that differ from the two starts' difference by whole
    steps."""
    first = min(float(pair.run_times[0]) for pair in channel_pairs)
    begin = min(float(pair.measured_times[0]) for pair in channel_pairs)
    scores = [_correlations(*_on_grid(pair, first, begin, grid_step)) for pair in channel_pairs]
    length = min(map(len, scores))
    before = len(_even_grid(channel_pairs[0].run_times, first, grid_step)) - 1
    return begin - first + grid_step * (int(np.argmax(sum(score[:length] for score in scores))) - before)


def _even_grid(times: np.ndarray, first_time: float, grid_step: float) -> np.ndarray:
    """Even time grid (s) from ``first_time`` to the last of the times."""
    return first_time + grid_step * np.arange(int((times[-1] - first_time) / grid_step) + 1)


def _on_grid(
    channel_pair: ChannelPair, run_start: float, measurement_start: float, grid_step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The run's values (n,), the measurement's values (m,), and whether they were measured (m,), on even time grids
    that begin at the two starts (s)."""
    grid, run_grid, measured = (
        _even_grid(channel_pair.measured_times, measurement_start, grid_step),
        _even_grid(channel_pair.run_times, run_start, grid_step),
        np.isfinite(channel_pair.measured_values),
    )
    is_measured = np.interp(grid, channel_pair.measured_times, measured.astype(float), left=0.0, right=0.0) > 1.0 - 1e-6
    values = np.interp(grid, channel_pair.measured_times[measured], channel_pair.measured_values[measured])
    return (
        np.interp(run_grid, channel_pair.run_times, channel_pair.run_values),
        np.where(is_measured, values, 0.0),
        is_measured,
    )


def _correlations(run_values: np.ndarray, measured_values: np.ndarray, is_measured: np.ndarray) -> np.ndarray:
    """Correlation (n + m - 1,) of run and measurement at every lag from 1 - n on; -1 where they overlap too little."""
    from scipy.signal import correlate

    def lagged_sums(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return correlate(a, b, mode="full", method="fft")

    x, mask = (run_values - run_values.mean()) / run_values.std(), is_measured.astype(float)
    y = (
        np.where(is_measured, measured_values - measured_values[is_measured].mean(), 0.0)
        / measured_values[is_measured].std()
    )
    ones, count = np.ones(len(x)), lagged_sums(mask, np.ones(len(x)))
    sums, means = lagged_sums(mask, x), lagged_sums(y, ones)
    safe = np.maximum(count, 1.0)
    spread = (lagged_sums(mask, x**2) - sums**2 / safe) * (lagged_sums(y**2, ones) - means**2 / safe)
    enough = (count >= LEAST_OVERLAP_SHARE * min(len(x), mask.sum())) & (spread > (1e-6 * safe) ** 2)
    likeness = (lagged_sums(y, x) - sums * means / safe) / np.sqrt(np.where(enough, spread, 1.0))
    return np.where(enough, likeness, -1.0)


def _refined_shift(channel_pairs: Sequence[ChannelPair], coarse_shift: float, grid_step: float) -> TimeShift:
    """Time shift with the largest mean correlation within one step of a coarse shift; the run is interpolated by
    splines."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    curves = [(pair, CubicSpline(pair.run_times, pair.run_values)) for pair in channel_pairs]

    def negative_correlation(seconds: float) -> float:
        return -float(np.mean([_correlation_at_shift(pair, curve, seconds) for pair, curve in curves]))

    best = minimize_scalar(
        negative_correlation,
        bounds=(coarse_shift - grid_step, coarse_shift + grid_step),
        method="bounded",
        options={"xatol": SHIFT_RESOLUTION * grid_step},
    )
    seconds = float(best.x) if best.fun <= negative_correlation(coarse_shift) else coarse_shift
    return TimeShift(seconds, -negative_correlation(seconds))


def _correlation_at_shift(
    channel_pair: ChannelPair, run_spline: Callable[[np.ndarray], np.ndarray], seconds: float
) -> float:
    """Correlation of one channel of run and measurement at a shift (s)."""
    times = channel_pair.measured_times - seconds
    inside = (
        np.isfinite(channel_pair.measured_values)
        & (times >= channel_pair.run_times[0])
        & (times <= channel_pair.run_times[-1])
    )
    if np.count_nonzero(inside) < 3:
        return -1.0
    pairs = np.array([channel_pair.measured_values[inside], run_spline(times[inside])])
    spread = pairs.std(axis=1)
    return float(np.corrcoef(pairs)[0, 1]) if spread.min() > 0.0 else -1.0
