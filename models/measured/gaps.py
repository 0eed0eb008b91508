"""Samples that were not measured: short gaps filled with the most likely values, and exporters' marks for no value.

The samples are taken as a stationary process of the channel's own autocovariance. What was lost has then a normal
law, given its neighbours (simple kriging): its mean is the filling, its standard deviation the doubt. A straight line
or a spline through the neighbours knows nothing of the wheel hop that goes on inside a gap: on hub forces it errs by
four to six times as much.

Exporters write 9.9E+34, 1E+30, the largest number of a format, or infinity where nothing was measured. Such a sample
is taken as not measured, NaN, before anything is resampled: it would drown whatever is filtered or averaged with it.
"""

from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.measured.recording import Recording
from models.measured.signal import UNIT_OF_QUANTITY, MeasuredSignal, Quantity

LONGEST_BRIDGED_GAP = 0.1
"""Longest gap (s) in a hub force that is bridged."""
NEIGHBOUR_SPAN = 0.3
"""Time (s) on either side of a gap whose samples determine the filling: several waves of wheel hop and of the chassis'
roll."""
NEIGHBOUR_COUNT_LIMIT = 200
"""Approximate number of neighbouring samples for a filling: all close to the gap, and a selection of those farther
away."""
LARGEST_PLAUSIBLE: dict[Quantity, float] = {
    "force": 1e6,
    "moment": 1e6,
    "acceleration": 1e4,
    "angular rate": 1e3,
    "angle": 100.0,
    "travel": 100.0,
    "strain": 1.0,
}
"""Largest plausible value of each quantity in SI units: ten times and more what transducers of a vehicle measure (a
force of 100 t, 1000 g)."""
IMPOSSIBLE_DISTANCE_RATIO = 1000.0
"""Ratio of a sample's distance from the median to the median distance above which it is no measurement. A wrong unit
makes all samples large alike, and is found by other checks."""
MISSING_VALUE_MARK = 1e30
"""Magnitude above which a value is an exporter's mark, however many samples have it."""


@dataclass(frozen=True)
class SampleGap:
    """A gap of samples from ``first`` to before ``end``. ``largest_deviation`` (in the channel's unit) is the largest
    standard deviation of the filled values, NaN if the gap is not filled because it is too long or has no
    neighbours."""

    first: int
    end: int
    largest_deviation: float


