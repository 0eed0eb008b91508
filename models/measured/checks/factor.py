"""Sign, unit and calibration of every channel, by what it accounts for in the motion of the vehicle."""

from models.core.finding import Finding, Weight
from models.measured.checks.agreement import Fault
from models.measured.checks.evidence import Evidence
from models.measured.checks.spikes import spikes
from models.measured.ratios import sentence

TOLD = 0.02, 0.1
"""Errors of a factor of which it is said in how many channels they would be seen."""


def check(evidence: Evidence) -> list[Finding]:
    """Sizes are shares in %, or recorded by true value where sign or unit is wrong: a doubt if a spike may say so."""
    if evidence.lacking:
        return [
            Finding(
                "factor",
                "note",
                "",
                "Signs, units and factors were not checked by the motion of the vehicle: "
                f"this needs {evidence.lacking}.",
            )
        ]
    return [_finding(evidence, fault) for fault in evidence.faults if fault.kind == "factor"] + [_told(evidence)]


def _told(evidence: Evidence) -> Finding:
    """Which channels move the vehicle enough to tell."""
    assert evidence.searched is not None
    least = [wrong for _, wrong in evidence.searched[0].seen().values()]
    parts = [f"by {100 * size:.0f} % in {sum(wrong < size for wrong in least)}" for size in TOLD]
    text = f"A factor that is wrong {' and '.join(parts)} of {len(least)} channels would be seen by the motion."
    return Finding("gain", "note", "", text)


def _finding(evidence: Evidence, fault: Fault) -> Finding:
    signal, names = fault.signals[0], tuple(s.name for s in fault.signals)
    against = "what the motion of the vehicle and all other channels tell"
    kind, text = sentence(fault.size, signal, against)
    if len(fault.signals) > 1:
        text = f"{fault.name[0].upper()}{fault.name[1:]} are wrong alike: {text}"
    if kind in ("gain", "size"):
        size, unit = 100 * (fault.size - 1), "%"
        text += f" The factor is {fault.size:.4g} +- {2 * fault.error:.2g} (95 %), if the vehicle file is right."
        return Finding("gain", "doubt", fault.name, text, size, unit, names)
    spiky = any(len(spikes(evidence.recording.samples(s))[0]) for s in fault.signals)
    weight: Weight = "doubt" if spiky else "error"
    return Finding(kind, weight, fault.name, text, fault.size, "1", names)
