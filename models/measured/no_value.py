"""Samples that no transducer can have measured: the marks for "no value" of exporters, and broken telegrams.

Exporters write 9.9E+34, 1E+30, the largest number of a format, or infinity where nothing was measured. Such a sample
is taken as not measured, NaN, before anything is resampled: it would drown whatever is filtered or averaged with it.
"""

import numpy as np

from models.core.finding import Finding
from models.measured.gaps import gaps
from models.measured.signal import Quantity, Signal

NAME = "no value"
LIMITS: dict[Quantity, float] = {
    "force": 1e6,
    "moment": 1e6,
    "acceleration": 1e4,
    "angular rate": 1e3,
    "angle": 100.0,
    "travel": 100.0,
    "strain": 1.0,
}
"""SI: ten times and more what the transducers of a vehicle measure (a force of 100 t, 1000 g)."""
FAR = 1000.0
"""Times the departure from the median that half of all samples do not exceed. A wrong unit makes all samples large
alike, and is the business of the checks of weight and motion."""
MARK = 1e30
"""What is beyond this is a mark, however many samples have it."""


def without_absurd(signal: Signal, values: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, Finding | None]:
    """Values (n,) in SI with NaN for what cannot have been measured, and the finding that says so; times (n,) in s.

    A sample is absurd if it is a mark, or beyond LIMITS and FAR times farther from the median than half of all.
    """
    if not (np.abs(values) > LIMITS[signal.quantity]).any():
        return values, None
    absurd = ~(np.abs(values) < MARK) & ~np.isnan(values)
    good = values[~absurd & ~np.isnan(values)]
    if len(good):
        away = np.abs(good - np.median(good))
        far = np.maximum(FAR * np.median(away), LIMITS[signal.quantity])
        absurd[np.flatnonzero(~absurd & ~np.isnan(values))[away > far]] = True
    if not absurd.any():
        return values, None
    return np.where(absurd, np.nan, values), _finding(signal, values, times, absurd)


def _finding(signal: Signal, values: np.ndarray, times: np.ndarray, absurd: np.ndarray) -> Finding:
    runs = gaps(np.where(absurd, np.nan, 0.0))
    first, end = runs[0][0], runs[-1][1] - 1
    count, written = int(absurd.sum()), values[first] / (signal.sign * signal.factor) + signal.zero
    many = f"{count} samples in {len(runs)} stretch(es) are" if count > 1 else "a sample is"
    text = (
        f"{signal.file}, {signal.channel}: {many} no {signal.quantity}: {written:.4g} {signal.unit}".rstrip()
        + f" at {times[first]:.6g} s is an exporter's mark for no value, or a spike of the telemetry. Such samples "
        "are taken as not measured."
    )
    return Finding(
        NAME,
        "doubt",
        signal.name,
        text,
        float(count),
        "samples",
        (signal.name,),
        (float(times[first]), float(times[end])),
    )
