"""Check whether the accelerometers on a body move as on a rigid body."""

from collections.abc import Sequence

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.spectra import white_noise
from models.measured.signal import MeasuredSignal, TransducerPlace

CHECK_NAME = "rigid"
EVALUATED_SAMPLE_LIMIT = 6000
"""Most samples that are evaluated, spread evenly."""
AxisSignals = Sequence[MeasuredSignal]


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on bodies with three or more tri-axial accelerometers, one per body; the size is the share of the
    readings, in %, that no rigid motion explains."""
    findings = [
        _body_finding(checked_recording, body, sensors)
        for body, sensors in _accelerometers_by_body(checked_recording).items()
        if len(sensors) > 2
    ]
    lacks = "Not looked at whether the body is rigid: this needs four tri-axial accelerometers on it, of known places."
    return findings or [Finding(CHECK_NAME, "note", "", lacks)]


def _accelerometers_by_body(
    checked_recording: CheckedRecording,
) -> dict[str, dict[str, tuple[TransducerPlace, AxisSignals]]]:
    """Tri-axial accelerometers with all three channels, by body and by sensor name."""
    bodies: dict[str, dict[str, tuple[TransducerPlace, AxisSignals]]] = {}
    for name in dict.fromkeys(s.at for s in checked_recording.recording.find_signals("acceleration")):
        axes = [checked_recording.recording.find_signals("acceleration", name, axis) for axis in "xyz"]
        place = checked_recording.transducer_place(axes[0][0]) if all(axes) else None
        if place is not None:
            bodies.setdefault(place.body, {})[name] = place, [signals[0] for signals in axes]
    return bodies


def _body_finding(
    checked_recording: CheckedRecording, body_name: str, accelerometers: dict[str, tuple[TransducerPlace, AxisSignals]]
) -> Finding:
    """Finding on whether one body with these accelerometers is rigid."""
    from models.sensors.rigid_body_motion import fit_quality
    from models.sensors.sensor_array import sensor_array

    try:
        array = sensor_array({name: place.position for name, (place, _) in accelerometers.items()})
    except InputError as error:
        return Finding(CHECK_NAME, "note", body_name, f"Not looked at whether {body_name} is rigid: {error}.")
    recording, axes = checked_recording.recording, [axes for _, axes in accelerometers.values()]
    signals, stride = [s for triple in axes for s in triple], -(-recording.count // EVALUATED_SAMPLE_LIMIT)
    columns = [[recording.samples(s)[::stride] for s in triple] for triple in axes]
    readings = np.moveaxis(np.array(columns), 2, 0)
    sizes = [white_noise(recording, s) for s in signals]
    deviation = float(np.sqrt(np.nanmean(np.square(sizes)))) if np.isfinite(sizes).any() else 0.0
    rigidity = fit_quality(array, readings[np.isfinite(readings).all(axis=(1, 2))], deviation)
    if rigidity.rigid is None:
        return Finding(
            CHECK_NAME,
            "note",
            body_name,
            f"{body_name}: {array.description_sentences()[-1]}; a fourth sensor would tell.",
        )
    share_text = (
        f"{100 * rigidity.unexplained_share:.2g} % of what its {len(axes)} accelerometers read against each other"
    )
    size, names = 100 * rigidity.unexplained_share, tuple(s.name for s in signals)
    if rigidity.rigid:
        text = f"A rigid body explains {body_name} but for {share_text}."
        return Finding(CHECK_NAME, "note", body_name, text, size, "%", names)
    cause = (
        f"without {rigidity.suspect_sensor} it is rigid: check its mount, place, axes and factor"
        if rigidity.suspect_sensor
        else "no single sensor explains it: check places and axes of all"
    )
    text = f"No rigid body explains {share_text} on {body_name}; {cause}."
    return Finding(CHECK_NAME, "doubt", rigidity.suspect_sensor or body_name, text, size, "%", names)
