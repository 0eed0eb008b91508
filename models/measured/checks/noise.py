"""White noise of every channel, from the highest frequencies that it has, against what is stated."""

import numpy as np

from models.core.finding import Finding
from models.measured.checks.evidence import Evidence
from models.measured.checks.noise_floor import noise
from models.measured.signal import UNITS, Quantity, Signal

NAME = "noise"
OFF = 1.5
"""Times by which what is stated may be wrong."""


def check(evidence: Evidence) -> list[Finding]:
    """A doubt for every channel whose stated noise is wrong, and a note for each quantity."""
    found = {s: noise(evidence.recording, s) for s in evidence.recording.signals}
    doubts = [
        _doubt(s, size, evidence.claimed[s.name])
        for s, size in found.items()
        if s.name in evidence.claimed
        and np.isfinite(size)
        and not 1 / OFF < size / max(evidence.claimed[s.name], 1e-300) < OFF
    ]
    return doubts + _notes(found)


def _doubt(signal: Signal, size: float, stated: float) -> Finding:
    unit = UNITS[signal.quantity]
    text = (
        f"The noise of {signal.name} is {size:.3g} {unit} on every sample, where the scene states {stated:.3g} "
        f"{unit}: correct [noise], or predictions and filter are off."
    )
    return Finding(NAME, "doubt", signal.name, text, size, unit, (signal.name,))


def _notes(found: dict[Signal, float]) -> list[Finding]:
    sizes: dict[Quantity, list[float]] = {}
    for signal, size in found.items():
        sizes.setdefault(signal.quantity, []).append(size)
    return [_note(what, np.array(own)) for what, own in sizes.items() if np.isfinite(own).any()]


def _note(what: Quantity, sizes: np.ndarray) -> Finding:
    low, high, unit = float(np.nanmin(sizes)), float(np.nanmax(sizes)), UNITS[what]
    text = f"Noise of {what} channels: {low:.3g} to {high:.3g} {unit} on every sample."
    return Finding(NAME, "note", "", text, float(np.nanmean(sizes)), unit)
