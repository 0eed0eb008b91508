"""Input signals over time: samples held, linearly interpolated or smooth, on uniform grids or at any instant.

Every signal has ``channels`` columns and three readings: ``sample`` on a uniform grid (the tables
that engines step through), ``at`` one instant (adaptive solvers), and ``knots``, the times at which it
is not smooth, where an accurate solver must restart.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal, Protocol, get_args

import numpy as np

from models.core.errors import InputError

Interpolation = Literal["held", "linear", "smooth"]
SNAP_SHARE = 1e-6
"""Share of a sampling period within which a time counts as that of a sample."""


class Signal(Protocol):
    """Protocol of an input signal of an engine: a function of time with one or more channels."""

    @property
    def channels(self) -> int:
        """Number of channels (columns of the samples)."""
        ...

    @property
    def period(self) -> float | None:
        """Sampling period (s), None for a signal that is not made of samples."""
        ...

    @property
    def held(self) -> bool:
        """Whether the signal is constant over each sampling period."""
        ...

    @property
    def resolution(self) -> float:
        """Longest step (s) with which an adaptive solver does not miss a feature of the signal."""
        ...

    def sample(self, start_time: float, time_step: float, sample_count: int) -> np.ndarray:
        """Values at start_time + i step, shape (sample_count, channels)."""
        ...

    def at(self, time: float) -> np.ndarray:
        """Values at one time (s), shape (channels,)."""
        ...

    def knots(self, duration: float) -> np.ndarray:
        """Times inside (0, duration) at which the signal is not smooth."""
        ...


@dataclass(frozen=True)
class SampledSignal:
    """Uniformly sampled signal, held constant over each period or linear in between.

    values : shape (n, channels), the first one at t = 0; period : s.
    The nearest sample is found by rounding, never by truncating an accumulated time.
    """

    values: np.ndarray
    period: float
    held: bool

    @property
    def channels(self) -> int:
        """Number of channels (columns of the samples)."""
        return self.values.shape[1]

    @property
    def end(self) -> float:
        """Last time (s) at which the signal is defined."""
        return (len(self.values) - (0 if self.held else 1)) * self.period

    @property
    def resolution(self) -> float:
        """Longest step (s) of an adaptive solver on this signal: the sampling period."""
        return self.period

    def polynomials(self) -> np.ndarray:
        """Polynomial coefficients (powers, periods, channels) of the signal within each period, lowest power first, in
        the time since the period's first sample."""
        if self.held:
            return self.values[None]
        return np.stack([self.values[:-1], np.diff(self.values, axis=0) / self.period])

    def sample(self, start_time: float, time_step: float, sample_count: int) -> np.ndarray:
        """Values at start_time + i step, shape (sample_count, channels)."""
        index, fractions = _sample_and_fraction(start_time, time_step, sample_count, self.period, len(self.values))
        if self.held:
            return self.values[index]
        from models.core.piecewise import interpolated_rows

        return interpolated_rows(self.values, index, fractions)

    def at(self, time: float) -> np.ndarray:
        """Values at one time (s), shape (channels,), identical to those of ``sample`` but faster for the single times
        that solvers need."""
        position, last_row = time / self.period, len(self.values) - 1
        nearest = round(position)
        snapped = nearest if abs(position - nearest) < SNAP_SHARE else position
        row = min(max(math.floor(snapped), 0), last_row)
        row_before = self.values[row]
        return (
            row_before.copy()
            if self.held
            else row_before + (snapped - row) * (self.values[min(row + 1, last_row)] - row_before)
        )

    def knots(self, duration: float) -> np.ndarray:
        """All sample times inside (0, duration), in s."""
        return self.period * np.arange(1, math.ceil(duration / self.period - 1e-9))


@lru_cache(maxsize=2)
def _sample_and_fraction(
    start_time: float, time_step: float, sample_count: int, sampling_period: float, signal_length: int
) -> tuple[np.ndarray, np.ndarray]:
    """Index (sample_count,) of the sample at or before each time start_time + i step, and the fraction of a period
    after that sample. Cached, since all paths of an ensemble use the same times."""
    position = (start_time + time_step * np.arange(sample_count)) / sampling_period
    nearest = np.rint(position)
    snapped = np.where(np.abs(position - nearest) < SNAP_SHARE, nearest, position)
    index = np.clip(np.floor(snapped), 0, signal_length - 1).astype(np.int64)
    fractions = snapped - index
    index.flags.writeable = fractions.flags.writeable = False
    return index, fractions


