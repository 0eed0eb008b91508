"""Discretisation errors of a run, estimated from a second run in longer steps.

With steps twice as long a method of order p errs 2^p times as much: the difference of both runs, divided by 2^p - 1, is
the error of the finer one (Richardson). Roads, switches and contacts lower the order, so that it is observed, where a
third run in still longer steps is given, and never taken above the declared one. Errors are root mean squares over the
run, and their shares are of the channel's standard deviation over the run, or of its size where it does not move.
"""

import json
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.result import Result

WARNED_SHARE, REFUSED_SHARE, GOAL_SHARE = 0.02, 0.5, 0.005
"""Relative errors of a channel: above the first a warning is printed, above the second the run fails, and the third is
the aim of the advised step."""
REPEATED_SHARE, FINE_WINDOW = 0.4, 0.3
"""Shares of a run repeated in four times the step, to observe the order of convergence, and in half the step."""
MOST_FULLY_REPEATED_ROWS = 200
"""Number of rows up to which a run is repeated as a whole in half its step: that costs little, and a part of few rows
may leave out what makes the error, such as a turn of the steering at the start."""
STEEPEST_ERROR_GROWTH = 4.0
"""Largest power of time with which an error, known for part of a run, is assumed to grow: a road that fades in makes 3,
a drift 2."""
LEAST_ORDER = 0.5
"""Lower limit of an observed order of convergence: below it, runs differ by chance."""
NO_CHANGING_CHANNEL = "none of its channels changes"
CELLS_NOTE = "cells along each axis"
"""Mark of an estimate that comes from a coarser grid of cells rather than from a longer time step."""
TOLERANCE_POWER, LEAST_TOLERANCE_SHARE = 0.6, 0.03
"""Assumed power of the tolerance in the error of an adaptive method (observed: 0.5 to 1.1), and the least error as a
share of the tolerance, for runs whose input makes the method stop more often than the tolerance would."""
UNMOVED_DEVIATION, ONE_ROUNDING = 1e-9, 4.0 * np.finfo(float).eps
"""Ratio of standard deviation to magnitude below which a channel counts as constant; relative error of one rounding."""


@dataclass(frozen=True)
class Estimate:
    """Estimated error of a channel: ``error`` in the channel's unit, ``share`` relative to its standard deviation,
    ``order`` of convergence.

    step : longest step (s), or fewest cells, that would hold the share to GOAL_SHARE; 0 where no step mends it. of :
    CELLS_NOTE where it is of cells.
    """

    error: float
    unit: str
    share: float
    order: float
    step: float
    of: str = ""

    @property
    def warned(self) -> bool:
        """Whether the error is so large that the user must be warned: above WARNED_SHARE."""
        return not self.share <= WARNED_SHARE

    def advice(self, step_unit: str) -> str:
        """Advice on the step (``step_unit`` : its unit) or number of cells that reduces the estimated error."""
        if self.of:
            return f"use at least {self.step:g} {self.of}"
        return f"use at most {self.step:g} {step_unit}".rstrip() if self.step else "no shorter step mends it"

    @property
    def refused(self) -> bool:
        """Whether the error makes the channel useless: above REFUSED_SHARE. An error that no smaller step reduces gives
        a warning only."""
        return not self.share <= REFUSED_SHARE and self.step != 0.0


def reference_size(channel_values: np.ndarray) -> float:
    """Reference size of a channel for its relative error: its standard deviation along the first axis, or its magnitude
    if it is constant."""
    largest = float(np.abs(channel_values).max(initial=0.0))
    deviation = float(np.sqrt(np.mean(np.var(channel_values, axis=0))))
    return deviation if deviation > UNMOVED_DEVIATION * largest else largest


def observed_order(fine_difference: float, coarse_difference: float, declared_order: float) -> float:
    """Observed order of convergence, log2 of the ratio of the differences between successive runs with halved steps,
    limited to LEAST_ORDER up to the declared order."""
    if not (
        fine_difference > 0.0
        and coarse_difference > 0.0
        and math.isfinite(fine_difference)
        and math.isfinite(coarse_difference)
    ):
        return declared_order if fine_difference == 0.0 else LEAST_ORDER
    return float(np.clip(math.log2(coarse_difference / fine_difference), LEAST_ORDER, declared_order))


