"""Computing times as text: the median with the range of several runs, or the time of a single run with the word
"once"."""

from collections.abc import Sequence

import numpy as np


def duration_text(seconds: float) -> str:
    """Text of a time (s) in a suitable unit."""
    for factor, unit in ((1.0, "s"), (1e3, "ms")):
        if factor * seconds >= 1.0:
            return f"{factor * seconds:.3g} {unit}"
    return f"{1e6 * seconds:.3g} us"


def seconds_text(seconds: Sequence[float] | np.ndarray) -> str:
    """Text on the computing times (s) of repeated runs: "12 ms (11 ms to 15 ms)", or "12 ms once"."""
    values = np.asarray(seconds, float)
    middle = duration_text(float(np.median(values)))
    if values.size == 1:
        return f"{middle} once"
    return f"{middle} ({duration_text(float(values.min()))} to {duration_text(float(values.max()))})"
