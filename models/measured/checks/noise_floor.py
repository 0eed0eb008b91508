"""White noise of a signal, by the highest frequencies that it has."""

import numpy as np

from models.measured.recording import Recording
from models.measured.signal import Signal

TOP = 0.7, 0.95
"""Part of the highest frequency: above what vehicles do, below what filters and converters do at the end."""
LENGTH, MOST = 1024, 40
"""Samples of a segment, and segments at the most, spread evenly."""


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
