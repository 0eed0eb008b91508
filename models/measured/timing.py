"""Sampling times of one group of channels: sorted, without repetitions, with gaps, jitter and rate determined."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding, FindingWeight

LEAST_GAP_PERIODS = 1.5
"""Distance of two samples, in periods, above which there is a gap between them."""
SHUFFLED_PERIODS = 10.0
"""Lateness of a sample, in periods, up to which it was only written late; a clock that goes back farther began anew."""
EVEN_CLOCK_DEVIATION_SHARE = 0.01
"""Deviation from an even clock, in periods, up to which samples lie on it; beyond, the clock jitters."""
JITTER_SHARE = 0.1
"""Standard deviation of the steps, in periods, above which jitter is a doubt."""


ROUNDING_SHARE = 1e-9
"""Rounding of a time by double precision, in periods, that is not reported."""
LEAST_SLIP_COUNT = 5
"""Number of repeated times, or of steps that deviate, above which rounding may be their cause: one is a row written
twice."""
RATE_DIGITS = range(1, 9)
"""Numbers of significant digits tried for the rate of an even clock: the fewest that explain all rounded times are
taken."""
LARGEST_TIME_RATIO = 1e4
"""Ratio of a time's distance from the median time to the length of the measurement above which it is no time."""
REPEATED_TIME_SHARE = 0.01
"""Share of the samples that may repeat the time of another one: dropping them then does no harm."""


ReportFinding = Callable[[str, FindingWeight, str, float, str, Iterable[float]], None]
"""Function that records a finding: check, severity, text, size, unit and times."""


@dataclass(frozen=True)
class SampleTiming:
    """Times (n,) in s of the samples of one group, strictly ascending, with their order in the file, the period and
    findings.

    times (n,) : s, strictly rising. order (n,) : which sample of the file each is; None where every one is in its
    place. period : s, the median step. findings : what was found and how it was dealt with.
    """

    times: np.ndarray
    order: np.ndarray | None
    period: float
    findings: tuple[Finding, ...]

    @property
    def rate(self) -> float:
        """Sampling rate (Hz)."""
        return 1.0 / self.period

    @property
    def end(self) -> float:
        """Time (s) of the last sample."""
        return float(self.times[-1])


def sample_timing(times: np.ndarray, measurement_place: str, signal_names: tuple[str, ...] = ()) -> SampleTiming:
    """``SampleTiming`` of sample times (n,) as the file at ``measurement_place`` gives them: ascending times, their
    order in the file, the period, findings. Raises InputError where fewer than two times differ."""
    has_no_time = _invalid_times(times)
    if has_no_time.any():
        timing, first = sample_timing(times[~has_no_time], measurement_place, signal_names), int(np.argmax(has_no_time))
        text = (
            f"{measurement_place}: {np.count_nonzero(has_no_time)} samples have no time, the first is number "
            f"{first + 1} with "
            f"{times[first]:.4g} s; they are left out."
        )
        order = np.flatnonzero(~has_no_time) if timing.order is None else np.flatnonzero(~has_no_time)[timing.order]
        absurd = Finding(
            "time", "doubt", measurement_place, text, float(np.count_nonzero(has_no_time)), "samples", signal_names
        )
        return replace(timing, order=order, findings=(absurd, *timing.findings))
    return _timing_of_valid_times(times, measurement_place, signal_names)


def _invalid_times(times: np.ndarray) -> np.ndarray:
    """Which of the values (n,) cannot be a time (s): not finite, or far beyond all others."""
    finite = np.isfinite(times)
    if np.count_nonzero(finite) < 3:
        return ~finite
    length = len(times) * float(np.median(np.abs(np.diff(times[finite]))))
    with np.errstate(invalid="ignore"):
        is_far = np.abs(times - np.median(times[finite])) > LARGEST_TIME_RATIO * length
    return ~finite | (is_far if length > 0 else False)


