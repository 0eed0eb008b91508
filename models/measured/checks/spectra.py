"""Cross spectra of signals of a recording, segment by segment: an hour costs no more memory than a minute."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.measured.recording import Recording
from models.measured.signal import Signal

SEGMENT = 4.0
"""s: resolves the modes of a car; shorter where the recording is."""
LEAST = 3
"""Segments in a recording at the least, half overlapping."""
LINES = 2
"""Frequencies in the band at the least."""
MOST = 300
"""Segments looked at, spread evenly: ten minutes."""
OVERLAPPING = 0.75
"""Independent averages that a half overlapping segment under a Hann window counts for, about."""


@dataclass(frozen=True)
class Spectra:
    """Means over segments: cross (f, n, n) = mean of X_i conj(X_j) at frequencies (f,) in Hz.

    averages : how many independent ones; segments with a sample that is missing are left out. white : power in every
    line of white noise of variance 1.
    """

    frequencies: np.ndarray
    cross: np.ndarray
    averages: float
    white: float


def spectra(
    recording: Recording, signals: tuple[Signal, ...], band: Sequence[float], stretch: tuple[int, int] | None = None
) -> Spectra | None:
    """Of a band (Hz), in SI units squared by window sums squared; None where too little is unbroken, or the band
    has no line.

    stretch : first sample and number of samples that are looked at; else all.
    """
    begin, count = stretch or (0, recording.count)
    length = min(round(SEGMENT / recording.period), 2 * count // (LEAST + 1))
    firsts = np.arange(begin, begin + count - length + 1, max(length // 2, 1))
    frequencies = np.fft.rfftfreq(length, recording.period)
    own = (frequencies >= band[0]) & (frequencies <= band[1])
    window, names = np.hanning(length + 1)[:length, None], tuple(s.name for s in signals)
    cross, found = np.zeros((own.sum(), len(signals), len(signals)), complex), 0
    for first in firsts[:: -(-len(firsts) // MOST)] if length > 1 else ():
        samples = recording.columns.block(names, int(first), length)
        if np.isfinite(samples).all():
            lines = np.fft.rfft(window * (samples - samples.mean(axis=0)), axis=0)[own]
            cross += lines[:, :, None] * lines[:, None, :].conj()
            found += 1
    if found < LEAST or np.count_nonzero(own) < LINES:
        return None
    return Spectra(frequencies[own], cross / found, max(1.0, OVERLAPPING * found), float(np.sum(window**2)))
