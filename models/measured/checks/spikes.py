"""Check for spikes: one or two samples that stand out from those before and after."""

import numpy as np

from models.core.finding import Finding
from models.measured.checks.evidence import CheckedRecording
from models.measured.signal import UNIT_OF_QUANTITY, MeasuredSignal

CHECK_NAME = "spikes"
SPIKE_WIDTHS = 1, 2
"""Widths of spikes in samples: one from a transducer or a converter, two where a jittering clock was corrected."""
STEEP_RATIO, HIGH_RATIO = 6.0, 3.0
"""Least height of both sides of a spike: ratio to the step from sample to sample that 99 % do not exceed (Gaussian
noise reaches a third of it), and ratio to the channel's standard deviation (lower spikes add no damage)."""
USUAL_SPIKE_SHARE = 0.99
"""Share of the steps that defines the usual step."""


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on spikes of one or two samples; the size is the height of the highest spike, in the channel's unit."""
    recording = checked_recording.recording
    findings = [_spike_finding(signal, recording.samples(signal), recording.period) for signal in recording.signals]
    return [finding for finding in findings if finding] or [
        Finding(CHECK_NAME, "note", "", "No channel has a single-sample spike.")
    ]


def spike_positions(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index (k,) of the first sample of each spike in values (n,), NaN where not measured, and the spikes' signed
    heights (k,)."""
    steps = np.diff(samples)
    known = np.abs(steps[np.isfinite(steps)])
    if not len(known):
        return np.empty(0, np.int64), np.empty(0)
    least = max(STEEP_RATIO * float(np.quantile(known, USUAL_SPIKE_SHARE)), HIGH_RATIO * float(np.nanstd(samples)))
    heights = np.zeros(len(samples))
    for width in SPIKE_WIDTHS:
        up, down = steps[: len(steps) - width], -steps[width:]
        height = np.where(up * down > 0, np.sign(up) * np.minimum(np.abs(up), np.abs(down)), 0.0)
        heights[1 : 1 + len(height)] += np.where(np.abs(height) > least, height, 0.0)
    return np.flatnonzero(heights), heights[heights != 0.0]


def _spike_finding(signal: MeasuredSignal, samples: np.ndarray, sampling_period: float) -> Finding | None:
    """Finding on the spikes of one signal; None if there are none."""
    at, heights = spike_positions(samples)
    if not len(at):
        return None
    worst, unit = int(np.abs(heights).argmax()), UNIT_OF_QUANTITY[signal.quantity]
    text = (
        f"{signal.name} has {len(at)} spike(s) of one or two samples, the highest by {heights[worst]:+.4g} {unit} "
        f"at {sampling_period * at[worst]:.6g} s. A transducer or its cable makes such, and their damage is none of "
        "the "
        "vehicle's: repair the file, or leave these times out. So may a sharp edge of the road, which the sampling "
        "then hardly resolves."
    )
    times = sampling_period * (at[worst] - 1), sampling_period * (at[worst] + 2)
    return Finding(CHECK_NAME, "doubt", signal.name, text, float(heights[worst]), unit, (signal.name,), times)
