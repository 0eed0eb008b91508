"""Check for clipped and dead channels: values that accumulate at an extreme, or never change."""

import numpy as np

from models.core.finding import Finding, FindingWeight
from models.measured.checks.evidence import Evidence
from models.measured.gaps import LONGEST_BRIDGED_GAP, true_runs
from models.measured.signal import UNIT_OF_QUANTITY, Signal

NAME = "clipped"
FEWEST_EXTREME_SAMPLES = 6
"""Least number of samples at an extreme value for a finding."""
PILE_RATIO = 5
"""Least ratio of the number of samples at the extreme to the number at the next value: in the tail of a rounded
channel, the next value is the more frequent one."""
STUCK_DURATION = 0.02
"""Time (s) for which a channel that keeps one value is stuck, if this is also USUAL_STUCK_FACTOR times longer than
usual. Up to the length of a gap that would be bridged, it is only a doubt."""
USUAL_STUCK_FACTOR = 20
"""Ratio of the time at one value to the usual one above which a channel is stuck."""
ROUNDED_SHARE = 1e-9
"""Ratio of a channel's variation to the largest value of its quantity below which the channel holds only rounding."""


def check(evidence: Evidence) -> list[Finding]:
    """Findings on channels that are clipped or keep one value. Sizes are shares of samples in %, or for a constant
    value its duration in s."""
    findings = [finding for signal in evidence.recording.signals for finding in _signal_findings(evidence, signal)]
    return findings or [Finding(NAME, "note", "", "No channel is clipped or stands still.")]


def _signal_findings(evidence: Evidence, signal: Signal) -> list[Finding]:
    """Findings on one signal that is dead, clipped or stuck."""
    values, period = evidence.recording.samples(signal), evidence.recording.period
    good = values[np.isfinite(values)]
    if len(good) and good.min() == good.max():
        text = (
            f"{signal.name} reads {good[0]:.4g} {UNIT_OF_QUANTITY[signal.quantity]} from beginning to "
            "end: it is dead, or the "
            "map names another channel. Leave it out or name the right one."
        )
        return [Finding(NAME, "error", signal.name, text, evidence.recording.duration, "s", (signal.name,))]
    measured = len(good) and np.ptp(good) > ROUNDED_SHARE * _largest_of_quantity(evidence, signal)
    findings = (
        [_clipped_finding(signal, values, good, end, period) for end in clipping_extremes(values)] if measured else []
    )
    return findings or _stuck_findings(signal, values, period)


def _largest_of_quantity(evidence: Evidence, signal: Signal) -> float:
    """Largest value among all channels with the signal's quantity."""
    alike = [other for other in evidence.recording.signals if other.quantity == signal.quantity]
    return max(float(np.nanmax(np.abs(evidence.recording.samples(other)), initial=0.0)) for other in alike)


def clipping_extremes(values: np.ndarray) -> list[float]:
    """Extreme values at which the samples (n,) of a channel are clipped, because many samples lie exactly there; NaN is
    ignored."""
    good = values[np.isfinite(values)]
    if not len(good) or good.min() == good.max():
        return []
    return [float(end) for end in (good.min(), good.max()) if _is_piled(values, good, end)]


def _is_piled(values: np.ndarray, valid: np.ndarray, end: float) -> bool:
    """Whether many samples lie exactly at an extreme value, some of them in succession."""
    at, others = int(np.count_nonzero(valid == end)), valid[valid != end]
    next_to = others[np.argmin(np.abs(others - end))]
    if at < FEWEST_EXTREME_SAMPLES or at < PILE_RATIO * np.count_nonzero(valid == next_to):
        return False
    runs_at_limit = true_runs(values == end)
    return bool(np.max(runs_at_limit[:, 1] - runs_at_limit[:, 0]) >= 2)


def _clipped_finding(signal: Signal, values: np.ndarray, valid: np.ndarray, end: float, period: float) -> Finding:
    """Finding on a channel that is clipped at one extreme value."""
    at, clipped_runs = int(np.count_nonzero(valid == end)), true_runs(values == end)
    share, first = 100 * at / len(valid), float(period * clipped_runs[0, 0])
    text = (
        f"{signal.name} is clipped at {end:.5g} {UNIT_OF_QUANTITY[signal.quantity]}: {at} samples in "
        f"{len(clipped_runs)} runs, "
        f"{share:.3g} % of all, the first from {first:.4g} s on. What lay beyond is lost, and damage comes out too "
        "small: measure again with a wider range, or leave these times out."
    )
    return Finding(
        NAME, "doubt", signal.name, text, share, "%", (signal.name,), (first, float(period * clipped_runs[0, 1]))
    )


def _stuck_findings(signal: Signal, values: np.ndarray, period: float) -> list[Finding]:
    """Finding on the longest time for which a channel keeps one value, though it changes otherwise."""
    same = true_runs(np.diff(values) == 0)
    if not len(same):
        return []
    longest = int(np.argmax(same[:, 1] - same[:, 0]))
    usual = len(values) / (1 + np.count_nonzero(np.diff(values)))
    if same[longest, 1] - same[longest, 0] < max(STUCK_DURATION / period, USUAL_STUCK_FACTOR * usual):
        return []
    first, end = (float(period * i) for i in same[longest])
    held = f"{values[same[longest, 0]]:.5g} {UNIT_OF_QUANTITY[signal.quantity]}"
    text = (
        f"{signal.name} stands still at {held} for {end - first:.4g} s from {first:.4g} s on: its last value was "
        "held over a gap; leave these times out."
    )
    weight: FindingWeight = "doubt" if signal.check or end - first <= LONGEST_BRIDGED_GAP else "error"
    return [Finding(NAME, weight, signal.name, text, end - first, "s", (signal.name,), (first, end))]
