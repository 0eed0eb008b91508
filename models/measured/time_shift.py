"""Time shift between a measurement and a run, by cross-correlation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

LEAST_OVERLAP = 0.5
"""Least overlap of run and measurement, as a share of the shorter one: larger shifts match by chance."""
MOST_SAMPLES = 2**18
"""Most samples of the time grid on which shifts are searched."""
CONSTANT_VARIANCE = 1e-9
"""Ratio of a channel's variance to its mean square below which it is constant and shows no shift."""
SHIFT_RESOLUTION = 1e-4
"""Resolution of the refined shift, in steps of the search grid."""


@dataclass(frozen=True)
class ChannelPair:
    """The same channel in a run and in a measurement: times (n,) and values (n,) of the run, times (m,) and values (m,)
    of the measurement, NaN where nothing was measured; times in s, values in the same unit."""

    run_times: np.ndarray
    run: np.ndarray
    times: np.ndarray
    values: np.ndarray


@dataclass(frozen=True)
class TimeShift:
    """Time shift between run and measurement. seconds : time on the measurement's clock at the run's time 0;
    correlation : mean over the channels that vary, at best 1; NaN where none varies and the shift is 0."""

    seconds: float
    correlation: float


def time_shift(pairs: Sequence[ChannelPair]) -> TimeShift:
    """Time shift at which the channels of run and measurement correlate best, with a resolution finer than a sample.
    Means and scales do not matter."""
    moving = [pair for pair in pairs if _signal_varies(pair.run) and _signal_varies(pair.values)]
    if not moving:
        return TimeShift(0.0, np.nan)
    step = _search_step(moving)
    coarse = _coarse_shift(moving, step)
    return _refined_shift(moving, coarse, step)


def _signal_varies(values: np.ndarray) -> bool:
    """Whether the finite values of a channel are not constant."""
    finite = values[np.isfinite(values)]
    return bool(len(finite) > 2 and np.var(finite) > CONSTANT_VARIANCE * np.mean(finite**2))


def _search_step(pairs: Sequence[ChannelPair]) -> float:
    """Step (s) of the search grid: that of the finer clock, unless the grid would become too long."""
    clocks = [times for pair in pairs for times in (pair.run_times, pair.times)]
    finest = min(float(np.median(np.diff(times))) for times in clocks)
    longest = max(float(times[-1] - times[0]) for times in clocks)
    return max(finest, longest / MOST_SAMPLES)


def _coarse_shift(pairs: Sequence[ChannelPair], step: float) -> float:
    """Shift (s) with the largest mean correlation, among those that differ from the two starts' difference by whole
    steps."""
    first = min(float(pair.run_times[0]) for pair in pairs)
    begin = min(float(pair.times[0]) for pair in pairs)
    scores = [_correlations(*_on_grid(pair, first, begin, step)) for pair in pairs]
    length = min(map(len, scores))
    before = len(_even_grid(pairs[0].run_times, first, step)) - 1
    return begin - first + step * (int(np.argmax(sum(score[:length] for score in scores))) - before)


def _even_grid(times: np.ndarray, first: float, step: float) -> np.ndarray:
    """Even time grid (s) from ``first`` to the last of the times."""
    return first + step * np.arange(int((times[-1] - first) / step) + 1)


def _on_grid(
    channel_pair: ChannelPair, first: float, begin: float, step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The run's values (n,), the measurement's values (m,), and whether they were measured (m,), on even time grids
    that begin at the two starts (s)."""
    grid, run_grid, measured = (
        _even_grid(channel_pair.times, begin, step),
        _even_grid(channel_pair.run_times, first, step),
        np.isfinite(channel_pair.values),
    )
    is_measured = np.interp(grid, channel_pair.times, measured.astype(float), left=0.0, right=0.0) > 1.0 - 1e-6
    values = np.interp(grid, channel_pair.times[measured], channel_pair.values[measured])
    return (
        np.interp(run_grid, channel_pair.run_times, channel_pair.run),
        np.where(is_measured, values, 0.0),
        is_measured,
    )


def _correlations(run: np.ndarray, measured: np.ndarray, is_measured: np.ndarray) -> np.ndarray:
    """Correlation (n + m - 1,) of run and measurement at every lag from 1 - n on; -1 where they overlap too little."""
    from scipy.signal import correlate

    def lagged_sums(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return correlate(a, b, mode="full", method="fft")

    x, mask = (run - run.mean()) / run.std(), is_measured.astype(float)
    y = np.where(is_measured, measured - measured[is_measured].mean(), 0.0) / measured[is_measured].std()
    ones, count = np.ones(len(x)), lagged_sums(mask, np.ones(len(x)))
    sums, means = lagged_sums(mask, x), lagged_sums(y, ones)
    safe = np.maximum(count, 1.0)
    spread = (lagged_sums(mask, x**2) - sums**2 / safe) * (lagged_sums(y**2, ones) - means**2 / safe)
    enough = (count >= LEAST_OVERLAP * min(len(x), mask.sum())) & (spread > (1e-6 * safe) ** 2)
    likeness = (lagged_sums(y, x) - sums * means / safe) / np.sqrt(np.where(enough, spread, 1.0))
    return np.where(enough, likeness, -1.0)


def _refined_shift(pairs: Sequence[ChannelPair], coarse: float, step: float) -> TimeShift:
    """Time shift with the largest mean correlation within one step of a coarse shift; the run is interpolated by
    splines."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    curves = [(pair, CubicSpline(pair.run_times, pair.run)) for pair in pairs]

    def negative_correlation(seconds: float) -> float:
        return -float(np.mean([_correlation_at_shift(pair, curve, seconds) for pair, curve in curves]))

    best = minimize_scalar(
        negative_correlation,
        bounds=(coarse - step, coarse + step),
        method="bounded",
        options={"xatol": SHIFT_RESOLUTION * step},
    )
    seconds = float(best.x) if best.fun <= negative_correlation(coarse) else coarse
    return TimeShift(seconds, -negative_correlation(seconds))


def _correlation_at_shift(
    channel_pair: ChannelPair, curve: Callable[[np.ndarray], np.ndarray], seconds: float
) -> float:
    """Correlation of one channel of run and measurement at a shift (s)."""
    times = channel_pair.times - seconds
    inside = (
        np.isfinite(channel_pair.values) & (times >= channel_pair.run_times[0]) & (times <= channel_pair.run_times[-1])
    )
    if np.count_nonzero(inside) < 3:
        return -1.0
    pairs = np.array([channel_pair.values[inside], curve(times[inside])])
    spread = pairs.std(axis=1)
    return float(np.corrcoef(pairs)[0, 1]) if spread.min() > 0.0 else -1.0
