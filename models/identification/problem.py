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
FEWEST_FITTED_SAMPLES = 32
"""Least number of samples of a channel for a fit."""
CACHED_PREDICTION_COUNT = 2
"""Number of cached sets of predictions; a set is a base prediction and all its derivatives."""

TimeCurve = tuple[np.ndarray, np.ndarray]
"""Times (n,) in s and values (n,) of a channel."""
ChannelModel = Callable[[np.ndarray], Mapping[str, TimeCurve]]
"""Function of parameter values (p,) that gives channels by name; raises RunFailed or InputError where the model
fails."""


@dataclass(frozen=True)
class IdentifiedParameter:
    """Parameter to be identified, with start value, bounds, and ``scale``: a significant change, in which steps and
    combinations are measured."""

    name: str
    start: float
    lower_bound: float = -np.inf
    upper_bound: float = np.inf
    scale: float = 0.0

    def __post_init__(self) -> None:
        if not self.lower_bound < self.start < self.upper_bound:
            allowed = f"must start between its bounds, {self.lower_bound:g} and {self.upper_bound:g}"
            raise InputError("--parameters", self.name, self.start, allowed)
        if self.scale <= 0.0:
            object.__setattr__(self, "scale", self._default_scale())

    def _default_scale(self) -> float:
        """Default scale: the start value's magnitude, or a quarter of the range if it starts at 0; raises InputError if
        there is no range."""
        if self.start != 0.0:
            return abs(self.start)
        if np.isfinite(self.upper_bound - self.lower_bound):
            return 0.25 * (self.upper_bound - self.lower_bound)
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

    def filtered(self, channel_values: np.ndarray) -> np.ndarray:
        """A channel's values (n,) after the low-pass filter."""
        if self.low_pass_edge <= 0.0:
            return channel_values
        return low_passed(channel_values[:, None], self.period, self.low_pass_edge, "", "--low-pass")[:, 0]


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


def measured_channel(
    channel_name: str, unit: str, measured_curve: TimeCurve, fit_clock: FitClock, measurement_name: str = ""
) -> ChannelOnClock:
    """A channel of a file, interpolated to the fit's clock; InputError if it has too few samples there, or is zero
    throughout."""
    times, raw = measured_curve
    values = without_outliers(raw)
    known = np.isfinite(values)
    is_inside = known & (times >= fit_clock.times[0]) & (times <= fit_clock.times[-1])
    if is_inside.sum() < FEWEST_FITTED_SAMPLES:
        allowed = (
            f"samples between {fit_clock.times[0]:g} and {fit_clock.times[-1]:g} s: at least "
            f"{FEWEST_FITTED_SAMPLES} are needed"
        )
        raise InputError(measurement_name, channel_name, int(is_inside.sum()), allowed)
    period = max(float(np.median(np.diff(times))), fit_clock.period)
    nearest = np.abs(times[known][_nearest_sample(times[known], fit_clock.times)] - fit_clock.times)
    used = nearest <= 1.5 * period
    smooth = fit_clock.filtered(np.interp(fit_clock.times, times[known], values[known]))
    if not np.any(smooth[used]):
        raise InputError(measurement_name, channel_name, 0.0, "does not move: nothing can be identified by it")
    return ChannelOnClock(channel_name, unit, smooth, used, int(len(raw) - known.sum()))


def _nearest_sample(times: np.ndarray, wanted_times: np.ndarray) -> np.ndarray:
    """Indices (m,) of the samples in ``times`` (n,) nearest to the wanted times (m,)."""
    right = np.clip(np.searchsorted(times, wanted_times), 1, len(times) - 1)
    return right - (wanted_times - times[right - 1] < times[right] - wanted_times)


@dataclass(frozen=True, eq=False)
class IdentificationProblem:
    """Identification problem: model, parameters and measured channels. counted_times (n,) : whether the residuals at
    each time count; None for all."""

    model: ChannelModel
    parameters: Sequence[IdentifiedParameter]
    channels: Sequence[ChannelOnClock]
    clock: FitClock
    counted_times: np.ndarray | None = None

    @property
    def start_values(self) -> np.ndarray:
        """Start values (p,) of the parameters."""
        return np.array([parameter.start for parameter in self.parameters])

    @property
    def scales(self) -> np.ndarray:
        """Scales (p,) of the parameters: significant changes, in which steps are measured."""
        return np.array([parameter.scale for parameter in self.parameters])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (p,) of the parameters."""
        return np.array([parameter.lower_bound for parameter in self.parameters]), np.array(
            [parameter.upper_bound for parameter in self.parameters]
        )

    def predicted(self, parameter_values: np.ndarray) -> np.ndarray:
        """Channels of the model (channels, n) at all times of the clock, low-passed as the measurement; read-only."""
        key, kept_predictions = parameter_values.tobytes(), self._latest_predictions
        if key not in kept_predictions:
            prediction = self._run_model(parameter_values)
            if len(kept_predictions) >= CACHED_PREDICTION_COUNT * (len(self.parameters) + 1):
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

    def _run_model(self, parameter_values: np.ndarray) -> np.ndarray:
        """Low-passed channels (channels, n) of a run of the model with parameter values (p,)."""
        run = self.model(parameter_values)
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
    def measured_values(self) -> np.ndarray:
        """Measured channels (channels, m) at the times of the residuals."""
        return np.array([channel.values[:: self.clock.stride] for channel in self.channels])

    def residuals(self, parameter_values: np.ndarray) -> np.ndarray:
        """Residuals (channels, m): prediction less measurement, divided by the channel's size; FAILED_RESIDUAL where
        the model fails."""
        try:
            predicted = self.predicted(parameter_values)[:, :: self.clock.stride]
        except RunFailed:
            return np.where(self.weights > 0.0, FAILED_RESIDUAL, 0.0)
        return (predicted - self.measured_values) * self.weights

    def jacobian(
        self,
        parameter_values: np.ndarray,
        differentiated_function: Callable[[np.ndarray], np.ndarray] | None = None,
        executor: Executor | None = None,
    ) -> np.ndarray:
        """Jacobian (channels, m, p) by forward differences in the parameters' scales, or backward differences where
        forward ones fail.

        differentiated_function : what is derived, the residuals if nothing else is named; executor : computes its
        columns.
        """
        answer = self.residuals if differentiated_function is None else differentiated_function
        difference_steps = [self._difference_steps(parameter_values, k) for k in range(len(self.parameters))]
        base, moved_values = (
            answer(parameter_values),
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

    def _difference_steps(self, parameter_values: np.ndarray, parameter_index: int) -> list[tuple[np.ndarray, float]]:
        """Steps for difference quotients: values (p,) with parameter ``parameter_index`` moved forward, then backward,
        and the step divided by its scale. Steps stay within the bounds; near the upper bound the backward step comes
        first.
        """
        parameter, difference_steps = self.parameters[parameter_index], list[tuple[np.ndarray, float]]()
        step = (
            SCALED_DIFFERENCE_STEP
            * parameter.scale
            * (
                -1.0
                if parameter_values[parameter_index] + SCALED_DIFFERENCE_STEP * parameter.scale > parameter.upper_bound
                else 1.0
            )
        )
        for signed in (step, -step):
            moved_values = parameter_values.copy()
            moved_values[parameter_index] += signed
            difference_steps.append((moved_values, signed / parameter.scale))
        return [
            difference_step
            for difference_step in difference_steps
            if parameter.lower_bound <= difference_step[0][parameter_index] <= parameter.upper_bound
        ] or difference_steps[:1]


SCALED_DIFFERENCE_STEP = 1e-4
"""Step of finite differences, in the parameter's scale."""
