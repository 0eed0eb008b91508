"""Check of accelerometers against gravity, +9.81 m/s^2 upwards at rest: whether it is included, sign, unit and axes."""

from models.core.finding import Finding
from models.measured.checks.evidence import CheckedRecording
from models.measured.ratios import cause_and_sentence
from models.measured.signal import MeasuredSignal
from models.vehicles.cut_vehicle import GRAVITY

CHECK_NAME = "gravity"
VERTICAL_MEAN_LIMIT = 0.5
"""Deviation (m/s^2) of a vertical mean from gravity above which it is named: a car on a grade of 20 % loses 0.2."""
HORIZONTAL_MEAN_LIMIT = 3.0
"""Largest mean (m/s^2) of a horizontal accelerometer: a grade of 30 %."""


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on gravity in accelerometers. Sizes are in m/s^2, or the ratio of recorded to true value where sign or
    unit is wrong."""
    signals = [s for s in checked_recording.recording.find_signals("acceleration") if s.component in ("x", "y", "z")]
    if not signals:
        return [Finding(CHECK_NAME, "note", "", "Not looked at: no accelerometer.")]
    findings = [finding for s in signals if (finding := _signal_finding(s, checked_recording.mean_of_signal(s)))]
    quiet = "Every vertical accelerometer feels gravity as its channel map says, and no other does."
    return findings or [Finding(CHECK_NAME, "note", "", quiet)]


def _signal_finding(signal: MeasuredSignal, mean_acceleration: float) -> Finding | None:
    """Finding on the mean (m/s^2) of one accelerometer; None if it is right."""
    if signal.component == "z":
        return _vertical_finding(signal, mean_acceleration)
    if not abs(mean_acceleration) > HORIZONTAL_MEAN_LIMIT:
        return None
    text = (
        f"{signal.name} reads {mean_acceleration:.3g} m/s^2 on average, but lies along {signal.component}: it feels "
        "gravity, "
        "so that axes are exchanged or the mount is tilted; correct component and sign in the map."
    )
    return Finding(CHECK_NAME, "error", signal.name, text, mean_acceleration, "m/s^2", (signal.name,))


def _vertical_finding(signal: MeasuredSignal, mean_acceleration: float) -> Finding | None:
    """Finding on the mean (m/s^2) of one vertical accelerometer; None if it is right."""
    if not signal.gravity:
        if abs(mean_acceleration) < VERTICAL_MEAN_LIMIT:
            return None
        text = (
            f"{signal.name} reads {mean_acceleration:.4g} m/s^2 on average, although the channel map says that "
            "gravity is not "
            "included: drop gravity = false, or take off its zero."
        )
        return Finding(CHECK_NAME, "error", signal.name, text, mean_acceleration, "m/s^2", (signal.name,))
    missing = GRAVITY - mean_acceleration
    if abs(missing) < VERTICAL_MEAN_LIMIT:
        return None
    if abs(mean_acceleration) < VERTICAL_MEAN_LIMIT:
        text = (
            f"{signal.name} reads {mean_acceleration:.3g} m/s^2 on average: {missing:.4g} m/s^2 of gravity are not "
            "included; "
            "give gravity = false in the channel map."
        )
        return Finding(CHECK_NAME, "error", signal.name, text, missing, "m/s^2", (signal.name,))
    kind, text = cause_and_sentence(mean_acceleration / GRAVITY, signal, "gravity, which it feels on average")
    if kind in ("sign", "unit"):
        return Finding(kind, "error", signal.name, text, mean_acceleration / GRAVITY, "1", (signal.name,))
    text = (
        f"{signal.name} reads {mean_acceleration:.4g} m/s^2 on average, {-missing:+.3g} m/s^2 off gravity: check "
        "its zero, its "
        "factor and how it is mounted."
    )
    return Finding(CHECK_NAME, "doubt", signal.name, text, -missing, "m/s^2", (signal.name,))
