"""Channels that are shifted in time against the others."""

from models.core.finding import Finding
from models.measured.checks.agreement import Fault
from models.measured.checks.evidence import Evidence

NAME = "shift"
TOLD = 3e-3
"""s: a channel in which less would not be seen is named as not checked."""


def check(evidence: Evidence) -> list[Finding]:
    """Sizes are in s, positive where a channel is late; by the motion that the hub forces should cause."""
    if evidence.agreement is None:
        return [
            Finding(
                NAME,
                "note",
                "",
                f"Shifts in time were not checked by the motion of the vehicle: this needs {evidence.lacking}.",
            )
        ]
    return [_finding(fault) for fault in evidence.faults if fault.kind == "late"] + [_told(evidence)]


def _finding(fault: Fault) -> Finding:
    one, late = len(fault.signals) == 1, "late" if fault.size > 0 else "early"
    subject = f"{fault.name} is" if one else f"{fault.name[0].upper()}{fault.name[1:]} are"
    text = (
        f"{subject} {1e3 * abs(fault.size):.2f} ms {late} (+-{2e3 * fault.error:.2g} ms at 95 %) against the other "
        "channels, if the vehicle file is right: take out the delay of filter or telemetry, or give the file "
        f"offset = {-fault.size:.4f} if all of it is shifted."
    )
    return Finding(NAME, "doubt", fault.name, text, fault.size, "s", tuple(s.name for s in fault.signals))


def _told(evidence: Evidence) -> Finding:
    """Which channels move the vehicle enough to tell."""
    assert evidence.searched is not None
    least = {name: late for name, (late, _) in evidence.searched[0].seen().items()}
    blind = ", ".join(name for name, late in least.items() if not late < TOLD)
    seen = sum(late < TOLD for late in least.values())
    text = f"A shift of {1e3 * TOLD:g} ms would be seen in {seen} of {len(least)} channels by the motion of the vehicle"
    return Finding(NAME, "note", "", f"{text}; too little of it comes from {blind}." if blind else f"{text}.")
