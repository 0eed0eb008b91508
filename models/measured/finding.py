"""What a check finds in a recording: one sentence with place and size."""

from dataclasses import dataclass
from typing import Literal

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