def _timing_of_valid_times(times: np.ndarray, measurement_place: str, signal_names: tuple[str, ...]) -> SampleTiming:
    """``SampleTiming`` of values (n,) that can be times (s)."""
    findings, sample_count = list[Finding](), len(times)

    def report(
        check: str, severity: FindingWeight, finding_text: str, finding_size: float, unit: str, times: Iterable[float]
    ) -> None:
        text, instants = f"{measurement_place}: {finding_text}.", tuple(map(float, times))
        findings.append(Finding(check, severity, measurement_place, text, finding_size, unit, signal_names, instants))

    rising_steps = np.diff(times)[np.diff(times) > 0]
    if not len(rising_steps):
        raise InputError(measurement_place, "time", None, "two samples or more at different times are needed")
    even = even_clock(times)
    if even is not None:
        _report_rounded_times(times, even[1], report)
        return SampleTiming(even[0] + even[1] * np.arange(sample_count), None, even[1], tuple(findings))
    period = float(f"{_median_step(times, rising_steps):.9g}")
    order = _first_of_each_time(times, _ascending_order(times, period, report), report)
    ascending_times = times[order]
    _report_gaps(ascending_times, period, report)
    _report_jitter(ascending_times, period, report)
    is_as_in_file = np.array_equal(order, np.arange(sample_count))
    return SampleTiming(ascending_times, None if is_as_in_file else order, period, tuple(findings))


def _ascending_order(times: np.ndarray, sampling_period: float, report_finding: ReportFinding) -> np.ndarray:
    """Indices (m,) of the samples in ascending order of their times (n,). Samples after a clock that began anew are
    left out, and samples that are late are put in order; both are reported.
    """
    order, steps = np.arange(len(times)), np.diff(times)
    if not (steps < 0).any():
        return order
    deepest, at = -float(steps.min()), int(np.argmax(steps < -SHUFFLED_PERIODS * sampling_period))
    if deepest > SHUFFLED_PERIODS * sampling_period:
        order = order[: at + 1]
        report_finding(
            "time",
            "error",
            f"the clock goes back by {deepest:.6g} s at {times[at]:.6g} s: there are two "
            "measurements in the file, which must be taken apart; what follows is left out",
            deepest,
            "s",
            (times[at + 1], times[at]),
        )
    else:
        report_finding(
            "time",
            "doubt",
            f"{np.count_nonzero(steps < 0)} times are earlier than the one before them, by up to "
            f"{deepest:.3g} s; the samples are put in order",
            deepest,
            "s",
            times[[at, at + 1]],
        )
    return order[np.argsort(times[order], kind="stable")]


def _first_of_each_time(times: np.ndarray, order: np.ndarray, report_finding: ReportFinding) -> np.ndarray:
    """Indices (m,) of the first sample of each time, from the samples' ``order`` by times (n,); repetitions are
    reported.
    """
    repeated = np.diff(times[order]) == 0
    if not repeated.any():
        return order
    first, count = float(times[order][1:][repeated][0]), int(np.count_nonzero(repeated))
    text = f"{count} of {len(order)} times are there more than once, the first at {first:.6g} s; "
    if count > REPEATED_TIME_SHARE * len(order):
        severity: FindingWeight = "error"
        text += (
            "no even clock explains them, and without these samples the forces are others: "
            "export the times with more digits, or mend them"
        )
    else:
        severity, text = "doubt", f"{text}of each the first sample is taken"
    report_finding("time", severity, text, float(count), "samples", (first, first))
    return order[np.concatenate(([True], ~repeated))]


def _report_rounded_times(times: np.ndarray, sampling_period: float, report_finding: ReportFinding) -> None:
    """Report that an even clock explains all times (n,) of a file, which are rounded."""
    sample_count = len(times)
    repeated_count = sample_count - 1 - int(np.count_nonzero(np.diff(times) > 0))
    repeated_text = f", so that {repeated_count} of {sample_count} repeat themselves" if repeated_count else ""
    report_finding(
        "time",
        "note",
        f"the times are rounded{repeated_text}: an even clock of {1 / sampling_period:.9g} Hz explains them all, and "
        f"is taken with all {sample_count} samples",
        float(repeated_count),
        "samples",
        (times[0], times[-1]),
    )


