"""The mean of a long record, and how well it is known."""

import numpy as np

LINES = range(2, 5)
"""Spectral lines beside the main lobe of the window, whose power stands for that at 0."""


def mean(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean of values (n, k) under a Hann window, and the covariance (k, k) of its random error; NaN are left out.

    The window takes away what a plain mean owes to where the record happens to begin and end. The covariance is the
    power of the lines just above the window's lobe: that of vehicles falls towards 0 Hz, so that it is rather too
    large. InputError is not raised: all NaN gives NaN.
    """
    good = np.isfinite(values).all(axis=1)
    n = len(values)
    window = np.where(good, np.hanning(n + 2)[1:-1], 0.0)
    window = window / window.sum() if good.any() else np.full(n, np.nan)
    centre = window @ np.where(good[:, None], values, 0.0)
    rest = np.where(good[:, None], values - centre, 0.0)
    lines = [np.exp(-2j * np.pi * k * np.arange(n) / n) * window @ rest for k in LINES]
    power = sum(np.outer(line, line.conj()).real for line in lines) / len(LINES)
    return centre, np.asarray(power)
