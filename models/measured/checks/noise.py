"""Check of the white noise of every channel, from its highest frequencies, against the stated noise."""

import numpy as np

from models.core.finding import Finding
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.spectra import white_noise
from models.measured.signal import UNIT_OF_QUANTITY, Quantity

CHECK_NAME = "noise"
STATED_NOISE_RATIO_LIMIT = 1.5
"""Factor by which the stated noise may be wrong."""


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on noise: a doubt for each channel whose stated noise is wrong, and a note for each quantity."""
    doubts, sizes = list[Finding](), dict[Quantity, list[float]]()
    for signal in checked_recording.recording.signals:
        size, stated, unit = (
            white_noise(checked_recording.recording, signal),
            checked_recording.stated_noise.get(signal.name),
            UNIT_OF_QUANTITY[signal.quantity],
        )
        sizes.setdefault(signal.quantity, []).append(size)
        if (
            stated is not None
            and np.isfinite(size)
            and not 1 / STATED_NOISE_RATIO_LIMIT < size / max(stated, 1e-300) < STATED_NOISE_RATIO_LIMIT
        ):
            text = (
                f"The noise of {signal.name} is {size:.3g} {unit} on every sample, where the scene states {stated:.3g} "
                f"{unit}: correct [noise], or predictions and filter are off."
            )
            doubts.append(Finding(CHECK_NAME, "doubt", signal.name, text, size, unit, (signal.name,)))
    notes = list[Finding]()
    for what, deviations in sizes.items():
        if np.isfinite(deviations).any():
            unit, low, high = UNIT_OF_QUANTITY[what], float(np.nanmin(deviations)), float(np.nanmax(deviations))
            text = f"Noise of {what} channels: {low:.3g} to {high:.3g} {unit} on every sample."
            notes.append(Finding(CHECK_NAME, "note", "", text, float(np.nanmean(deviations)), unit))
    return doubts + notes
