"""Identification problem: a model with parameters, a measurement, and the scaled residuals of both on one clock."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.smoothing import low_passed
from models.ensemble.runner import block_results
from models.measured.outliers import without_outliers

FAILED_RESIDUAL = 1e3
"""Residual of every sample where the model fails at trial values, so that a search turns back."""
SAMPLES_PER_PERIOD = 4.0
"""Number of samples kept per period of the low-pass edge."""
FEWEST_SAMPLES = 32
"""Least number of samples of a channel for a fit."""
SETS_OF_PREDICTIONS = 2
"""Number of cached sets of predictions; a set is a base prediction and all its derivatives."""

Curve = tuple[np.ndarray, np.ndarray]
"""Times (n,) in s and values (n,) of a channel."""
Model = Callable[[np.ndarray], Mapping[str, Curve]]
"""Function of parameter values (p,) that gives channels by name; raises RunFailed or InputError where the model
fails."""


@dataclass(frozen=True)
class Parameter:
    """Parameter to be identified, with start value, bounds, and ``scale``: a significant change, in which steps and
    combinations are measured."""

    name: str
    start: float
    low: float = -np.inf
    high: float = np.inf
    scale: float = 0.0

    def __post_init__(self) -> None:
        if not self.low < self.start < self.high:
            allowed = f"must start between its bounds, {self.low:g} and {self.high:g}"
            raise InputError("--parameters", self.name, self.start, allowed)
        if self.scale <= 0.0:
            object.__setattr__(self, "scale", self._default_scale())

    def _default_scale(self) -> float:
        """Default scale: the start value's magnitude, or a quarter of the range if it starts at 0; raises InputError if
        there is no range."""
        if self.start != 0.0:
            return abs(self.start)
        if np.isfinite(self.high - self.low):
            return 0.25 * (self.high - self.low)
        allowed = f"starts at 0 and so has no scale: name a range, {self.name}=LOW:HIGH"
        raise InputError("--parameters", self.name, None, allowed)


@dataclass(frozen=True)
class FitClock:
    """Even time grid of a fit: times (n,) in s, and the edge (Hz) of the low-pass on model and measurement, 0 for
    none."""

    times: np.ndarray
    low_pass_edge: float = 0.0

    @property
    def period(self) -> float:
        """Sampling period (s)."""
        return float(self.times[1] - self.times[0])

    @property
    def stride(self) -> int:
        """Interval, in samples, between the samples that residuals keep; after the low-pass, the signal hardly changes
        in between."""
        return (
            max(1, int(1.0 / (SAMPLES_PER_PERIOD * self.low_pass_edge * self.period) + 1e-9))
            if self.low_pass_edge > 0.0
            else 1
        )

    def filtered(self, values: np.ndarray) -> np.ndarray:
        """A channel's values (n,) after the low-pass filter."""
        if self.low_pass_edge <= 0.0:
            return values
        return low_passed(values[:, None], self.period, self.low_pass_edge, "", "--low-pass")[:, 0]


@dataclass(frozen=True, eq=False)
class ChannelOnClock:
    """One measured channel on the fit's clock: values (n,), low-passed; is_used (n,) : which of them count; left_out :
    number of samples of the file that were spikes or not measured."""

    name: str
    unit: str
    values: np.ndarray
    is_used: np.ndarray
    left_out: int

    @cached_property
    def size(self) -> float:
        """Root mean square of the used samples, by which residuals are divided."""
        return float(np.sqrt(np.mean(self.values[self.is_used] ** 2)))


def measured_channel(name: str, unit: str, curve: Curve, clock: FitClock, source: str = "") -> ChannelOnClock:
    """A channel of a file, interpolated to the fit's clock; InputError if it has too few samples there, or is zero
    throughout."""
    times, raw = curve
    values = without_outliers(raw)
    known = np.isfinite(values)
    is_inside = known & (times >= clock.times[0]) & (times <= clock.times[-1])
    if is_inside.sum() < FEWEST_SAMPLES:
        allowed = f"samples between {clock.times[0]:g} and {clock.times[-1]:g} s: at least {FEWEST_SAMPLES} are needed"
        raise InputError(source, name, int(is_inside.sum()), allowed)
    period = max(float(np.median(np.diff(times))), clock.period)
    nearest = np.abs(times[known][_nearest_sample(times[known], clock.times)] - clock.times)
    used = nearest <= 1.5 * period
    smooth = clock.filtered(np.interp(clock.times, times[known], values[known]))
    if not np.any(smooth[used]):
        raise InputError(source, name, 0.0, "does not move: nothing can be identified by it")
    return ChannelOnClock(name, unit, smooth, used, int(len(raw) - known.sum()))


def _nearest_sample(times: np.ndarray, wanted_times: np.ndarray) -> np.ndarray:
    """Indices (m,) of the samples in ``times`` (n,) nearest to the wanted times (m,)."""
    right = np.clip(np.searchsorted(times, wanted_times), 1, len(times) - 1)
    return right - (wanted_times - times[right - 1] < times[right] - wanted_times)