def true_runs(is_true: np.ndarray) -> np.ndarray:
    """First index and end index (r, 2) of each run of consecutive true values in an array (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], is_true.astype(np.int8), [0]))))
    return edges.reshape(-1, 2)


def filled_samples(
    samples: np.ndarray, sampling_period: float, longest_gap: float
) -> tuple[np.ndarray, list[SampleGap]]:
    """Values (n,), sampled every ``sampling_period`` (s), with gaps of up to ``longest_gap`` (s) filled, and the list
    of all gaps.

    Wheels hop at 10 to 15 Hz: of a gap of 0.02 s a third to a tenth of the motion is doubtful, of one of 0.05 s most.
    """
    lost = true_runs(np.isnan(samples)).tolist()
    if not lost:
        return samples, []
    out, mean, span = samples.copy(), float(np.nanmean(samples)), max(round(NEIGHBOUR_SPAN / sampling_period), 4)
    stride = max(2 * span // NEIGHBOUR_COUNT_LIMIT, 1)
    law = autocovariance(samples - mean, 2 * span + round(longest_gap / sampling_period) + 2)
    gaps = []
    for first, end in lost:
        doubt = np.nan
        known = _neighbour_samples(samples, first, end, span, stride)
        if len(known) and (end - first) * sampling_period <= longest_gap * (1 + 1e-9):
            guess, doubt = _conditional_mean(law, known, np.arange(first, end), samples[known] - mean)
            out[first:end] = mean + guess
        gaps.append(SampleGap(first, end, doubt))
    return out, gaps


def bridged_signals(
    recording: Recording, signal: MeasuredSignal
) -> tuple[np.ndarray, list[SampleGap], tuple[Finding, ...]]:
    """All samples (n,) of a signal with short gaps filled, the gaps, and findings on them; raises InputError where a
    gap is too long."""
    period = recording.period
    values, gaps = filled_samples(recording.samples(signal), period, LONGEST_BRIDGED_GAP)
    for gap in (gap for gap in gaps if np.isnan(gap.largest_deviation)):
        text = (
            f"is silent from {gap.first * period:.6g} s to {gap.end * period:.6g} s: gaps of at most "
            f"{LONGEST_BRIDGED_GAP:g} s are "
            "bridged; take a stretch without this one (clock.start, clock.duration)"
        )
        raise InputError(signal.file, signal.channel, None, text)
    if not gaps:
        return values, gaps, ()
    longest, worst = max(gap.end - gap.first for gap in gaps) * period, max(gaps, key=lambda gap: gap.largest_deviation)
    text = (
        f"{signal.name} is silent {len(gaps)} times, for at most {longest:.3g} s: bridged by what the channel itself "
        f"makes most likely, with a standard deviation of {worst.largest_deviation:.3g} "
        f"{UNIT_OF_QUANTITY[signal.quantity]} at "
        f"{worst.first * period:.6g} s, the largest."
    )
    times = gaps[0].first * period, gaps[-1].end * period
    return values, gaps, (Finding("gaps", "doubt", signal.name, text, longest, "s", (signal.name,), times),)


def autocovariance(samples: np.ndarray, lags: int) -> np.ndarray:
    """Autocovariance (lags,) of values (n,) with mean 0, NaN counting as 0. It is positive definite, as interpolation
    needs."""
    known = np.nan_to_num(samples)
    size = 1 << (2 * len(known) - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(known, size)) ** 2
    law = np.fft.irfft(spectrum, size)[: min(lags, len(known))] / np.count_nonzero(~np.isnan(samples))
    return np.pad(law, (0, max(lags - len(known), 0)))


def _neighbour_samples(
    samples: np.ndarray, gap_start: int, gap_end: int, neighbour_span: int, stride: int
) -> np.ndarray:
    """Indices of measured samples around a gap: all of the nearest ones, and every ``stride``-th of those farther
    away."""
    distances = np.arange(1, neighbour_span + 1)
    distances = distances[(distances <= 2 * (gap_end - gap_start) + 8) | (distances % stride == 0)]
    indices = np.concatenate((gap_start - distances[::-1], gap_end - 1 + distances))
    indices = indices[(indices >= 0) & (indices < len(samples))]
    return indices[~np.isnan(samples[indices])]


def _conditional_mean(
    autocovariances: np.ndarray, known_indices: np.ndarray, lost_indices: np.ndarray, samples: np.ndarray
) -> tuple[np.ndarray, float]:
    """Expected values (m,) of the lost samples given the known ones, and the largest standard deviation of the
    estimate."""
    known_covariance = autocovariances[np.abs(known_indices[:, None] - known_indices)]
    known_covariance[np.diag_indices(len(known_indices))] *= 1 + 1e-9
    cross_covariance = autocovariances[np.abs(lost_indices[:, None] - known_indices)]
    weights = np.linalg.solve(known_covariance, cross_covariance.T)
    remaining_variance = autocovariances[0] - np.sum(cross_covariance.T * weights, axis=0)
    return samples @ weights, float(np.sqrt(np.maximum(remaining_variance, 0.0).max()))


def without_impossible_values(
    signal: MeasuredSignal, samples: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, Finding | None]:
    """Values (n,) in SI with NaN in place of values that cannot be measurements, and a finding on them; times (n,) in
    s.

    A value is impossible if it is a mark, or beyond LARGEST_PLAUSIBLE and IMPOSSIBLE_DISTANCE_RATIO times farther from
    the median than half of all.
    """
    if not (np.abs(samples) > LARGEST_PLAUSIBLE[signal.quantity]).any():
        return samples, None
    absurd = ~(np.abs(samples) < MISSING_VALUE_MARK) & ~np.isnan(samples)
    plausible = samples[~absurd & ~np.isnan(samples)]
    if len(plausible):
        deviations = np.abs(plausible - np.median(plausible))
        limit = np.maximum(IMPOSSIBLE_DISTANCE_RATIO * np.median(deviations), LARGEST_PLAUSIBLE[signal.quantity])
        absurd[np.flatnonzero(~absurd & ~np.isnan(samples))[deviations > limit]] = True
    if not absurd.any():
        return samples, None
    stretches, count = true_runs(absurd), int(absurd.sum())
    first, last = stretches[0, 0], stretches[-1, 1] - 1
    written = samples[first] / (signal.sign * signal.factor) + signal.zero
    count_text = f"{count} samples in {len(stretches)} stretch(es) are" if count > 1 else "a sample is"
    text = (
        f"{signal.file}, {signal.channel}: {count_text} no {signal.quantity}: {written:.4g} {signal.unit}".rstrip()
        + f" at {times[first]:.6g} s is an exporter's mark for no value, or a spike of the telemetry. Such samples "
        "are taken as not measured."
    )
    marked = float(times[first]), float(times[last])
    finding = Finding("no value", "doubt", signal.name, text, float(count), "samples", (signal.name,), marked)
    return np.where(absurd, np.nan, samples), finding
