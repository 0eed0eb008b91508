"""A measured channel that was not put in, beside what the run says of it: error by frequency, damage, trust."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.fatigue.damage import pseudo_damage
from models.measured.recording import Recording
from models.measured.signal import Signal
from models.systems.measured.section_run import Outcome, SectionRun
from models.systems.measured.sections import Answer

BANDS = (0.0, 0.5, 4.0, 20.0, 80.0, math.inf)
"""Hz: drift and slow motion, the body on its springs, wheels and engine, what stiff mounts pass on, the rest."""
SEGMENT = 8.0
"""s, of the stretches whose spectra are averaged."""
STRETCH, HALF = 1.0, 0.5
"""s; part of a channel's own rms: a stretch this long with a larger error is not to be trusted."""


@dataclass(frozen=True)
class Band:
    """Frequencies from ``low`` to ``high`` (Hz): rms of what was measured and of the error, in the channel's unit."""

    low: float
    high: float
    measured: float
    error: float


@dataclass(frozen=True)
class Compared:
    """One check channel.

    offset : mean of the error; bands : of all but that; explained : part of the measured variance that the run gives,
    1 at best; damage : of the run by that of the channel, by slope, NaN where the channel never moves; trusted : s
    until the error of a stretch of ``STRETCH`` s exceeds ``HALF`` of the channel's rms, infinite if never.
    """

    signal: Signal
    answer: Answer
    offset: float
    bands: tuple[Band, ...]
    explained: float
    damage: dict[float, float]
    trusted: float


def checks(own: SectionRun) -> tuple[tuple[Signal, Answer], ...]:
    """Every channel that is not put in and that the run answers, with its answer: named as checks, and accelerations.

    Strains and sensors of unknown place have none.
    """
    outside = [s for s in own.recording.signals if s.check or s.quantity == "acceleration"]
    return tuple((s, a) for s in outside for a in own.sections.answers if _same(own, s, a))


def _same(own: SectionRun, signal: Signal, answer: Answer) -> bool:
    """Whether both are the same quantity in the same axes."""
    if not answer.measures(signal):
        return False
    if signal.at in own.vehicle.hubs and signal.quantity in ("force", "moment"):
        return signal.frame == own.sections.frame
    return signal.frame != "inertial" or signal.quantity == "angle"


def overlay(
    recording: Recording, run: Outcome, signal: Signal, answer: Answer, first: int = 0, count: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) in s, measured and computed values (n,) at the run's answers ``first`` and following."""
    skip = round(run.period / recording.period)
    computed = run.columns.read(answer.name, first, min(count or run.done, run.done - first))
    measured = recording.columns.read(signal.name, first * skip, (len(computed) - 1) * skip + 1)[::skip]
    return run.period * (first + np.arange(len(computed))), measured, computed


def compare(
    recording: Recording, run: Outcome, signal: Signal, answer: Answer, slopes: tuple[float, ...] = (3.0, 5.0, 8.0)
) -> Compared:
    """Compare a channel with its answer over all that was run."""
    _, measured, computed = overlay(recording, run, signal, answer)
    known = np.isfinite(measured)
    error, size = computed - measured, float(np.std(measured[known])) if known.any() else math.nan
    left = float(np.var(error[known])) if known.any() else math.nan
    return Compared(
        signal,
        answer,
        float(np.mean(error[known])) if known.any() else math.nan,
        _bands(measured, error, run.period),
        1.0 - left / size**2 if size > 0 else math.nan,
        {slope: _ratio(computed[known], measured[known], slope) for slope in slopes},
        _trusted(error - np.mean(error[known]), size, run.period),
    )


def _ratio(computed: np.ndarray, measured: np.ndarray, slope: float) -> float:
    """Damage of the run by that of the channel, both where the channel was measured."""
    true = pseudo_damage(measured, slope) if len(measured) else 0.0
    return pseudo_damage(computed, slope) / true if true > 0 else math.nan


def _bands(measured: np.ndarray, error: np.ndarray, period: float) -> tuple[Band, ...]:
    """rms by band, from averaged spectra of overlapping stretches under a Hann window; those with gaps are left out."""
    length = min(round(SEGMENT / period), len(error))
    window = np.hanning(length + 1)[:-1]
    power, used = np.zeros((2, length // 2 + 1)), 0
    for first in range(0, len(error) - length + 1, max(length // 2, 1)):
        both = np.stack([each[first : first + length] for each in (measured, error)])
        if np.isfinite(both).all():
            power += np.abs(np.fft.rfft((both - both.mean(axis=1, keepdims=True)) * window, axis=1)) ** 2
            used += 1
    if used == 0:
        return ()
    power *= 2.0 / (used * length * np.sum(window**2))  # mean squares, from both halves of the spectrum
    frequencies = np.fft.rfftfreq(length, period)
    found = []
    for low, high in pairwise(BANDS):
        inside = (frequencies >= low) & (frequencies < high)
        if inside.any():
            found.append(Band(low, min(high, 0.5 / period), *np.sqrt(power[:, inside].sum(axis=1))))
    return tuple(found)


def _trusted(error: np.ndarray, size: float, period: float) -> float:
    """When the error of a stretch first exceeds ``HALF`` of a size (s)."""
    length = max(round(STRETCH / period), 1)
    whole = error[: len(error) // length * length].reshape(-1, length)
    rms = np.sqrt(np.nanmean(np.where(np.isfinite(whole), whole, 0.0) ** 2, axis=1))
    beyond = np.flatnonzero(rms > HALF * size)
    return float(beyond[0] * length * period) if len(beyond) else math.inf
