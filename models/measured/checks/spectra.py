"""Spectra of signals of a recording, computed segment by segment: means, noise floors and cross spectra.

An hour costs no more memory than a minute.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal

SEGMENT_LENGTH = 4.0
"""Length (s) of a segment, which resolves the modes of a car; shorter in a short recording."""
FEWEST_SEGMENTS = 3
"""Least number of half-overlapping segments in a recording."""
FEWEST_FREQUENCIES = 2
"""Least number of frequencies in the band."""
MOST_SEGMENTS = 300
"""Most segments that are evaluated, spread evenly: ten minutes."""
OVERLAP_FACTOR = 0.75
"""Number of independent averages per half-overlapping segment under a Hann window, about."""
HIGHEST_LINES_SHARE = 0.7, 0.95
"""Band of the noise estimate as shares of the highest frequency: above what vehicles do, below the edge of filters and
converters."""
PIECE_LENGTH, MOST_PIECES = 1024, 40
"""Number of samples of a piece for the noise estimate, and most pieces, spread evenly."""
SIDE_LINE_RANGE = range(2, 5)
"""Spectral lines beside the main lobe of the window, whose power is taken for that at 0 Hz."""


@dataclass(frozen=True)
class CrossSpectra:
    """Cross spectra averaged over segments: cross_spectra (f, n, n) = mean of X_i conj(X_j) at frequencies (f,) in Hz,
    for n signals.

    independent_averages : how many independent ones; segments with a sample that is missing are left out.
    white_noise_power : power in every line of white noise of variance 1.
    """

    frequencies: np.ndarray
    cross_spectra: np.ndarray
    independent_averages: float
    white_noise_power: float


def cross_spectra(
    recording: Recording,
    signals: tuple[MeasuredSignal, ...],
    frequency_band: Sequence[float],
    sample_range: tuple[int, int] | None = None,
) -> CrossSpectra | None:
    """Cross spectra of signals in a band (Hz), in SI units squared by window sums squared; None if too few segments are
    complete, or if the band contains too few frequency lines.

    sample_range : first sample and number of samples that are looked at; else all.
    """
    begin, count = sample_range or (0, recording.count)
    length = min(round(SEGMENT_LENGTH / recording.period), 2 * count // (FEWEST_SEGMENTS + 1))
    firsts = np.arange(begin, begin + count - length + 1, max(length // 2, 1))
    frequencies = np.fft.rfftfreq(length, recording.period)
    in_band = (frequencies >= frequency_band[0]) & (frequencies <= frequency_band[1])
    window, names = np.hanning(length + 1)[:length, None], tuple(s.name for s in signals)
    cross, segments = np.zeros((in_band.sum(), len(signals), len(signals)), complex), 0
    for first in firsts[:: -(-len(firsts) // MOST_SEGMENTS)] if length > 1 else ():
        samples = recording.columns.block(names, int(first), length)
        if np.isfinite(samples).all():
            lines = np.fft.rfft(window * (samples - samples.mean(axis=0)), axis=0)[in_band]
            cross += lines[:, :, None] * lines[:, None, :].conj()
            segments += 1
    if segments < FEWEST_SEGMENTS or np.count_nonzero(in_band) < FEWEST_FREQUENCIES:
        return None
    return CrossSpectra(
        frequencies[in_band], cross / segments, max(1.0, OVERLAP_FACTOR * segments), float(np.sum(window**2))
    )


def white_noise(recording: Recording, signal: MeasuredSignal) -> float:
    """Standard deviation (SI) of the white noise on every sample of a signal; NaN if no piece is complete.

    By the median power of the highest lines, whose mean exponential noise makes 1 / log 2 times as large. Of filtered
    channels it is too small: what was there is gone.
    """
    length = min(PIECE_LENGTH, recording.count)
    firsts = np.linspace(0, recording.count - length, min(MOST_PIECES, -(-recording.count // length))).astype(int)
    window = np.hanning(length + 2)[1:-1]
    pieces = [recording.columns.read(signal.name, int(first), length) for first in firsts]
    whole = np.array([piece for piece in pieces if np.isfinite(piece).all()])
    if not len(whole):
        return float("nan")
    lines = np.fft.rfft(window * (whole - whole.mean(axis=1, keepdims=True)))
    low, high = (int(part * lines.shape[1]) for part in HIGHEST_LINES_SHARE)
    return float(np.sqrt(np.median(np.abs(lines[:, low:high]) ** 2) / np.log(2) / np.sum(window**2)))


def windowed_means(column_readers: Sequence[Callable[[], np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Means (k,), weighted by a Hann window, of the columns (n,) that the k functions read, and the covariance (k, k)
    of the means' errors.

    Samples that are NaN in any are left out; one column at a time is in memory. The window takes away what a plain mean
    owes to where the record happens to begin and end. The covariance is the power of the lines just above the window's
    lobe: that of vehicles falls towards 0 Hz, so that it is rather too large. InputError is not raised: all NaN gives
    NaN.
    """
    good = np.isfinite(column_readers[0]())
    for read in column_readers[1:]:
        good &= np.isfinite(read())
    n = len(good)
    window = np.where(good, np.hanning(n + 2)[1:-1], 0.0)
    window = window / window.sum() if good.any() else np.full(n, np.nan)
    waves = [np.exp(-2j * np.pi * k * np.arange(n) / n) * window for k in SIDE_LINE_RANGE]
    centre, lines = np.empty(len(column_readers)), np.empty((len(waves), len(column_readers)), complex)
    for i, read in enumerate(column_readers):
        values = np.where(good, read(), 0.0)
        centre[i] = window @ values
        rest = np.where(good, values - centre[i], 0.0)
        lines[:, i] = [wave @ rest for wave in waves]
    power = sum(np.outer(line, line.conj()).real for line in lines) / len(lines)
    return centre, np.asarray(power)
