"""Rows of the validation report: one quantity each, with what was expected and why."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, get_args

from validation.common import grounds

System = Literal[
    "pitch-plane",
    "drift",
    "contact",
    "ride",
    "rolling-vehicle",
    "anti-lock",
    "measured",
    "hard-cases",
    "cost",
    "effects",
]
Independence = Literal["native", "handed over", "shared kernel", "closed form", "published", "measured", "none"]
"""How far the two sides are apart: separate force laws, an engine that is handed matrices, the same force code, an
exact answer, a published figure, what was measured on a real vehicle, or no second side."""
Status = Literal["failed", "missed", "not run", "reported", "passed"]
"""In the order in which they are told. ``failed`` and ``passed`` are judged, the same on any machine; ``missed`` is
a stated aim that was not reached, as by seconds of a slow machine; ``reported`` stands without being judged."""
STATUSES: tuple[Status, ...] = get_args(Status)
Side = Literal["at most", "at least"]
"""On which side of its bound an aim is reached."""


@dataclass(frozen=True)
class Row:
    """One measured quantity. ``value`` and ``expected`` may be text where a behaviour is judged.

    broken, allowed : assumptions that the runs it rests on broke, without and with leave: see ``grounds``.
    """

    id: str
    system: System
    quantity: str
    value: float | str | None
    unit: str
    expected: float | str
    tolerance: float | None
    why: str
    independence: Independence
    status: Status
    reason: str = ""
    broken: str = field(default_factory=grounds.forbidden_breaches)
    allowed: str = field(default_factory=grounds.allowed_breaches)

    def with_grounds(self) -> "Row":
        """The row; its status is "failed" if it rests on an assumption that was broken without permission."""
        if not self.broken or self.status == "not run":
            return self
        reason = f"{self.reason}; rests on a broken assumption: {self.broken}".removeprefix("; ")
        return replace(self, status="failed", reason=reason)

    def as_dict(self) -> dict[str, Any]:
        """The row in the form for ``results.json``."""
        return asdict(self)


Saved = dict[str, Any]
"""What a case saves beside its rows, as JSON keeps it."""
CaseAnswer = tuple[list[Row], Saved]
"""What a case answers when it is measured."""
Drawn = list[tuple[str, Any]]
"""Captions and figures that a case shows."""


@dataclass(frozen=True)
class Table:
    """A table of the report: a title, a sentence on how to read it, headings and rows of text."""

    title: str
    note: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Observed:
    """A measured value before it is judged; each method makes a row with one kind of verdict.

    id : name of the row, which begins with the name of its case.
    system, quantity : system that the figure belongs to, and in words what was measured.
    value, unit : the figure, and its unit as text; "" for a pure number.
    """

    id: str
    system: System
    quantity: str
    value: float
    unit: str

    def within(self, expected: float, tolerance: float, tolerance_reason: str, independence: Independence) -> Row:
        """Row that passes if |value - expected| <= tolerance; a value that is not a number fails."""
        passed = abs(self.value - expected) <= tolerance
        reason = "" if passed else f"off by {abs(self.value - expected):.3g}, allowed {tolerance:.3g}"
        return self._row(expected, tolerance, tolerance_reason, independence, "passed" if passed else "failed", reason)

    def at_most(self, bound: float, tolerance_reason: str, independence: Independence) -> Row:
        """Row for an error or a ratio that must not exceed a bound: expected 0, tolerance the bound."""
        return self.within(0.0, bound, tolerance_reason, independence)

    def beside(self, expected: float | str, tolerance_reason: str, independence: Independence = "published") -> Row:
        """Row that reports a value next to a published value without a verdict."""
        return self._row(expected, None, tolerance_reason, independence, "reported")

    def aim(
        self, bound: float, tolerance_reason: str, side: Side = "at most", independence: Independence = "none"
    ) -> Row:
        """Row of a stated aim that decides no verdict: reported where it is reached, missed otherwise or for no number.

        So are figures that the machine decides, as seconds, their ratios and memory, and aims that the method is known
        not to reach: ``tolerance_reason`` says for which of the two reasons.
        """
        reached = self.value <= bound if side == "at most" else self.value >= bound
        wanted = f"{side} {bound:,.4g}"
        missed = f"{self.value:,.4g}{f' {self.unit}' if self.unit else ''}; the aim is {wanted}"
        return self._row(
            wanted, None, tolerance_reason, independence, *(("reported", "") if reached else ("missed", missed))
        )

    def _row(
        self,
        expected: float | str,
        tolerance: float | None,
        tolerance_reason: str,
        independence: Independence,
        status: Status,
        reason: str = "",
    ) -> Row:
        identity = (self.id, self.system, self.quantity, self.value, self.unit)
        return Row(*identity, expected, tolerance, tolerance_reason, independence, status, reason)


def behaviour_row(
    id: str,
    system: System,
    quantity: str,
    outcome: str,
    expected: str,
    tolerance_reason: str,
    independence: Independence = "none",
) -> Row:
    """Row for a behaviour, such as "refused": passes if found and expected are the same word."""
    passed = outcome == expected
    reason = "" if passed else f"found {outcome!r}"
    return Row(
        id,
        system,
        quantity,
        outcome,
        "",
        expected,
        None,
        tolerance_reason,
        independence,
        "passed" if passed else "failed",
        reason,
    )


def not_run(id: str, system: System, quantity: str, reason: str) -> Row:
    """Row for something that could not be measured here, with the reason."""
    return Row(id, system, quantity, None, "", "", None, "", "none", "not run", reason, "", "")


def failed_row(id: str, quantity: str, reason: str) -> Row:
    """Row for a case that gave no value, or whose value rests on a broken assumption."""
    return Row(id, "pitch-plane", quantity, None, "", "", None, "", "none", "failed", reason)


def rows_on_grounds(name: str, measure: Callable[[], CaseAnswer]) -> CaseAnswer:
    """Rows of a case, failed if they rest on an assumption that was broken without permission.

    What runs after the last row broke has a row of its own.
    """
    (rows, data), remaining_breaches = grounds.measured_rows(measure)
    rows = [row.with_grounds() for row in rows]
    if remaining_breaches:
        rows.append(failed_row(f"{name}.assumptions", f"runs of case {name} after its last row", remaining_breaches))
    return rows, data


def of_saved(row: dict[str, Any]) -> dict[str, Any]:
    """Row from saved results; older reports used "passed" for rows without verdict, and had no assumptions."""
    unjudged = row["status"] == "passed" and row["reason"] == "reported, not judged"
    row = {"broken": "", "allowed": "", **row}
    return row | {"status": "reported", "reason": ""} if unjudged else row