def error_estimate(
    fine_values: np.ndarray,
    coarse_values: np.ndarray,
    declared_order: float,
    time_step: float,
    coarsest_values: np.ndarray | None = None,
    channel_unit: str = "",
) -> Estimate:
    """Estimated error of ``fine_values`` (m, ...) from runs with twice and (over the first rows) four times the step,
    all read at the rows of the run with twice the step.

    coarse_values : (m, ...); coarsest_values : (k, ...) with k <= (m + 1) / 2, rows of every second one of these.
    """
    gap, order = root_mean_square(fine_values - coarse_values), declared_order
    if coarsest_values is not None and len(coarsest_values) > 1:
        window = slice(0, 2 * len(coarsest_values) - 1, 2)
        order = observed_order(
            root_mean_square((fine_values - coarse_values)[window]),
            root_mean_square(coarse_values[window] - coarsest_values),
            declared_order,
        )
    largest = float(np.abs(fine_values).max(initial=0.0))
    error = max(gap / (2.0**order - 1.0), ONE_ROUNDING * largest * math.sqrt(len(fine_values)))
    return estimate_rescaled(
        Estimate(error, channel_unit, 0.0, order, time_step), reference_size(fine_values), time_step
    )


def root_mean_square(channel_values: np.ndarray) -> float:
    """Root mean square of values of any shape; infinite where squares are too large, 0 where there are none."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.sqrt(np.mean(np.square(channel_values)))) if channel_values.size else 0.0


def finite_rms(channel_values: np.ndarray) -> float:
    """Root mean square of the finite values; 0 where there are none."""
    return root_mean_square(channel_values[np.isfinite(channel_values)])


def nearest_rows(times: np.ndarray, wanted_times: np.ndarray) -> np.ndarray:
    """Indices of the times in ``times`` (n,) nearest to the wanted ones (m,); both must be ascending."""
    row_after = np.clip(np.searchsorted(times, wanted_times), 1, len(times) - 1)
    return row_after - (wanted_times - times[row_after - 1] < times[row_after] - wanted_times)


class RunSeries(NamedTuple):
    """Channels (n, ...) of a run by name, at times (n,) in s, with units of the channels that the run's result does not
    contain."""

    times: np.ndarray
    channels: Mapping[str, np.ndarray]
    units: Mapping[str, str] = MappingProxyType({})


Rerun = Callable[[float, float], RunSeries]
"""Function that repeats a run in steps ``factor`` times as long over a ``share`` of its time: from the start if steps
are longer or the share is 1. Raises InputError or RunFailed where that is impossible."""


def with_estimated_errors(
    run_result: Result,
    fine_run: RunSeries,
    run_again: Rerun,
    convergence_order: float,
    time_step: float,
    error_growth: Mapping[str, float] | None = None,
    channel_sizes: Mapping[str, float] | None = None,
) -> Result:
    """The result with estimated errors of the channels in ``fine_run``: rows of that run at steps of ``time_step`` (s),
    compared with runs that ``run_again`` makes in other steps.

    error_growth : by channel, least factor on what a part tells, where errors grow faster than by a power of time;
    channel_sizes : what shares are of, by channel, where that is not its own deviation. Raises RunFailed, whose
    ``partial`` is the result, where a channel is no answer.
    """
    estimates, method_text = step_errors(fine_run, run_again, convergence_order, time_step, error_growth, channel_sizes)
    known = {
        name: run_result.data[name].attrs.get("units", "") for name in fine_run.channels if name in run_result.data
    }
    known |= fine_run.units
    return with_stated_errors(
        run_result,
        {name: replace(estimate, unit=known.get(name, "")) for name, estimate in estimates.items()},
        method_text,
    )


def step_errors(
    fine_run: RunSeries,
    run_again: Rerun,
    convergence_order: float,
    time_step: float,
    error_growth: Mapping[str, float] | None = None,
    channel_sizes: Mapping[str, float] | None = None,
) -> tuple[dict[str, Estimate], str]:
    """Estimated errors of the channels in ``fine_run`` from runs in other steps, without units, and a text on the
    method of estimation.

    Twice the step over the whole run and four times over a part cost 0.6 of its force calls; where no longer step can
    be, half of it over a part tells. error_growth, channel_sizes : as in ``with_estimated_errors``.
    """
    try:
        estimates, method_text = (
            _by_longer_steps(fine_run, run_again, convergence_order, time_step),
            "runs in longer steps",
        )
    except (InputError, RunFailed):
        estimates, method_text = (
            _by_half_steps(fine_run, run_again, convergence_order, time_step, error_growth or {}),
            "a part in half the step",
        )
    for name, size in (channel_sizes or {}).items():
        estimates[name] = estimate_rescaled(estimates[name], size, time_step)
    return estimates, method_text


def _by_longer_steps(
    fine_run: RunSeries, run_again: Rerun, convergence_order: float, time_step: float
) -> dict[str, Estimate]:
    """Estimated errors by channel from runs in twice the step and, over a part, four times the step."""
    coarse = _comparable_coarse_run(fine_run, run_again(2.0, 1.0), time_step)
    coarser: Mapping[str, np.ndarray] = {}
    with suppress(InputError, RunFailed):
        coarser = _comparable_coarse_run(coarse, run_again(4.0, REPEATED_SHARE), time_step).channels
    rows = nearest_rows(fine_run.times, coarse.times)
    return {
        name: error_estimate(values[rows], coarse.channels[name], convergence_order, time_step, coarser.get(name))
        for name, values in fine_run.channels.items()
    }


def _comparable_coarse_run(fine_run: RunSeries, coarse_run: RunSeries, time_step: float) -> RunSeries:
    """The run in longer steps, unchanged; raises RunFailed where it has no row besides the start, or lasts longer than
    the finer run.

    Steps of a short run, twice as long, may outlast it: nothing is there to compare.
    """
    if len(coarse_run.times) < 2 or coarse_run.times[-1] > fine_run.times[-1] + 0.25 * time_step:
        raise RunFailed("", f"longer steps than {time_step:g} s do not fit into the run")
    return coarse_run


def _by_half_steps(
    fine_run: RunSeries, run_again: Rerun, convergence_order: float, time_step: float, error_growth: Mapping[str, float]
) -> dict[str, Estimate]:
    """Estimated errors by channel from part of the run, or all of a short one, repeated with half the step; scaled to
    the run's step by the order of the method, and to the rest of the run by the error's growth."""
    finer = run_again(0.5, FINE_WINDOW if len(fine_run.times) > MOST_FULLY_REPEATED_ROWS else 1.0)
    slack = 1e-9 * finer.times[-1]
    in_finer_run = (fine_run.times >= finer.times[0] - slack) & (fine_run.times <= finer.times[-1] + slack)
    rows = nearest_rows(finer.times, fine_run.times[in_finer_run])
    estimates = {}
    for name, values in fine_run.channels.items():
        error = error_estimate(finer.channels[name][rows], values[in_finer_run], convergence_order, time_step)
        later = max(
            _growth_after_window(values[in_finer_run] - finer.channels[name][rows], values) if in_finer_run[0] else 1.0,
            error_growth.get(name, 1.0),
        )
        estimates[name] = estimate_rescaled(
            replace(error, error=error.error * 2.0**error.order * later), reference_size(values), time_step
        )
    return estimates


def _growth_after_window(error_rows: np.ndarray, channel_values: np.ndarray) -> float:
    """Ratio of the error's rms over the whole run to that over the first rows, in which ``error_rows`` (k, ...) is the
    difference of two runs.

    The error is assumed to keep growing with the power of time found there, or with the roughness of the channel (n,
    ...).
    """
    if len(error_rows) < 4:
        return 1.0
    first, second = (
        root_mean_square(error_rows[: len(error_rows) // 2]),
        root_mean_square(error_rows[len(error_rows) // 2 :]),
    )
    power = 0.5 * (math.log2(1.0 + (second / first) ** 2) - 1.0) if first > 0.0 else 0.0
    bends = np.diff(channel_values, 2, axis=0)
    bends_at_start, over_all = root_mean_square(bends[: len(error_rows) - 2]), root_mean_square(bends)
    rougher = over_all / bends_at_start if bends_at_start > 0.0 else 1.0
    return max(1.0, rougher, (len(channel_values) / len(error_rows)) ** min(power, STEEPEST_ERROR_GROWTH))


def estimate_rescaled(estimate: Estimate, channel_size: float, time_step: float) -> Estimate:
    """The estimate with share and advised step recomputed for the size of the whole channel; ``time_step`` is the run's
    step."""
    share = estimate.error / channel_size if channel_size > 0.0 else (0.0 if estimate.error == 0.0 else math.inf)
    wanted = (share / GOAL_SHARE) ** (1.0 / estimate.order) if share < math.inf else 1.0
    return replace(estimate, share=share, step=time_step / _whole_divisor(wanted))


def _whole_divisor(least_divisor: float) -> int:
    """Smallest number 2^i 5^j that is at least ``least_divisor``; a step divided by this number stays a short
    decimal."""
    powers = (2**i * 5**j for i in range(30) for j in range(12))
    return min((number for number in powers if number >= least_divisor), default=1)


def with_tolerance_error(
    run_result: Result,
    fine_run: RunSeries,
    looser_run: RunSeries,
    tolerance_ratio: float,
    solver_tolerance: float,
    channel_sizes: Mapping[str, float] | None = None,
) -> Result:
    """The result of an adaptive method with estimated errors of its channels, from a run with ``tolerance_ratio`` times
    the tolerance. The error is assumed to grow with the power TOLERANCE_POWER of the tolerance only, and is
    overestimated. ``channel_sizes`` as in ``with_estimated_errors``.

    Rows may lie where steps end: the finer run is read at the looser one's times by a cubic spline.
    """
    from scipy.interpolate import CubicSpline

    estimates = {}
    for name, values in fine_run.channels.items():
        same_times = len(looser_run.times) == len(fine_run.times) and np.array_equal(looser_run.times, fine_run.times)
        values_at_looser = values if same_times else CubicSpline(fine_run.times, values)(looser_run.times)
        error = max(
            root_mean_square(values_at_looser - looser_run.channels[name]) / (tolerance_ratio**TOLERANCE_POWER - 1.0),
            LEAST_TOLERANCE_SHARE * solver_tolerance * reference_size(values),
        )
        estimate = Estimate(
            error, run_result.data[name].attrs.get("units", ""), 0.0, 1.0 / TOLERANCE_POWER, solver_tolerance
        )
        estimates[name] = estimate_rescaled(
            estimate, (channel_sizes or {}).get(name, reference_size(values)), solver_tolerance
        )
    return with_stated_errors(
        run_result, estimates, f"a run with {tolerance_ratio:g} times the tolerance", "as tolerance"
    )


def grid_error(
    grid_difference: float,
    channel_size: float,
    channel_unit: str,
    cell_count: int,
    convergence_order: float,
    cell_limit: int,
) -> Estimate:
    """Estimated error on a grid of ``cell_count`` cells along each axis. The ``step`` of the estimate is the number of
    cells needed for GOAL_SHARE, at most ``cell_limit``."""
    share = grid_difference / channel_size if channel_size > 0.0 else (0.0 if grid_difference == 0.0 else math.inf)
    needed = cell_count * max(1.0, (min(share, 1.0) / GOAL_SHARE) ** (1.0 / convergence_order))
    return Estimate(
        grid_difference, channel_unit, share, convergence_order, float(min(cell_limit, math.ceil(needed))), CELLS_NOTE
    )


def summed_error(first_error: Estimate, added_error: Estimate) -> Estimate:
    """Sum of two estimated errors, such as those of a run and of its input.

    What mends it is told of the larger one where that is of cells and the other of steps.
    """
    larger = first_error if first_error.share >= added_error.share else added_error
    step = min(first_error.step, added_error.step) if first_error.of == added_error.of == "" else larger.step
    order = min(first_error.order, added_error.order)
    return Estimate(
        first_error.error + added_error.error,
        first_error.unit,
        first_error.share + added_error.share,
        order,
        step,
        larger.of,
    )


def with_stated_errors(
    run_result: Result, estimates: Mapping[str, Estimate], method_text: str, step_unit: str = "s"
) -> Result:
    """The result with the estimated error of each channel and the method of estimation; ``step_unit`` is the unit of
    steps or cells.

    Raises RunFailed, whose ``partial`` is the result, where a channel is no answer.
    """
    if not estimates:
        return not_estimated(run_result, NO_CHANGING_CHANNEL)
    channels = {name: asdict(estimate) for name, estimate in estimates.items()}
    run_result.data.attrs["error"] = json.dumps({"how": method_text, "of": step_unit, "channels": channels})
    worst = max(estimates, key=lambda name: estimates[name].share, default=None)
    if worst is not None and estimates[worst].refused:
        engine, estimate = run_result.data.attrs["engine"] or run_result.data.attrs["system"], estimates[worst]
        why = f"{worst} errs by {100.0 * estimate.share:.3g} % of its deviation; {estimate.advice(step_unit)}"
        fault = "cells are too few" if estimate.of else "steps are too long" if estimate.step else "error is too large"
        failure = RunFailed(engine, f"the {fault}, this is no answer: {why}")
        failure.partial = run_result
        raise failure
    return run_result


def error_estimates_of(run_result: Result) -> dict[str, Estimate]:
    """Error estimates stored in a result, by channel; empty if no estimate was made."""
    stored = json.loads(run_result.data.attrs.get("error", "{}"))
    return {name: Estimate(**values) for name, values in stored.get("channels", {}).items()}


def not_estimated(run_result: Result, reason: str) -> Result:
    """The result with a statement why its error is not estimated, such as a force law that switches differently in
    every run."""
    run_result.data.attrs["error"] = json.dumps({"why": reason})
    return run_result


def with_theory_error(run_result: Result, estimates: Mapping[str, Estimate], method_text: str) -> Result:
    """The result with the error of the theory beside that of the grid; ``method_text`` is text on how it is known.

    A finer grid does not reduce this error, so it leads to no warning and no refusal.
    """
    stored = json.loads(run_result.data.attrs["error"])
    stored["theory"] = {
        "how": method_text,
        "channels": {name: asdict(estimate) for name, estimate in estimates.items()},
    }
    run_result.data.attrs["error"] = json.dumps(stored)
    return run_result


def with_sampling_error(run_result: Result, estimates: Mapping[str, Estimate], sample_count: int) -> Result:
    """The result of an ensemble with the standard errors of its channels, from ``sample_count`` paths.

    The errors of the time step stay in the result as well.
    """
    stored = json.loads(run_result.data.attrs["error"])
    stored["chance"] = {
        "samples": sample_count,
        "channels": {name: asdict(estimate) for name, estimate in estimates.items()},
    }
    run_result.data.attrs["error"] = json.dumps(stored)
    return run_result


def sampling_error(standard_error: float, channel_size: float, channel_unit: str, sample_count: int) -> Estimate:
    """The standard error of an ensemble's result as an ``Estimate``; its ``step`` is the number of samples that would
    reduce the share to WARNED_SHARE."""
    share = standard_error / channel_size if channel_size > 0.0 else (0.0 if standard_error == 0.0 else math.inf)
    needed = sample_count * max(1.0, (share / WARNED_SHARE) ** 2) if math.isfinite(share) else math.inf
    return Estimate(
        standard_error, channel_unit, share, 0.5, float(f"{needed:.2g}") if math.isfinite(needed) else math.inf
    )


def largest_estimate(run_result: Result) -> Estimate | None:
    """The error estimate with the largest share in a result; None if there are no estimates."""
    return max(error_estimates_of(run_result).values(), key=lambda estimate: estimate.share, default=None)


def error_lines(run_result: Result) -> list[str]:
    """Printed lines on a result's error: the worst channel for the time step and the worst for cells, with a warning
    and advice if needed, then the errors of the theory and of the sample."""
    stored, estimates = json.loads(run_result.data.attrs.get("error", "{}")), error_estimates_of(run_result)
    text = [f"error not estimated: {stored['why']}"] if "why" in stored else []
    shares = {name: estimate.share for name, estimate in sorted(estimates.items(), key=lambda entry: entry[1].share)}
    worst = {estimates[name].of: name for name in shares}
    for name in sorted(worst.values(), key=lambda name: -shares[name]):
        line = f"error at most {_size_text(name, estimates[name])}, by {stored['how']}"
        text.append(f"{line}: WARNING, {estimates[name].advice(stored['of'])}" if estimates[name].warned else line)
    for kind, words in (("theory", "error of the theory"), ("chance", "standard error of {samples} paths")):
        if kind in stored:
            name, values = max(stored[kind]["channels"].items(), key=lambda entry: entry[1]["share"])
            line = f"{words.format(**stored[kind])} at most {_size_text(name, Estimate(**values))}"
            text.append(f"{line}, {stored[kind]['how']}" if "how" in stored[kind] else line)
    return text


def _size_text(channel_name: str, estimate: Estimate) -> str:
    """Text with the share of an estimated error in per cent, the channel, and the error in its unit."""
    share, error = (float(f"{value:.2g}") for value in (100.0 * estimate.share, estimate.error))
    size = f"{error:g} {estimate.unit}".rstrip()
    return f"{share:g} % ({channel_name}: {size})"
