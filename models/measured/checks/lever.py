"""Moments about another point than the hub: about the contact patch, or a plane of the transducer."""

from models.core.finding import Finding
from models.measured.checks.agreement import Fault
from models.measured.checks.evidence import Evidence

NAME = "lever"
PATCH = 0.2, 0.6
"""m: radii of wheels; a lever of this size is one of them."""


def check(evidence: Evidence) -> list[Finding]:
    """Sizes are in m, the height of the point above the hub; by the motion that the hub forces should cause."""
    return [_finding(fault) for fault in evidence.faults if fault.kind == "lever"]


def _finding(fault: Fault) -> Finding:
    hubs = tuple(dict.fromkeys(signal.at for signal in fault.signals))
    names, side = ", ".join(signal.name for signal in fault.signals), "above" if fault.size > 0 else "below"
    length, wheel = abs(fault.size), ""
    if PATCH[0] < length < PATCH[1]:
        wheel = (
            ", a wheel's radius: they are about the contact patch"
            if fault.size < 0
            else ", a wheel's radius: they were referred from the contact patch to the hub twice, or with a wrong sign"
        )
    remedy = ", ".join(f"{hub} = {fault.size:.3g}" for hub in hubs)
    text = (
        f"{names} are about a point {length:.3g} m {side} the hub (+-{2 * fault.error:.2g} m at 95 %){wheel}, if "
        f"the vehicle file is right. Moments are needed about the hub: give levers = {{ {remedy} }} in the scene, "
        f"which takes {fault.size:.3g} m Fy off Mx and adds {fault.size:.3g} m Fx to My."
    )
    return Finding(NAME, "doubt", " and ".join(hubs), text, fault.size, "m", tuple(s.name for s in fault.signals))
