"""Rows of the validation report: a measured quantity with its expected value, its tolerance and the reason for it."""

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
"""How independent the two sides of a comparison are. "native": separate force laws; "handed over": an engine that is
given matrices; "shared kernel": the same force code; "closed form": an exact solution; "published": a published figure;
"measured": measured on a real vehicle; "none": no second side."""
Status = Literal["failed", "missed", "not run", "reported", "passed"]
"""Verdict of a row, worst first. ``failed`` and ``passed`` are the same on any machine; ``missed`` is a stated aim that
was not reached, such as seconds on a slow machine; ``reported`` is a figure without a verdict."""
STATUSES: tuple[Status, ...] = get_args(Status)
Side = Literal["at most", "at least"]
"""Side of its bound on which an aim is reached."""


@dataclass(frozen=True)
class Row:
    """A measured quantity with its expected value and verdict. ``value`` and ``expected`` are text where a behaviour is
    judged.

    broken, allowed : assumptions that the row's runs broke, without and with permission: see ``grounds``.
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
        """Returns the row with the status "failed" if its runs broke an assumption without permission, else
        unchanged."""
        if not self.broken or self.status == "not run":
            return self
        reason = f"{self.reason}; rests on a broken assumption: {self.broken}".removeprefix("; ")
        return replace(self, status="failed", reason=reason)

    def as_dict(self) -> dict[str, Any]:
        """The row as a dictionary for ``results.json``."""
        return asdict(self)


Saved = dict[str, Any]
"""Data that a case saves beside its rows, in the form of JSON."""
CaseAnswer = tuple[list[Row], Saved]
"""Rows of a measured case, and the data that it saves for figures and tables."""
Drawn = list[tuple[str, Any]]
"""Captions and figures of a case."""


@dataclass(frozen=True)
class Table:
    """A table of the report: a title, a sentence on how to read it, headings and rows of text."""

    title: str
    note: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Observed:
    """A measured value before it is judged; each method makes a report row with a kind of verdict.

    id : identifier of the row, which begins with the name of its case.
    system, quantity : system that the value belongs to, and a description of what was measured.
    value, unit : the value, and its unit as text; "" for a pure number.
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
        """Row for an error or a ratio that must not exceed a bound; its expected value is 0, its tolerance the
        bound."""
        return self.within(0.0, bound, tolerance_reason, independence)

    def beside(self, expected: float | str, tolerance_reason: str, independence: Independence = "published") -> Row:
        """Row that reports a value next to an expected (mostly published) value, without a verdict."""
        return self._row(expected, None, tolerance_reason, independence, "reported")

    def aim(
        self, bound: float, tolerance_reason: str, missed_side: Side = "at most", independence: Independence = "none"
    ) -> Row:
        """Row of a stated aim, which does not pass or fail: "reported" where the aim is reached, else "missed".

        It serves for figures that depend on the machine, such as seconds, their ratios and memory, and for aims that
        the method is known not to reach; ``tolerance_reason`` says which.
        """
        reached = self.value <= bound if missed_side == "at most" else self.value >= bound
        wanted = f"{missed_side} {bound:,.4g}"
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
    row_id: str,
    system_name: System,
    quantity: str,
    outcome: str,
    expected_outcome: str,
    tolerance_reason: str,
    independence: Independence = "none",
) -> Row:
    """Row for a behaviour in words, such as "refused"; it passes if ``outcome`` equals ``expected_outcome``."""
    passed = outcome == expected_outcome
    reason = "" if passed else f"found {outcome!r}"
    return Row(
        row_id,
        system_name,
        quantity,
        outcome,
        "",
        expected_outcome,
        None,
        tolerance_reason,
        independence,
        "passed" if passed else "failed",
        reason,
    )


def not_run(row_id: str, system_name: System, quantity: str, reason: str) -> Row:
    """Row for a quantity that could not be measured here, with the reason."""
    return Row(row_id, system_name, quantity, None, "", "", None, "", "none", "not run", reason, "", "")


def failed_row(row_id: str, quantity: str, reason: str) -> Row:
    """Failed row for a case that gave no value, or whose value rests on a broken assumption."""
    return Row(row_id, "pitch-plane", quantity, None, "", "", None, "", "none", "failed", reason)


def rows_on_grounds(case_name: str, measure_case: Callable[[], CaseAnswer]) -> CaseAnswer:
    """Measure a case: returns its rows, "failed" where they rest on an assumption broken without permission, and its
    saved data.

    Assumptions that runs after the last row broke have a separate row.
    """
    (rows, data), remaining_breaches = grounds.measured_rows(measure_case)
    rows = [row.with_grounds() for row in rows]
    if remaining_breaches:
        rows.append(
            failed_row(f"{case_name}.assumptions", f"runs of case {case_name} after its last row", remaining_breaches)
        )
    return rows, data


def row_of_saved(saved_row: dict[str, Any]) -> dict[str, Any]:
    """Row read from saved results, brought to the present form: older reports used "passed" for rows without verdict,
    and had no assumptions."""
    unjudged = saved_row["status"] == "passed" and saved_row["reason"] == "reported, not judged"
    saved_row = {"broken": "", "allowed": "", **saved_row}
    return saved_row | {"status": "reported", "reason": ""} if unjudged else saved_row
