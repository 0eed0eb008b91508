"""Check for clipped and dead channels: values that accumulate at an extreme, or never change."""

import numpy as np

from models.core.finding import Finding, FindingWeight
from models.measured.checks.evidence import CheckedRecording
from models.measured.gaps import LONGEST_BRIDGED_GAP, true_runs
from models.measured.signal import UNIT_OF_QUANTITY, MeasuredSignal

CHECK_NAME = "clipped"
FEWEST_EXTREME_SAMPLES = 6
"""Least number of samples at an extreme value for a finding."""
EXTREME_COUNT_RATIO = 5
"""Least ratio of the number of samples at the extreme to the number at the next value: in the tail of a rounded
channel, the next value is the more frequent one."""
STUCK_DURATION = 0.02
"""Time (s) for which a channel that keeps one value is stuck, if this is also STUCK_DURATION_RATIO times longer than
usual. Up to the length of a gap that would be bridged, it is only a doubt."""
STUCK_DURATION_RATIO = 20
"""Ratio of the time at one value to the usual one above which a channel is stuck."""
ROUNDING_VARIATION_SHARE = 1e-9
"""Ratio of a channel's variation to the largest value of its quantity below which the channel holds only rounding."""


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on channels that are clipped or keep one value. Sizes are shares of samples in %, or for a constant
    value its duration in s."""
    findings = [
        finding
        for signal in checked_recording.recording.signals
        for finding in _signal_findings(checked_recording, signal)
    ]
    return findings or [Finding(CHECK_NAME, "note", "", "No channel is clipped or stands still.")]


def _signal_findings(checked_recording: CheckedRecording, signal: MeasuredSignal) -> list[Finding]:
    """Findings on one signal that is dead, clipped or stuck."""
    values, period = checked_recording.recording.samples(signal), checked_recording.recording.period
    good = values[np.isfinite(values)]
    if len(good) and good.min() == good.max():
        text = (
            f"{signal.name} reads {good[0]:.4g} {UNIT_OF_QUANTITY[signal.quantity]} from beginning to "
            "end: it is dead, or the "
            "map names another channel. Leave it out or name the right one."
        )
        return [
            Finding(CHECK_NAME, "error", signal.name, text, checked_recording.recording.duration, "s", (signal.name,))
        ]
    measured = len(good) and np.ptp(good) > ROUNDING_VARIATION_SHARE * _largest_of_quantity(checked_recording, signal)
    findings = (
        [_clipped_finding(signal, values, good, end, period) for end in clipping_extremes(values)] if measured else []
    )
    return findings or _stuck_findings(signal, values, period)


def _largest_of_quantity(checked_recording: CheckedRecording, signal: MeasuredSignal) -> float:
    """Largest value among all channels with the signal's quantity."""
    alike = [other for other in checked_recording.recording.signals if other.quantity == signal.quantity]
    return max(float(np.nanmax(np.abs(checked_recording.recording.samples(other)), initial=0.0)) for other in alike)


def clipping_extremes(samples: np.ndarray) -> list[float]:
    """Extreme values at which the samples (n,) of a channel are clipped, because many samples lie exactly there; NaN is
    ignored."""
    good = samples[np.isfinite(samples)]
    if not len(good) or good.min() == good.max():
        return []
    return [float(end) for end in (good.min(), good.max()) if _is_clipped_at(samples, good, end)]


def _is_clipped_at(samples: np.ndarray, is_valid: np.ndarray, extreme_value: float) -> bool:
    """Whether many samples lie exactly at an extreme value, some of them in succession."""
    at, others = int(np.count_nonzero(is_valid == extreme_value)), is_valid[is_valid != extreme_value]
    next_to = others[np.argmin(np.abs(others - extreme_value))]
    if at < FEWEST_EXTREME_SAMPLES or at < EXTREME_COUNT_RATIO * np.count_nonzero(is_valid == next_to):
        return False
    runs_at_limit = true_runs(samples == extreme_value)
    return bool(np.max(runs_at_limit[:, 1] - runs_at_limit[:, 0]) >= 2)


def _clipped_finding(
    signal: MeasuredSignal, samples: np.ndarray, is_valid: np.ndarray, extreme_value: float, sampling_period: float
) -> Finding:
    """Finding on a channel that is clipped at one extreme value."""
    at, clipped_runs = int(np.count_nonzero(is_valid == extreme_value)), true_runs(samples == extreme_value)
    share, first = 100 * at / len(is_valid), float(sampling_period * clipped_runs[0, 0])
    text = (
        f"{signal.name} is clipped at {extreme_value:.5g} {UNIT_OF_QUANTITY[signal.quantity]}: {at} samples in "
        f"{len(clipped_runs)} runs, "
        f"{share:.3g} % of all, the first from {first:.4g} s on. What lay beyond is lost, and damage comes out too "
        "small: measure again with a wider range, or leave these times out."
    )
    return Finding(
        CHECK_NAME,
        "doubt",
        signal.name,
        text,
        share,
        "%",
        (signal.name,),
        (first, float(sampling_period * clipped_runs[0, 1])),
    )


def _stuck_findings(signal: MeasuredSignal, samples: np.ndarray, sampling_period: float) -> list[Finding]:
    """Finding on the longest time for which a channel keeps one value, though it changes otherwise."""
    same = true_runs(np.diff(samples) == 0)
    if not len(same):
        return []
    longest = int(np.argmax(same[:, 1] - same[:, 0]))
    usual = len(samples) / (1 + np.count_nonzero(np.diff(samples)))
    if same[longest, 1] - same[longest, 0] < max(STUCK_DURATION / sampling_period, STUCK_DURATION_RATIO * usual):
        return []
    first, end = (float(sampling_period * i) for i in same[longest])
    held = f"{samples[same[longest, 0]]:.5g} {UNIT_OF_QUANTITY[signal.quantity]}"
    text = (
        f"{signal.name} stands still at {held} for {end - first:.4g} s from {first:.4g} s on: its last value was "
        "held over a gap; leave these times out."
    )
    weight: FindingWeight = "doubt" if signal.check or end - first <= LONGEST_BRIDGED_GAP else "error"
    return [Finding(CHECK_NAME, weight, signal.name, text, end - first, "s", (signal.name,), (first, end))]
