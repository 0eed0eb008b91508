"""Checks for single faults of channels (factors, time shifts, lever arms), found by comparison with the vehicle's
motion.

A factor is a sign, a unit or a calibration; a shift one in time; a lever moments about another point than the hub:
about the contact patch, or a plane of the transducer.
"""

from models.core.finding import Finding, FindingWeight
from models.measured.checks.agreement import MeasurementFault
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.spikes import spike_positions
from models.measured.ratios import cause_and_sentence

STATED_FACTOR_ERRORS = 0.02, 0.1
"""Relative errors of a factor for which it is stated in how many channels they would be seen."""
UNCHECKED_TIME_SHIFT = 3e-3
"""Time shift (s) below which a shift need not be visible; a channel in which only larger ones would be seen is named as
not checked."""
WHEEL_RADIUS_RANGE = 0.2, 0.6
"""Range (m) of wheel radii; a lever of this size is explained by the wheel's radius."""


def factor_findings(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on wrong factors. Sizes are shares in %, or the ratio of recorded to true value where sign or unit is
    wrong. A finding is only a doubt where a spike may be the cause."""
    if checked_recording.missing_data_text:
        what = "Signs, units and factors were not checked by the motion of the vehicle"
        return [Finding("factor", "note", "", f"{what}: this needs {checked_recording.missing_data_text}.")]
    findings = [
        _factor_finding(checked_recording, fault) for fault in checked_recording.faults if fault.kind == "factor"
    ]
    least = [wrong for _, wrong in checked_recording.detectable_sizes.values()]
    parts = " and ".join(
        f"by {100 * size:.0f} % in {sum(wrong < size for wrong in least)}" for size in STATED_FACTOR_ERRORS
    )
    text = f"A factor that is wrong {parts} of {len(least)} channels would be seen by the motion."
    return [*findings, Finding("gain", "note", "", text)]


def _factor_finding(checked_recording: CheckedRecording, fault: MeasurementFault) -> Finding:
    """Finding on a wrong factor, sign or unit of one or several channels."""
    kind, text = cause_and_sentence(
        fault.size, fault.signals[0], "what the motion of the vehicle and all other channels tell"
    )
    if len(fault.signals) > 1:
        text = f"{fault.name[0].upper()}{fault.name[1:]} are wrong alike: {text}"
    if kind in ("gain", "size"):
        text += f" The factor is {fault.size:.4g} +- {2 * fault.error:.2g} (95 %), if the vehicle file is right."
        return Finding("gain", "doubt", fault.name, text, 100 * (fault.size - 1), "%", fault.names)
    spiky = any(len(spike_positions(checked_recording.recording.samples(s))[0]) for s in fault.signals)
    weight: FindingWeight = "doubt" if spiky else "error"
    return Finding(kind, weight, fault.name, text, fault.size, "1", fault.names)


def shift_findings(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on time shifts, from the motion that the hub forces predict. Sizes are in s, positive where a channel is
    late."""
    if checked_recording.agreement is None:
        what = "Shifts in time were not checked by the motion of the vehicle"
        return [Finding("shift", "note", "", f"{what}: this needs {checked_recording.missing_data_text}.")]
    findings = [_shift_finding(fault) for fault in checked_recording.faults if fault.kind == "late"]
    blind = [name for name, (late, _) in checked_recording.detectable_sizes.items() if not late < UNCHECKED_TIME_SHIFT]
    seen = f"{len(checked_recording.detectable_sizes) - len(blind)} of {len(checked_recording.detectable_sizes)}"
    text = f"A shift of {1e3 * UNCHECKED_TIME_SHIFT:g} ms would be seen in {seen} channels by the motion of the vehicle"
    text += f"; too little of it comes from {', '.join(blind)}." if blind else "."
    return [*findings, Finding("shift", "note", "", text)]


def _shift_finding(fault: MeasurementFault) -> Finding:
    """Finding on a time shift of one or several channels."""
    late, single = "late" if fault.size > 0 else "early", len(fault.signals) == 1
    subject = f"{fault.name} is" if single else f"{fault.name[0].upper()}{fault.name[1:]} are"
    text = (
        f"{subject} {1e3 * abs(fault.size):.2f} ms {late} (+-{2e3 * fault.error:.2g} ms at 95 %) against the other "
        "channels, if the vehicle file is right: take out the delay of filter or telemetry, or give the file "
        f"offset = {-fault.size:.4f} if all of it is shifted."
    )
    return Finding("shift", "doubt", fault.name, text, fault.size, "s", fault.names)


def lever_findings(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on hub moments that refer to another point than the hub, from the motion that the hub forces predict.
    Sizes are the point's height above the hub, m."""
    return [_lever_finding(fault) for fault in checked_recording.faults if fault.kind == "lever"]


def _lever_finding(fault: MeasurementFault) -> Finding:
    """Finding on hub moments that refer to a point above or below the hub."""
    hubs = tuple(dict.fromkeys(signal.at for signal in fault.signals))
    length, side, wheel = abs(fault.size), "above" if fault.size > 0 else "below", ""
    if WHEEL_RADIUS_RANGE[0] < length < WHEEL_RADIUS_RANGE[1]:
        wheel = (
            ", a wheel's radius: they are about the contact patch"
            if fault.size < 0
            else ", a wheel's radius: they were referred from the contact patch to the hub twice, or with a wrong sign"
        )
    remedy = ", ".join(f"{hub} = {fault.size:.3g}" for hub in hubs)
    text = (
        f"{', '.join(fault.names)} are about a point {length:.3g} m {side} the hub (+-{2 * fault.error:.2g} m at 95 %)"
        f"{wheel}, if the vehicle file is right. Moments are needed about the hub: give levers = {{ {remedy} }} in the "
        f"scene, which takes {fault.size:.3g} m Fy off Mx and adds {fault.size:.3g} m Fx to My."
    )
    return Finding("lever", "doubt", " and ".join(hubs), text, fault.size, "m", fault.names)