def _median_step(times: np.ndarray, rising_steps: np.ndarray) -> float:
    """Median of the rising steps (s) of times (n,).

    Large times, such as seconds since 1970, are rounded in double precision. Then many steps share the same rounding
    error, and the mean step is taken instead: their sum divided by the number of whole steps in it.
    """
    middle = float(np.median(rising_steps))
    if np.spacing(np.abs(times).max()) < ROUNDING_SHARE * middle:
        return middle
    counted = np.rint(rising_steps / middle)
    return float(rising_steps.sum() / counted.sum()) if counted.sum() else middle


def even_clock(times: np.ndarray) -> tuple[float, float] | None:
    """Start and period (s) of an even clock whose times (n,) were rounded coarsely, so that some repeat or the clock
    seems to jitter; None if the rounding is fine, or no even clock explains the times.

    Rounding moves a time by less than the spacing of rounded times. The differences from the right clock therefore lie
    in a band of that width, and few clocks satisfy this. The one whose rate has the fewest digits is taken.
    """
    width, count = _rounding_spacing(times), np.arange(len(times))
    if width is None:
        return None
    slope = float(np.polyfit(count - count.mean(), times - times.mean(), 1)[0])
    for period in [*(1 / float(f"{1 / slope:.{digits}g}") for digits in RATE_DIGITS), slope]:
        residuals = times - period * count
        if np.ptp(residuals) <= width * (1 + 1e-6):
            return float(0.5 * (residuals.min() + residuals.max())), period
    return None


def _rounding_spacing(times: np.ndarray) -> float | None:
    """Spacing (s) to which times (n,) are coarsely rounded: the step between different times, or a power of ten; None
    if they are not."""
    steps = np.diff(times)
    if not np.isfinite(times).all() or (steps < 0).any():
        return None
    if np.count_nonzero(steps == 0) >= LEAST_SLIP_COUNT:
        return float(np.median(steps[steps > 0]))
    middle = float(np.median(steps))
    if (steps == 0).any() or np.count_nonzero(
        np.abs(steps - middle) > EVEN_CLOCK_DEVIATION_SHARE * middle
    ) < LEAST_SLIP_COUNT:
        return None
    for digits in range(7):
        scaled_times = times * 10.0**digits
        if (np.abs(scaled_times - np.rint(scaled_times)) < 1e-6).all():
            return 10.0**-digits if 10.0**-digits > EVEN_CLOCK_DEVIATION_SHARE * middle else None
    return None


def _report_gaps(times: np.ndarray, sampling_period: float, report_finding: ReportFinding) -> None:
    """Report a finding on the gaps of a clock, with the longest one."""
    steps = np.diff(times)
    wide = np.flatnonzero(steps > LEAST_GAP_PERIODS * sampling_period)
    if len(wide):
        longest = wide[np.argmax(steps[wide])]
        lost = float(np.sum(steps[wide] - sampling_period))
        report_finding(
            "clock gaps",
            "note",
            f"{len(wide)} gap(s) in its clock, {lost:.4g} s in all, the longest from "
            f"{times[longest]:.6g} to {times[longest + 1]:.6g} s ({steps[longest]:.4g} s); nothing was measured there",
            float(steps[longest]),
            "s",
            times[[longest, longest + 1]],
        )


def _report_jitter(times: np.ndarray, sampling_period: float, report_finding: ReportFinding) -> None:
    """Report a finding on the jitter of a clock, if there is any."""
    steps = np.diff(times)
    deviations = steps[steps <= LEAST_GAP_PERIODS * sampling_period] - sampling_period
    spread = float(deviations.std())
    if spread > EVEN_CLOCK_DEVIATION_SHARE * sampling_period:
        weight: FindingWeight = "doubt" if spread > JITTER_SHARE * sampling_period else "note"
        report_finding(
            "jitter",
            weight,
            f"the clock jitters: its steps of {1e3 * sampling_period:.6g} ms have a standard deviation of "
            f"{1e3 * spread:.3g} ms ({spread / sampling_period:.1%}); the times of the file are believed",
            spread,
            "s",
            times[[0, -1]],
        )