@dataclass(frozen=True, eq=False)
class Problem:
    """Identification problem: model, parameters and measured channels. counted_times (n,) : whether the residuals at
    each time count; None for all."""

    model: Model
    parameters: Sequence[Parameter]
    channels: Sequence[ChannelOnClock]
    clock: FitClock
    counted_times: np.ndarray | None = None

    @property
    def start(self) -> np.ndarray:
        """Start values (p,) of the parameters."""
        return np.array([parameter.start for parameter in self.parameters])

    @property
    def scale(self) -> np.ndarray:
        """Scales (p,) of the parameters: significant changes, in which steps are measured."""
        return np.array([parameter.scale for parameter in self.parameters])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (p,) of the parameters."""
        return np.array([parameter.low for parameter in self.parameters]), np.array(
            [parameter.high for parameter in self.parameters]
        )

    def predicted(self, values: np.ndarray) -> np.ndarray:
        """Channels of the model (channels, n) at all times of the clock, low-passed as the measurement; read-only."""
        key, kept_predictions = values.tobytes(), self._latest_predictions
        if key not in kept_predictions:
            prediction = self._march(values)
            if len(kept_predictions) >= SETS_OF_PREDICTIONS * (len(self.parameters) + 1):
                kept_predictions.pop(next(iter(kept_predictions)))
            kept_predictions[key] = prediction
        return kept_predictions[key]

    @cached_property
    def _latest_predictions(self) -> dict[bytes, np.ndarray]:
        """Cache of predictions, by the bytes of the parameter values; a stage of a fit begins with the values that
        ended the last stage."""
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """State for pickling without cached predictions, which other processes do not need."""
        return {name: value for name, value in vars(self).items() if name != "_latest_predictions"}

    def _march(self, values: np.ndarray) -> np.ndarray:
        """Low-passed channels (channels, n) of a run of the model with parameter values (p,)."""
        run = self.model(values)
        rows = []
        for channel in self.channels:
            times, raw = run[channel.name]
            rows.append(self.clock.filtered(np.interp(self.clock.times, times, raw)))
        prediction = np.array(rows)
        prediction.flags.writeable = False
        return prediction

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights (channels, m) of the residuals: 0 for samples that do not count, else the inverse of the channel's
        size."""
        sample_stride, counted_times = slice(None, None, self.clock.stride), self.counted_times
        rows = [channel.is_used & (True if counted_times is None else counted_times) for channel in self.channels]
        return np.array([row[sample_stride] / channel.size for row, channel in zip(rows, self.channels, strict=True)])

    @cached_property
    def target(self) -> np.ndarray:
        """Measured channels (channels, m) at the times of the residuals."""
        return np.array([channel.values[:: self.clock.stride] for channel in self.channels])

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """Residuals (channels, m): prediction less measurement, divided by the channel's size; FAILED_RESIDUAL where
        the model fails."""
        try:
            predicted = self.predicted(values)[:, :: self.clock.stride]
        except RunFailed:
            return np.where(self.weights > 0.0, FAILED_RESIDUAL, 0.0)
        return (predicted - self.target) * self.weights

    def jacobian(
        self,
        values: np.ndarray,
        function: Callable[[np.ndarray], np.ndarray] | None = None,
        executor: Executor | None = None,
    ) -> np.ndarray:
        """Jacobian (channels, m, p) by forward differences in the parameters' scales, or backward differences where
        forward ones fail.

        function : what is derived, the residuals if nothing else is named; executor : computes its columns.
        """
        answer = self.residuals if function is None else function
        difference_steps = [self._difference_steps(values, k) for k in range(len(self.parameters))]
        base, moved_values = (
            answer(values),
            block_results(answer, [difference_step[0][0] for difference_step in difference_steps], executor),
        )
        failed_columns = [
            k
            for k, difference_step in enumerate(difference_steps)
            if difference_step[1:] and np.abs(moved_values[k]).max() >= FAILED_RESIDUAL
        ]
        chosen = [
            difference_step[1 if k in failed_columns else 0] for k, difference_step in enumerate(difference_steps)
        ]
        for k, changed_values in zip(
            failed_columns, block_results(answer, [chosen[k][0] for k in failed_columns], executor), strict=True
        ):
            moved_values[k] = changed_values
        columns = [(row - base) / change for row, (_, change) in zip(moved_values, chosen, strict=True)]
        return np.stack(columns, axis=-1)

    def _difference_steps(self, values: np.ndarray, k: int) -> list[tuple[np.ndarray, float]]:
        """Steps for difference quotients: values (p,) with parameter ``k`` moved forward, then backward, and the step
        divided by its scale. Steps stay within the bounds; near the upper bound the backward step comes first."""
        parameter, difference_steps = self.parameters[k], list[tuple[np.ndarray, float]]()
        step = (
            DIFFERENCE_STEP
            * parameter.scale
            * (-1.0 if values[k] + DIFFERENCE_STEP * parameter.scale > parameter.high else 1.0)
        )
        for signed in (step, -step):
            moved_values = values.copy()
            moved_values[k] += signed
            difference_steps.append((moved_values, signed / parameter.scale))
        return [
            difference_step
            for difference_step in difference_steps
            if parameter.low <= difference_step[0][k] <= parameter.high
        ] or difference_steps[:1]


DIFFERENCE_STEP = 1e-4
"""Step of finite differences, in the parameter's scale."""
