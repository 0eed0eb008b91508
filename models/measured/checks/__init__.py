"""Checks of a recording before a run: one file per check, with findings that state place and size.

Errors stop what follows, doubts are carried into the report, notes say what was looked at and found good, or what
would be needed to look at it.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping

from models.core.finding import Finding, FindingWeight
from models.measured.checks import clipped, drift, faults, gaps, gravity, noise, rigid, spikes, swapped, turning, weight
from models.measured.checks.evidence import CheckedRecording
from models.measured.recording import Recording
from models.measured.signal import TransducerPlace
from models.vehicles.cut_vehicle import CutVehicle

CHECKS: tuple[Callable[[CheckedRecording], list[Finding]], ...] = (
    gaps.check,
    clipped.check,
    spikes.check,
    gravity.check,
    swapped.check,
    weight.check,
    faults.lever_findings,
    faults.factor_findings,
    drift.check,
    faults.shift_findings,
    turning.check,
    rigid.check,
    noise.check,
)
"""All checks in their order: a fault that an earlier check has named is not named again by a later one."""
SUBJECTS_OF_CHECK = defaultdict(
    frozenset[str],
    {
        **dict.fromkeys(("sign", "unit", "gain", "offset", "weight", "gravity", "lever"), frozenset({"size"})),
        **dict.fromkeys(("drift", "shift"), frozenset({"time"})),
        **dict.fromkeys(("exchanged", "turning"), frozenset({"axis"})),
        "clipped": frozenset({"value"}),
        "spikes": frozenset({"size", "value"}),
        "noise": frozenset({"size", "value"}),
        "rigid": frozenset({"size", "time", "value"}),
    },
)
"""Subjects of a check's findings; two findings on the same subject of the same channel state the same fault."""
WEIGHT_ORDER: tuple[FindingWeight, ...] = ("error", "doubt", "note")
"""Severities of findings, the worst first."""


def check(
    recording: Recording,
    vehicle: CutVehicle | None,
    places: Mapping[str, TransducerPlace] | None = None,
    claimed: Mapping[str, float] | None = None,
) -> tuple[Finding, ...]:
    """All findings on a recording, errors first, including those from reading the file.

    vehicle : None for one that is not in space; places : of accelerometers and gyros by name; claimed : white noise
    (SI) on every sample that is stated, by name of signal.
    """
    return findings_of_all_checks(CheckedRecording(recording, vehicle, places or {}, claimed or {}))


def findings_of_all_checks(checked_recording: CheckedRecording) -> tuple[Finding, ...]:
    """Findings of all checks on a recording, errors first; the caller can use the same evidence for figures."""
    said = list(checked_recording.recording.findings)
    for look in CHECKS:
        said += [finding for finding in look(checked_recording) if not _already_named(finding, said)]
    return tuple(sorted(said, key=lambda finding: WEIGHT_ORDER.index(finding.weight)))


def _already_named(finding: Finding, earlier_findings: list[Finding]) -> bool:
    """Whether an earlier finding, at least as severe, already explains the fault of one of this finding's channels."""
    return finding.weight != "note" and any(
        WEIGHT_ORDER.index(other.weight) <= WEIGHT_ORDER.index(finding.weight)
        and SUBJECTS_OF_CHECK[other.check] & SUBJECTS_OF_CHECK[finding.check]
        and set(other.signals) & set(finding.signals)
        for other in earlier_findings
    )
