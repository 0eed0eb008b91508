"""The mean of a long record, and how well it is known."""

from collections.abc import Callable, Sequence

import numpy as np

LINES = range(2, 5)
"""Spectral lines beside the main lobe of the window, whose power stands for that at 0."""


def mean(columns: Sequence[Callable[[], np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Means (k,) under a Hann window of what each of these reads, (n,), and the covariance (k, k) of their errors.

    Samples that are NaN in any are left out; one column at a time is in memory. The window takes away what a plain mean
    owes to where the record happens to begin and end. The covariance is the power of the lines just above the window's
    lobe: that of vehicles falls towards 0 Hz, so that it is rather too large. InputError is not raised: all NaN gives
    NaN.
    """
    good = np.isfinite(columns[0]())
    for read in columns[1:]:
        good &= np.isfinite(read())
    n = len(good)
    window = np.where(good, np.hanning(n + 2)[1:-1], 0.0)
    window = window / window.sum() if good.any() else np.full(n, np.nan)
    waves = [np.exp(-2j * np.pi * k * np.arange(n) / n) * window for k in LINES]
    centre, lines = np.empty(len(columns)), np.empty((len(waves), len(columns)), complex)
    for i, read in enumerate(columns):
        values = np.where(good, read(), 0.0)
        centre[i] = window @ values
        rest = np.where(good, values - centre[i], 0.0)
        lines[:, i] = [wave @ rest for wave in waves]
    power = sum(np.outer(line, line.conj()).real for line in lines) / len(lines)
    return centre, np.asarray(power)
