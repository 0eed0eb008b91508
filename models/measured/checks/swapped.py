"""Check for exchanged channels: those of hubs (left and right, front and rear, diagonally), or two single channels."""

from models.core.finding import Finding
from models.measured.checks.agreement import MeasurementFault
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.spectra import SEGMENT_LENGTH

HUB_CHECK_NAME, CHANNEL_CHECK_NAME = "swapped", "exchanged"
LARGEST_UNEXPLAINED = 0.3
"""Largest median share of the readings that may stay unexplained before vehicle and recording are said not to belong
together, for segments of SEGMENT_LENGTH (s). Shorter segments begin and end within the vehicle's vibrations, and leave
correspondingly more unexplained: typically a half of correct recordings of 1.5 s (angles and rates alone), a fifth of 6
s."""


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on exchanged hubs or channels. Sizes are the share of the inertial readings, in %, that the forces do
    not explain with the given channel map."""
    if checked_recording.agreement_and_faults is None:
        return [
            Finding(
                HUB_CHECK_NAME,
                "note",
                "",
                f"Exchanged hubs were not looked for: this needs {checked_recording.missing_data_text}.",
            )
        ]
    findings = [_hub_finding(fault) for fault in checked_recording.faults if fault.kind == "swapped"]
    findings += [_channel_pair_finding(fault) for fault in checked_recording.faults if fault.kind == "crossed"]
    return [*findings, _remaining_disagreement(checked_recording), _indistinguishable_hubs(checked_recording)]


def _hub_finding(fault: MeasurementFault) -> Finding:
    """Finding on hubs whose channels are exchanged."""
    text = (
        f"The channels of {fault.name} are exchanged: as mapped, the forces leave {100 * fault.size:.0f} % of the "
        f"measured motion unexplained, exchanged {100 * fault.error:.0f} %; exchange their names in the channel "
        "map."
    )
    return Finding(HUB_CHECK_NAME, "error", fault.name, text, 100 * fault.size, "%", fault.names)


def _channel_pair_finding(fault: MeasurementFault) -> Finding:
    """Finding on two channels that are exchanged."""
    text = (
        f"{fault.name} are exchanged: as mapped, {100 * fault.size:.0f} % of the measured motion stays unexplained, "
        f"exchanged {100 * fault.error:.0f} %; exchange their names in the channel map."
    )
    return Finding(CHANNEL_CHECK_NAME, "doubt", fault.name, text, 100 * fault.size, "%", fault.names)


def _indistinguishable_hubs(checked_recording: CheckedRecording) -> Finding:
    """Finding on pairs of hubs whose forces move the vehicle so similarly that an exchange could not be seen."""
    assert checked_recording.agreement_and_faults is not None
    pairs = [
        " with ".join(s.name for s in pair)
        for pair in checked_recording.agreement_and_faults[0].undetectable_exchanges()
    ]
    if not pairs:
        return Finding(
            CHANNEL_CHECK_NAME, "note", "", "Any two channels of hub forces that were exchanged would be seen."
        )
    text = (
        f"Two channels of hub forces that were exchanged would be seen by the motion of the vehicle, but not "
        f"{', '.join(pairs)}: check their names."
    )
    return Finding(CHANNEL_CHECK_NAME, "note", "", text, float(len(pairs)), "pairs")


def _remaining_disagreement(checked_recording: CheckedRecording) -> Finding:
    """Finding on the disagreement of forces and motion that remains after all faults are corrected."""
    assert checked_recording.agreement_and_faults is not None
    agreement = checked_recording.agreement_and_faults[0]
    share = agreement.unexplained_shares
    low, high = int(share.argmin()), int(share.argmax())
    best, worst = (f"{100 * share[i]:.2g} % ({agreement.reading_signals[i].name})" for i in (low, high))
    text = (
        f"Through the vehicle file the hub forces explain the inertial channels but for {best} to {worst} of their "
        f"size between {agreement.frequencies[0]:.3g} and {agreement.frequencies[-1]:.3g} Hz"
    )
    median_share, resolved = agreement.median_unexplained(), float(agreement.frequencies[1] - agreement.frequencies[0])
    if median_share <= LARGEST_UNEXPLAINED:
        return Finding(HUB_CHECK_NAME, "note", "", f"{text}.", 100 * median_share, "%")
    if median_share <= LARGEST_UNEXPLAINED * SEGMENT_LENGTH * resolved:
        text += f". Segments of {1 / resolved:.3g} s are too short to say whether they belong together"
        return Finding(HUB_CHECK_NAME, "note", "", f"{text}.", 100 * median_share, "%")
    text += (
        f"; typically {100 * median_share:.0f} % stay unexplained: forces, motion and vehicle do not belong together, "
        "so that delays and factors are not to be relied upon, and true ones may be hidden. Check frame, clocks, "
        "places of the sensors and the vehicle file."
    )
    return Finding(
        HUB_CHECK_NAME, "doubt", "", text, 100 * median_share, "%", tuple(s.name for s in agreement.reading_signals)
    )
