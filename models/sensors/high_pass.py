"""Zero-phase high-pass: the paper's way to take drift out of rates, angles and positions, and its price.

It takes out whatever is slow, be it an error or a hill: the cut-off is a choice that no record can justify.
"""

import numpy as np

from models.errors import InputError

ORDER = 2
"""Order of the Butterworth filter, which runs forwards and backwards: no phase, half the amplitude at the cut-off."""


def high_pass(values: np.ndarray, period: float, cut_off: float) -> np.ndarray:
    """Values (n, ...) without what is slower than ``cut_off`` (Hz), sampled every ``period`` (s).

    A Butterworth filter of order ORDER run forwards and backwards, so that the amplitude falls by 1 / (1 + (fc/f)^4)
    and nothing is delayed; the ends are extended by odd reflection. Raises InputError if the record is shorter than
    the filter's own length, or the cut-off is not below half the sampling rate.
    """
    from scipy.signal import butter, sosfiltfilt

    if not 0 < cut_off < 0.5 / period:
        raise InputError("", "high-pass", cut_off, f"the cut-off must lie between 0 and {0.5 / period:g} Hz")
    length = round(1 / (cut_off * period))
    if len(values) <= length:
        raise InputError("", "high-pass", cut_off, f"a record of {(len(values) - 1) * period:g} s is shorter than one "
                         f"period of the cut-off, {1 / cut_off:g} s: raise the cut-off")
    sections = butter(ORDER, cut_off, "highpass", fs=1 / period, output="sos")
    return sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=length)
