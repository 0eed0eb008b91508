"""What a check finds in a recording: one sentence with place and size."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

Weight = Literal["error", "doubt", "note"]
"""An error stops what follows, a doubt is carried into the report, a note says what was looked at and found good."""

LISTED_FINDINGS = 3
"""Findings of one check that are told one by one where people read."""


@dataclass(frozen=True)
class Finding:
    """One finding.

    check : name of the check. place : channel, hub or file. text : a complete sentence for an engineer, with size,
    unit and remedy. size : the figure in it, in ``unit``; None where there is none. signals : names of the signals
    whose figure shows it. times : (start, end) in s, or empty.
    """

    check: str
    weight: Weight
    place: str
    text: str
    size: float | None = None
    unit: str = ""
    signals: tuple[str, ...] = ()
    times: tuple[float, ...] = ()


def findings_as_dicts(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Findings as plain dicts, for JSON."""
    return [
        {"check": f.check, "weight": f.weight, "place": f.place, "text": f.text, "size": f.size, "unit": f.unit}
        for f in findings
    ]


def finding_lines(findings: Iterable[Finding]) -> list[str]:
    """Text of findings for plans and summaries: one line per finding, or fewer for many of the same kind."""
    return [f"  {f.weight:<10} {f.text}" for f in merged_findings(findings)]


def merged_findings(findings: Iterable[Finding]) -> list[Finding]:
    """The findings. If more than LISTED_FINDINGS share check and severity, only the worst is kept, with the number of
    the others."""
    kinds: dict[tuple[str, str], list[Finding]] = {}
    for finding in findings:
        kinds.setdefault((finding.check, finding.weight), []).append(finding)
    return [
        f
        for similar_findings in kinds.values()
        for f in (
            similar_findings if len(similar_findings) <= LISTED_FINDINGS else [_largest_finding(similar_findings)]
        )
    ]


def _largest_finding(alike: list[Finding]) -> Finding:
    """The finding with the largest size, with the number of channels or places concerned."""
    worst = max(alike, key=lambda finding: abs(finding.size or 0.0))
    names = {name for finding in alike for name in finding.signals or (finding.place,)}
    noun = "channels" if worst.signals else "places"
    return replace(worst, text=f"{worst.check!r} at {len(names)} {noun}, the worst: {worst.text}")
