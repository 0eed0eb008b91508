"""Check for file clocks that run at different speeds: inertial signals that come later and later than the hub forces
predict."""

from dataclasses import replace

import numpy as np

from models.core.finding import Finding
from models.measured.checks.agreement import MotionAgreement, SignalGroup
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.spectra import SEGMENT_LENGTH, cross_spectra

CHECK_NAME = "drift"
WINDOW_LENGTH, MOST_WINDOWS = SEGMENT_LENGTH, 30
"""Length (s) of a window in which a delay is determined, and most windows, spread evenly."""
FEWEST_WINDOWS = 3
"""Least number of windows for a slope."""
SLOPE_STANDARD_ERRORS = 5.0
"""Number of standard errors that the slope of a delay must exceed."""
LEAST_CLOCK_DRIFT = 1e-3
"""Least difference (s) that two clocks must gain over the recording."""


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on clocks that drift. Sizes are the relative rate by which a file's clock runs faster than that of the
    hub forces."""
    clocks = {s.file for s in checked_recording.forces}
    others = dict.fromkeys(s.file for s in checked_recording.inertial_signals if s.file not in clocks)
    if not others:
        return []
    windows = (
        _agreement_by_window(checked_recording) if checked_recording.agreement_and_faults and len(clocks) == 1 else []
    )
    needed = (
        "was not looked at: this needs their motion by the vehicle file, hub forces in one file, and "
        f"{FEWEST_WINDOWS} stretches of {WINDOW_LENGTH:g} s without a gap."
    )
    if len(windows) < FEWEST_WINDOWS:
        what = "runs as fast as that of the hub forces"
        return [Finding(CHECK_NAME, "note", name, f"Whether the clock of {name} {what} {needed}") for name in others]
    return [_drift_finding(checked_recording, windows, name, min(clocks)) for name in others]


def _agreement_by_window(checked_recording: CheckedRecording) -> list[tuple[float, MotionAgreement]]:
    """Middle (s) and ``MotionAgreement`` of parts of the recording, each with the corrections found from the whole
    recording."""
    assert checked_recording.agreement_and_faults is not None
    now, recording = checked_recording.agreement_and_faults[0], checked_recording.recording
    length = round(WINDOW_LENGTH / recording.period)
    firsts = np.linspace(0, recording.count - length, max(min(recording.count // length, MOST_WINDOWS), 1)).astype(int)
    windows, c = [], len(now.force_signals)
    for first in firsts if recording.count >= length else ():
        part = cross_spectra(
            recording, (*now.force_signals, *now.reading_signals), tuple(now.frequencies[[0, -1]]), (int(first), length)
        )
        if part is not None:
            lines = np.abs(now.frequencies[:, None] - part.frequencies).argmin(axis=0)
            local = replace(
                now,
                frequencies=part.frequencies,
                forces=part.cross_spectra[:, :c, :c],
                cross_spectra=part.cross_spectra[:, c:, :c],
                reading_powers=np.einsum("fkk->fk", part.cross_spectra[:, c:, c:]).real,
                response=now.response[lines],
                independent_averages=part.independent_averages,
            )
            windows.append(((first + length / 2) * recording.period, local))
    return windows


def _drift_finding(
    checked_recording: CheckedRecording,
    agreement_by_window: list[tuple[float, MotionAgreement]],
    file_name: str,
    clock_name: str,
) -> Finding:
    """Finding on the clock of the file ``file_name`` compared with the clock of the hub forces."""
    of_file = tuple(i for i, s in enumerate(agreement_by_window[0][1].reading_signals) if s.file == file_name)
    signals = tuple(s.name for s in checked_recording.inertial_signals if s.file == file_name)
    late = np.array(
        [
            part.delay_of_group(SignalGroup(file_name, False, of_file), part.weights)[:2]
            for _, part in agreement_by_window
        ]
    )
    slope, error = _slope_of_delays(np.array([at for at, _ in agreement_by_window]), *late.T)
    apart = slope * checked_recording.recording.duration
    if abs(slope) > SLOPE_STANDARD_ERRORS * error and abs(apart) > LEAST_CLOCK_DRIFT:
        word = "fast" if slope > 0 else "slow"
        text = (
            f"The clock of {file_name} is {1e6 * abs(slope):.3g} ppm {word} (+-{2e6 * error:.2g} ppm at 95 %) against "
            f"that of {clock_name}: {1e3 * abs(apart):.2g} ms over the recording, if the vehicle file is right; add "
            f"{slope:.3g} to the file's drift under [[files]]."
        )
        return Finding(
            CHECK_NAME, "doubt", file_name, text, slope, "1", signals, (0.0, checked_recording.recording.duration)
        )
    text = (
        f"The clock of {file_name} runs as fast as that of {clock_name}: {1e6 * slope:+.2g} ppm "
        f"(+-{2e6 * error:.2g} ppm at "
        "95 %) by the motion of the vehicle."
    )
    return Finding(CHECK_NAME, "note", file_name, text, slope, "1", signals)


def _slope_of_delays(times: np.ndarray, delays: np.ndarray, standard_errors: np.ndarray) -> tuple[float, float]:
    """Slope of delays (n,) over time and its standard error, from the delays' own errors or from their scatter,
    whichever is larger."""
    weights = 1 / standard_errors**2
    middle = times - weights @ times / weights.sum()
    steep = float(weights @ middle**2)
    slope = float(weights @ (middle * delays)) / steep
    rest = delays - slope * middle
    rest -= weights @ rest / weights.sum()
    scatter = float(weights @ rest**2) / (len(times) - 2)
    return slope, float(np.sqrt(max(scatter, 1.0) / steep))
