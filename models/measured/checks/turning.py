"""Check of angles against angular rates of the same body: whether the rate is the angle's derivative in sign, unit and
time."""

import numpy as np

from models.core.finding import Finding
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.spectra import cross_spectra
from models.measured.ratios import cause_and_sentence
from models.measured.signal import MeasuredSignal

CHECK_NAME = "turning"
COMPARED_FREQUENCY_BAND = 0.5, 12.0
"""Frequency band (Hz) in which angles and rates are compared."""
LEAST_COHERENCE = 0.8
"""Least squared coherence of spectral lines that are used; below it, noise dominates."""
IN_PHASE_SHARE = 0.25
"""Least share of a rate in phase with the angle's derivative for which a factor between them has a meaning."""
LEAST_SHIFT, FEWEST_LINES = 1e-3, 8
"""Least time shift (s), and least number of coherent lines, for a finding; shifts are named only where hub forces
cannot tell them better."""


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on angles compared with their angular rates. Sizes are the ratio of the rate to the angle's derivative,
    or the delay of the rate in s."""
    recording = checked_recording.recording
    pairs = [
        (angle, rate)
        for angle in recording.find_signals("angle")
        for rate in recording.find_signals("angular rate")
        if rate.component == angle.component != "yaw"
        and _body_of_signal(checked_recording, rate) == _body_of_signal(checked_recording, angle)
    ]
    if not pairs:
        return [Finding(CHECK_NAME, "note", "", "Angles were not compared with rates: no body has both of one axis.")]
    return [_pair_finding(checked_recording, *pair) for pair in pairs]


def _body_of_signal(checked_recording: CheckedRecording, signal: MeasuredSignal) -> str:
    """Body that carries a signal's sensor, or the signal's location where the body is not known."""
    place = checked_recording.transducer_place(signal)
    return place.body if place else signal.at


def _pair_finding(
    checked_recording: CheckedRecording, angle_signal: MeasuredSignal, rate_signal: MeasuredSignal
) -> Finding:
    """Finding on one angle compared with one angular rate."""
    recording, names, both = (
        checked_recording.recording,
        f"{rate_signal.name} and {angle_signal.name}",
        (rate_signal.name, angle_signal.name),
    )
    pair_spectra = cross_spectra(
        recording,
        (angle_signal, rate_signal),
        (COMPARED_FREQUENCY_BAND[0], min(COMPARED_FREQUENCY_BAND[1], 0.4 / recording.period)),
    )
    squared = np.zeros(0)
    if pair_spectra is not None:
        squared = (
            np.abs(pair_spectra.cross_spectra[:, 0, 1]) ** 2
            / (pair_spectra.cross_spectra[:, 0, 0] * pair_spectra.cross_spectra[:, 1, 1]).real
        )
    used = squared > LEAST_COHERENCE
    if pair_spectra is None or np.count_nonzero(used) < 2:
        return Finding(
            CHECK_NAME, "note", names, f"{names} could not be compared: too little turning above their noise."
        )
    omega, cross, squared = 2 * np.pi * pair_spectra.frequencies[used], pair_spectra.cross_spectra[used], squared[used]
    transfer = cross[:, 1, 0] / (1j * omega * cross[:, 0, 0].real)
    weight = squared / np.maximum(1 - squared, 1e-6)
    ratio = float((weight @ transfer).real / weight.sum())
    late, error = _delay_by_phase(transfer, omega, weight * pair_spectra.independent_averages, ratio)
    wrong, text = cause_and_sentence(ratio, rate_signal, f"the derivative of {angle_signal.name}")
    if wrong in ("sign", "unit") and _explained_rate_share(transfer, weight) < IN_PHASE_SHARE:
        text = (
            f"{rate_signal.name} is not the derivative of {angle_signal.name}, whatever its sign and unit: one of "
            "them belongs to "
            "another axis or body; check their names."
        )
        return Finding(CHECK_NAME, "doubt", names, text, ratio, "1", both)
    if wrong in ("sign", "unit"):
        return Finding(
            wrong, "error", names, f"{text} Or {angle_signal.name} is the one that is wrong.", ratio, "1", both
        )
    if (
        checked_recording.agreement is None
        and np.count_nonzero(used) >= FEWEST_LINES
        and abs(late) > max(LEAST_SHIFT, 5 * error)
    ):
        way = "late" if late > 0 else "early"
        text = (
            f"{rate_signal.name} is {1e3 * abs(late):.2f} ms {way} (+-{2e3 * error:.2g} ms at 95 %) against the "
            f"derivative of {angle_signal.name}: take the delay of one of them off."
        )
        return Finding("shift", "doubt", names, text, late, "s", both)
    text = (
        f"{rate_signal.name} is {ratio:.3g} times the derivative of {angle_signal.name}, and not shifted by more than "
        f"{5e3 * error:.2g} ms."
    )
    return Finding(CHECK_NAME, "note", names, text, ratio, "1", both)


def _explained_rate_share(transfer_function: np.ndarray, line_weights: np.ndarray) -> float:
    """Share of the rate's power at coherent lines that the derivative of the angle explains, scaled by one real
    factor."""
    whole = float(line_weights.sum() * (line_weights @ np.abs(transfer_function) ** 2))
    return float((line_weights @ transfer_function).real ** 2) / whole if whole > 0 else 0.0


def _delay_by_phase(
    transfer_function: np.ndarray, omega: np.ndarray, line_weights: np.ndarray, rate_ratio: float
) -> tuple[float, float]:
    """Delay (s) from the slope of a phase line through 0 Hz, and its standard error from the scatter of the frequency
    lines."""
    phase = np.angle(transfer_function * np.sign(rate_ratio))
    steep = float(line_weights @ omega**2)
    late = -float(line_weights @ (omega * phase)) / steep
    rest = phase + omega * late
    scatter = float(line_weights @ rest**2) / max(len(omega) - 1, 1)
    return late, float(np.sqrt(max(scatter, 1.0) / steep))
