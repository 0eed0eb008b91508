"""Angles against rates of the same body: the derivative of one is the other, in sign, unit and time."""

import numpy as np

from models.core.finding import Finding
from models.measured.checks.evidence import Evidence
from models.measured.checks.spectra import Spectra, spectra
from models.measured.ratios import sentence
from models.measured.signal import Signal

NAME = "turning"
BAND = 0.5, 12.0
"""Hz."""
COHERENT = 0.8
"""Squared coherence of lines that are used; below it noise speaks."""
ALIKE = 0.25
"""Part of a rate in phase with the angle's derivative from which on a factor between them means anything."""
LATE, LINES = 1e-3, 8
"""s, and coherent lines: smaller shifts, or shifts by fewer, are not named; nor any where hub forces tell better."""


def check(evidence: Evidence) -> list[Finding]:
    """Sizes are the rate by the derivative of the angle, or s by which the rate is late."""
    own = evidence.recording
    both = [(angle, rate) for angle in own.find("angle") for rate in own.find("angular rate")]
    pairs = [
        (angle, rate)
        for angle, rate in both
        if rate.component == angle.component != "yaw" and _body(evidence, rate) == _body(evidence, angle)
    ]
    if not pairs:
        return [Finding(NAME, "note", "", "Angles were not compared with rates: no body has both of one axis.")]
    return [finding for pair in pairs for finding in _pair(evidence, *pair)]


def _body(evidence: Evidence, signal: Signal) -> str:
    place = evidence.place(signal)
    return place.body if place else signal.at


def _pair(evidence: Evidence, angle: Signal, rate: Signal) -> list[Finding]:
    recording = evidence.recording
    found = spectra(recording, (angle, rate), (BAND[0], min(BAND[1], 0.4 / recording.period)))
    names = f"{rate.name} and {angle.name}"
    own = _coherent(found) if found else np.zeros(0, bool)
    if found is None or np.count_nonzero(own) < 2:
        return [Finding(NAME, "note", names, f"{names} could not be compared: too little turning above their noise.")]
    omega, cross = 2 * np.pi * found.frequencies[own], found.cross[own]
    transfer = cross[:, 1, 0] / (1j * omega * cross[:, 0, 0].real)
    weight = _weights(cross)
    ratio = float((weight @ transfer).real / weight.sum())
    late, error = _late(transfer, omega, weight * found.averages, ratio)
    wrong, text = sentence(ratio, rate, f"the derivative of {angle.name}")
    if wrong in ("sign", "unit") and _alike(transfer, weight) < ALIKE:
        text = (
            f"{rate.name} is not the derivative of {angle.name}, whatever its sign and unit: one of them belongs to "
            "another axis or body; check their names."
        )
        return [Finding(NAME, "doubt", names, text, ratio, "1", (rate.name, angle.name))]
    if wrong in ("sign", "unit"):
        return [
            Finding(
                wrong,
                "error",
                names,
                f"{text} Or {angle.name} is the one that is wrong.",
                ratio,
                "1",
                (rate.name, angle.name),
            )
        ]
    if evidence.agreement is None and np.count_nonzero(own) >= LINES and abs(late) > max(LATE, 5 * error):
        way = "late" if late > 0 else "early"
        text = (
            f"{rate.name} is {1e3 * abs(late):.2f} ms {way} (+-{2e3 * error:.2g} ms at 95 %) against the "
            f"derivative of {angle.name}: take the delay of one of them off."
        )
        return [Finding("shift", "doubt", names, text, late, "s", (rate.name, angle.name))]
    text = (
        f"{rate.name} is {ratio:.3g} times the derivative of {angle.name}, and not shifted by more than "
        f"{5e3 * error:.2g} ms."
    )
    return [Finding(NAME, "note", names, text, ratio, "1", (rate.name, angle.name))]


def _alike(transfer: np.ndarray, weight: np.ndarray) -> float:
    """Part of what a rate has at coherent lines that is in phase with the derivative of the angle, by one factor."""
    whole = float(weight.sum() * (weight @ np.abs(transfer) ** 2))
    return float((weight @ transfer).real ** 2) / whole if whole > 0 else 0.0


def _coherence(cross: np.ndarray) -> np.ndarray:
    return np.abs(cross[:, 0, 1]) ** 2 / (cross[:, 0, 0] * cross[:, 1, 1]).real


def _coherent(found: Spectra) -> np.ndarray:
    return _coherence(found.cross) > COHERENT


def _weights(cross: np.ndarray) -> np.ndarray:
    squared = _coherence(cross)
    return squared / np.maximum(1 - squared, 1e-6)


def _late(transfer: np.ndarray, omega: np.ndarray, weight: np.ndarray, ratio: float) -> tuple[float, float]:
    """Delay (s) by the slope of the phase through 0 Hz, and its standard error by the scatter of the lines."""
    phase = np.angle(transfer * np.sign(ratio))
    steep = float(weight @ omega**2)
    late = -float(weight @ (omega * phase)) / steep
    rest = phase + omega * late
    scatter = float(weight @ rest**2) / max(len(omega) - 1, 1)
    return late, float(np.sqrt(max(scatter, 1.0) / steep))
