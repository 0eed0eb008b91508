"""What a check finds in a recording: one sentence with place and size."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

Weight = Literal["error", "doubt", "note"]
"""An error stops what follows, a doubt is carried into the report, a note says what was looked at and found good."""


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


def queries(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """As plain values, for JSON."""
    return [
        {"check": f.check, "weight": f.weight, "place": f.place, "text": f.text, "size": f.size, "unit": f.unit}
        for f in findings
    ]


def lines(findings: Iterable[Finding]) -> list[str]:
    """A line each, as plans and summaries print them."""
    return [f"  {f.weight:<10} {f.text}" for f in findings]
