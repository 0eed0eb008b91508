"""White noise of every channel, from the highest frequencies that it has, against what is stated."""

import numpy as np

from models.measured.checks.evidence import Evidence
from models.measured.finding import Finding
from models.measured.recording import Recording
from models.measured.signal import UNITS, Quantity, Signal

NAME = "noise"
TOP = 0.7, 0.95
"""Part of the highest frequency: above what vehicles do, below what filters and converters do at the end."""
LENGTH, MOST = 1024, 40
"""Samples of a segment, and segments at the most, spread evenly."""
OFF = 1.5
"""Times by which what is stated may be wrong."""


def check(evidence: Evidence) -> list[Finding]:
    """A doubt for every channel whose stated noise is wrong, and a note for each quantity."""
    found = {s: noise(evidence.recording, s) for s in evidence.recording.signals}
    doubts = [_doubt(s, size, evidence.claimed[s.name]) for s, size in found.items() if s.name in evidence.claimed
              and not 1 / OFF < size / max(evidence.claimed[s.name], 1e-300) < OFF]  # fmt: skip
    return doubts + _notes(found)


def noise(recording: Recording, signal: Signal) -> float:
    """Standard deviation (SI) of white noise on every sample; NaN where no segment is unbroken.

    By the median power of the highest lines, whose mean exponential noise makes 1 / log 2 times as large. Of filtered
    channels it is too small: what was there is gone.
    """
    length = min(LENGTH, recording.count)
    firsts = np.linspace(0, recording.count - length, min(MOST, -(-recording.count // length))).astype(int)
    window = np.hanning(length + 2)[1:-1]
    pieces = [recording.columns.read(signal.name, int(first), length) for first in firsts]
    whole = np.array([piece for piece in pieces if np.isfinite(piece).all()])
    if not len(whole):
        return float("nan")
    lines = np.fft.rfft(window * (whole - whole.mean(axis=1, keepdims=True)))
    low, high = (int(part * lines.shape[1]) for part in TOP)
    return float(np.sqrt(np.median(np.abs(lines[:, low:high]) ** 2) / np.log(2) / np.sum(window**2)))


def _doubt(signal: Signal, size: float, stated: float) -> Finding:
    unit = UNITS[signal.quantity]
    text = (f"The noise of {signal.name} is {size:.3g} {unit} on every sample, where the scene states {stated:.3g} "
            f"{unit}: correct [noise], or predictions and filter are off.")  # fmt: skip
    return Finding(NAME, "doubt", signal.name, text, size, unit, (signal.name,))


def _notes(found: dict[Signal, float]) -> list[Finding]:
    sizes: dict[Quantity, list[float]] = {}
    for signal, size in found.items():
        sizes.setdefault(signal.quantity, []).append(size)
    return [_note(what, np.array(own)) for what, own in sizes.items() if np.isfinite(own).any()]


def _note(what: Quantity, sizes: np.ndarray) -> Finding:
    low, high, unit = float(np.nanmin(sizes)), float(np.nanmax(sizes)), UNITS[what]
    text = f"Noise of {what} channels: {low:.3g} to {high:.3g} {unit} on every sample."
    return Finding(NAME, "note", "", text, float(np.nanmean(sizes)), unit)
