"""Zero-phase high-pass: the paper's way to take drift out of rates, angles and positions, and its price.

It takes out whatever is slow, be it an error or a hill: the cut-off is a choice that no record can justify.
"""

import numpy as np

from models.core.errors import InputError

ORDER = 2
"""Order of the Butterworth filter, which runs forwards and backwards: no phase, half the amplitude at the cut-off."""


def check_cut_off(count: int, period: float, cut_off: float, file: str = "", place: str = "high-pass") -> None:
    """Refuse a cut-off (Hz) that ``count`` samples every ``period`` (s) cannot carry."""
    if not 0 < cut_off < 0.5 / period:
        raise InputError(file, place, cut_off, f"the cut-off must lie between 0 and {0.5 / period:g} Hz")
    if count <= round(1 / (cut_off * period)):
        raise InputError(
            file,
            place,
            cut_off,
            f"a record of {(count - 1) * period:g} s is shorter than one period of "
            f"the cut-off, {1 / cut_off:g} s: raise the cut-off",
        )


def high_pass(values: np.ndarray, period: float, cut_off: float) -> np.ndarray:
    """Values (n, ...) without what is slower than ``cut_off`` (Hz), sampled every ``period`` (s).

    A Butterworth filter of order ORDER run forwards and backwards, so that the amplitude falls by 1 / (1 + (fc/f)^4)
    and nothing is delayed; the ends are extended by their mirror image, which
    keeps the mean that is taken out. Raises InputError as ``check_cut_off`` does.
    """
    from scipy.signal import butter, sosfiltfilt

    check_cut_off(len(values), period, cut_off)
    sections = butter(ORDER, cut_off, "highpass", fs=1 / period, output="sos")
    return sosfiltfilt(sections, values, axis=0, padtype="even", padlen=round(1 / (cut_off * period)))