@dataclass(frozen=True)
class Smooth:
    """A spline through uniformly sampled data, with its first ``derivatives`` time derivatives as further channels.

    values : shape (n, columns); channels are ordered value columns, first derivatives, second ones.
    A cubic spline is C2; a quintic one is C4 and used where second derivatives are read.
    """

    values: np.ndarray
    period: float
    derivatives: int = 0
    held: bool = False
    degree: int = 3
    _pieces: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        from scipy.interpolate import make_interp_spline

        sample_times = self.period * np.arange(len(self.values))
        spline = make_interp_spline(sample_times, self.values, k=self.degree)
        powers = [spline.derivative(i)(sample_times[:-1]) if i else self.values[:-1] for i in range(self.degree + 1)]
        pieces = np.stack([values / math.factorial(i) for i, values in enumerate(powers)])
        object.__setattr__(self, "_pieces", np.ascontiguousarray(pieces))

    @property
    def channels(self) -> int:
        """Number of channels, derivatives included."""
        return self.values.shape[1] * (self.derivatives + 1)

    @property
    def end(self) -> float:
        """Last time (s) at which the signal is defined."""
        return (len(self.values) - 1) * self.period

    @property
    def resolution(self) -> float:
        """Longest step (s) of an adaptive solver on this signal: the sampling period."""
        return self.period

    def polynomials(self) -> np.ndarray:
        """Polynomial coefficients (powers, periods, value columns) of the spline within each period, lowest power
        first, in the time since the period's first sample."""
        return self._pieces

    def sample(self, start_time: float, time_step: float, sample_count: int) -> np.ndarray:
        """Values and derivatives at start_time + i step, shape (sample_count, channels)."""
        from models.core.piecewise import piecewise_values

        return piecewise_values(self._pieces, self.period, start_time, time_step, sample_count, self.derivatives)

    def at(self, time: float) -> np.ndarray:
        """Values and derivatives at one time (s), shape (channels,)."""
        return self.sample(time, self.period, 1)[0]

    def knots(self, duration: float) -> np.ndarray:
        """Empty array: the spline is smooth enough for solvers of moderate order, which need no restart."""
        return np.empty(0)


def signal_from_samples(
    samples: np.ndarray, sampling_period: float, interpolation: Interpolation
) -> SampledSignal | Smooth:
    """Signal from uniform samples, shape (n, channels), with the interpolation that a scene names: held, linear or
    smooth.

    Raises InputError for a period or a rule that is none, and for fewer samples than the rule needs: 4, or 1 if held
    or linear.
    """
    least = 4 if interpolation == "smooth" else 1
    if interpolation not in get_args(Interpolation):
        raise InputError("", "interpolation", interpolation, "is not known", get_args(Interpolation))
    if not 0.0 < sampling_period < math.inf:
        raise InputError("", "period", sampling_period, "must be above 0, in s")
    if len(samples) < least:
        raise InputError("", "samples", len(samples), f"{least} or more are needed for {interpolation!r}")
    if interpolation == "smooth":
        return Smooth(samples, sampling_period)
    return SampledSignal(samples, sampling_period, held=interpolation == "held")


@dataclass(frozen=True)
class StackedSignal:
    """Several signals combined into one, with their channels side by side."""

    parts: tuple[Signal, ...]

    @property
    def channels(self) -> int:
        """Total number of channels of the combined signals."""
        return sum(signal.channels for signal in self.parts)

    @property
    def period(self) -> float | None:
        """Sampling period (s) of the first sampled signal in the stack; None if none is sampled."""
        return next((signal.period for signal in self.parts if signal.period is not None), None)

    @property
    def held(self) -> bool:
        """True if any of the stacked signals is constant over each sampling period."""
        return any(signal.held for signal in self.parts)

    @property
    def resolution(self) -> float:
        """The shortest resolution (s) among the combined signals."""
        return min(signal.resolution for signal in self.parts)

    def sample(self, start_time: float, time_step: float, sample_count: int) -> np.ndarray:
        """Values of all combined signals at start_time + i step, shape (sample_count, channels)."""
        return np.hstack([signal.sample(start_time, time_step, sample_count) for signal in self.parts])

    def at(self, time: float) -> np.ndarray:
        """Values of all combined signals at one time (s), shape (channels,)."""
        return np.concatenate([signal.at(time) for signal in self.parts])

    def knots(self, duration: float) -> np.ndarray:
        """Times at which any of the stacked signals is not smooth."""
        return np.unique(np.concatenate([signal.knots(duration) for signal in self.parts]))
