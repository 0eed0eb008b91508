"""Low-pass filtering of measured samples without delay."""

import math

import numpy as np

from models.core.errors import InputError

BUTTERWORTH_ORDER = 4
"""Order of the Butterworth low-pass, which runs once forward and once backward."""
LEAST_PERIODS = 1.0
"""Least length of a record in periods of the cut-off frequency: a straight line then passes to 1 %; with a fiftieth of
it, the line was reversed."""


def low_passed(
    samples: np.ndarray, sampling_period: float, cut_off_frequency: float, scene_path: str, key_path: str
) -> np.ndarray:
    """Samples (n, columns) filtered by a Butterworth low-pass forward and backward: no delay, half the amplitude at
    ``cut_off_frequency`` (Hz), order eight in total.

    Beyond the ends the samples go on point-symmetrically, so that the first and the last one keep their values.
    InputError for a bandwidth that is not in the samples, or so low that what goes on beyond the ends is all it leaves.
    """
    from scipy.signal import butter, sosfiltfilt

    fastest, length = 0.5 / sampling_period, (len(samples) - 1) * sampling_period
    if not cut_off_frequency < fastest:
        raise InputError(
            scene_path,
            key_path,
            cut_off_frequency,
            f"must be below {fastest:g} Hz, half the sampling rate of the file: faster motion is not in it",
        )
    if not cut_off_frequency * length >= LEAST_PERIODS * (1 - 1e-9):
        least, lasting = LEAST_PERIODS / length, f"the samples must last {LEAST_PERIODS / cut_off_frequency:.3g} s"
        allowed = f"must be at least {least:.3g} Hz, or {lasting}" if least < fastest else lasting
        raise InputError(
            scene_path,
            key_path,
            cut_off_frequency,
            f"{allowed}: of slower motion the {length:g} s hold no whole period, and what is beyond their ends would "
            "be guessed",
        )
    padding = min(len(samples) - 1, math.ceil(3 / (cut_off_frequency * sampling_period)))
    return sosfiltfilt(
        butter(BUTTERWORTH_ORDER, cut_off_frequency / fastest, output="sos"), samples, axis=0, padlen=padding
    )
