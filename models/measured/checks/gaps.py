"""Check for gaps: samples that were not measured."""

import numpy as np

from models.core.finding import LISTED_FINDINGS, Finding, FindingWeight
from models.measured.checks.evidence import CheckedRecording
from models.measured.gaps import LONGEST_BRIDGED_GAP, true_runs
from models.measured.signal import MeasuredSignal

CHECK_NAME = "gaps"


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on missing samples, one for each set of channels that miss the same ones; the size is the longest gap in
    s."""
    recording = checked_recording.recording
    sets: dict[tuple[tuple[int, int], ...], list[MeasuredSignal]] = {}
    for signal in recording.signals:
        lost = tuple(map(tuple, true_runs(~np.isfinite(recording.samples(signal))).tolist()))
        if lost:
            sets.setdefault(lost, []).append(signal)
    if not sets:
        return [
            Finding(CHECK_NAME, "note", "", f"No sample of any of the {len(recording.signals)} channels is missing.")
        ]
    return [_gap_finding(checked_recording, np.array(lost), tuple(signals)) for lost, signals in sets.items()]


def _gap_finding(
    checked_recording: CheckedRecording, gap_ranges: np.ndarray, signals: tuple[MeasuredSignal, ...]
) -> Finding:
    """Finding on the gaps (first index and end index of each) that some signals share."""
    period, lengths, names = (
        checked_recording.recording.period,
        gap_ranges[:, 1] - gap_ranges[:, 0],
        tuple(s.name for s in signals),
    )
    longest = int(np.argmax(lengths))
    first, end, lasts = (float(period * samples) for samples in (*gap_ranges[longest], lengths[longest]))
    driving = any(s.quantity in ("force", "moment") and not s.check for s in signals)
    stops = driving and lengths[longest] * period > LONGEST_BRIDGED_GAP
    remedy = (
        "leave it out with [clock] start and duration, for no run can go on without hub forces"
        if stops
        else f"up to {LONGEST_BRIDGED_GAP:g} s are bridged in hub forces, and the filter goes on without angles"
    )
    short = ", ".join(names) if len(names) <= LISTED_FINDINGS else f"{len(names)} channels, {names[0]} to {names[-1]}"
    text = f"{short}: {lasts:.4g} s ({lengths[longest]} samples) are missing from {first:.4g} s on"
    if len(gap_ranges) > 1:
        text += f"; {len(gap_ranges) - 1} shorter gaps, {period * (lengths.sum() - lengths[longest]):.3g} s together"
    weight: FindingWeight = "error" if stops else "doubt"
    return Finding(CHECK_NAME, weight, ", ".join(names), f"{text}: {remedy}.", lasts, "s", names, (first, end))
