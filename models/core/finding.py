"""Findings of the checks of a recording: sentences with place and size."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

FindingWeight = Literal["error", "doubt", "note"]
"""Severity of a finding: an error stops the processing, a doubt is repeated in the report, and a note states what was
checked and is in order."""

LISTED_FINDINGS = 3
"""Most findings of one check and severity that are listed one by one; of more, only the largest is listed."""


@dataclass(frozen=True)
class Finding:
    """One finding of a check of a recording.

    check : name of the check. place : channel, hub or file. text : a complete sentence for an engineer, with size,
    unit and remedy. size : the figure in it, in ``unit``; None where there is none. signals : names of the signals
    whose figure shows it. times : (start, end) in s, or empty.
    """

    check: str
    weight: FindingWeight
    place: str
    text: str
    size: float | None = None
    unit: str = ""
    signals: tuple[str, ...] = ()
    times: tuple[float, ...] = ()


def findings_as_dicts(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Findings of checks as plain dicts, for JSON."""
    return [
        {"check": f.check, "weight": f.weight, "place": f.place, "text": f.text, "size": f.size, "unit": f.unit}
        for f in findings
    ]


def finding_lines(findings: Iterable[Finding]) -> list[str]:
    """Text lines on the findings for plans and summaries: one per finding, or one for many findings of the same check
    and severity."""
    return [f"  {f.weight:<10} {f.text}" for f in merged_findings(findings)]


def merged_findings(findings: Iterable[Finding]) -> list[Finding]:
    """The findings, but where more than LISTED_FINDINGS share check and severity, only the one of largest size, with
    the number of channels or places concerned."""
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


def _largest_finding(similar_findings: list[Finding]) -> Finding:
    """The finding of largest size among similar ones; its text states the number of channels or places concerned."""
    worst = max(similar_findings, key=lambda finding: abs(finding.size or 0.0))
    names = {name for finding in similar_findings for name in finding.signals or (finding.place,)}
    noun = "channels" if worst.signals else "places"
    return replace(worst, text=f"{worst.check!r} at {len(names)} {noun}, the worst: {worst.text}")
