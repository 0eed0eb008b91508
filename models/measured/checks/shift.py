"""Channels that are shifted in time against the others."""

from models.measured.checks.agreement import SMALL_DELAY, Fault
from models.measured.checks.evidence import Evidence
from models.measured.finding import Finding

NAME = "shift"
TOLD = 1e-3
"""s: a channel whose delay is known to worse than this is named as not checked."""


def check(evidence: Evidence) -> list[Finding]:
    """Sizes are in s, positive where a channel is late; by the motion that the hub forces should cause."""
    if evidence.agreement is None:
        return [Finding(NAME, "note", "", "Shifts in time were not checked by the motion of the vehicle: this needs "
                        f"{evidence.lacking}.")]  # fmt: skip
    return [_finding(fault) for fault in evidence.faults if fault.kind == "late"] + [_told(evidence)]


def _finding(fault: Fault) -> Finding:
    one, late = len(fault.signals) == 1, "late" if fault.size > 0 else "early"
    subject = f"{fault.name} is" if one else f"{fault.name[0].upper()}{fault.name[1:]} are"
    text = (f"{subject} {1e3 * abs(fault.size):.2f} ms {late} (+-{2e3 * fault.error:.2g} ms at 95 %) against the other "
            "channels: take out the delay of filter or telemetry, or give the file that "
            f"offset = {-fault.size:.4f} if all of it is shifted.")  # fmt: skip
    return Finding(NAME, "doubt", fault.name, text, fault.size, "s", tuple(s.name for s in fault.signals))


def _told(evidence: Evidence) -> Finding:
    """Which channels move the vehicle enough to tell."""
    assert evidence.searched is not None
    errors = {name: late for name, (late, _) in evidence.searched[0].errors().items()}
    seen = [error for error in errors.values() if 2 * error < TOLD]
    blind = ", ".join(name for name, error in errors.items() if not 2 * error < TOLD)
    text = (f"A shift of {1e3 * max(SMALL_DELAY, 4 * max(seen, default=0.0)):.2g} ms would be seen in {len(seen)} of "
            f"{len(errors)} channels by the motion of the vehicle")  # fmt: skip
    return Finding(NAME, "note", "", f"{text}; too little of it comes from {blind}." if blind else f"{text}.")
