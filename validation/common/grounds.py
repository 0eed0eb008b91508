"""Broken assumptions of the runs that a report row rests on.

While a case is measured, the assumptions of every result are recorded. A row rests on the results that were made
between the previous rows and itself. So do the rows that follow, until another result is made or until the statement of
the case ends that made both run and row. A row that rests on a broken assumption fails, unless the runs were made
within ``allowing_breaches``. Runs in other processes are not recorded.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TypeVar

from models.core.assumptions import BrokenAssumption, broken_assumptions_of, result_observer
from models.core.result import Result

ANY_ASSUMPTION = ""
"""Name that stands for every assumption."""


@dataclass(frozen=True)
class Breach:
    """An assumption that a run broke. run_name: title and engine; permission: reason why this is allowed, "" if it is
    not."""

    run_name: str
    assumption: BrokenAssumption
    permission: str


@dataclass
class Grounds:
    """Assumptions broken by the runs since the last rows were made, and whether rows rest on these runs already."""

    breaches: list[Breach] = field(default_factory=list)
    rows_rest_on_them: bool = False
    part_index: int = 0
    is_closed: bool = False

    def record(self, run_result: Result) -> None:
        """Record the assumptions that a result's run broke."""
        if self.rows_rest_on_them:
            self.breaches, self.rows_rest_on_them, self.is_closed = [], False, False
        self.part_index = _instruction_index()
        name, reasons = (
            f"{run_result.data.attrs['title']}, {run_result.data.attrs['engine']}".strip(", "),
            _ALLOWED_ASSUMPTIONS.get(),
        )
        for broken in broken_assumptions_of(run_result):
            self.breaches.append(Breach(name, broken, reasons.get(broken.name) or reasons.get(ANY_ASSUMPTION, "")))

    def breaches_of_row(self, is_allowed: bool) -> str:
        """Text on the broken assumptions that the row being made rests on: the allowed ones, or the forbidden ones."""
        same_part = self.part_index == _instruction_index()
        self.rows_rest_on_them, self.is_closed = True, self.is_closed or same_part
        return "" if self.is_closed and not same_part else self.breach_text(is_allowed)

    def breach_text(self, is_allowed: bool) -> str:
        """Text on each recorded broken assumption, the allowed or the forbidden ones: number of runs, largest share of
        time, and why it is allowed."""
        by_name: dict[str, list[Breach]] = {}
        for breach in self.breaches:
            if bool(breach.permission) == is_allowed:
                by_name.setdefault(breach.assumption.name, []).append(breach)
        return "; ".join(_assumption_text(similar_breaches) for similar_breaches in by_name.values())


def _assumption_text(similar_breaches: list[Breach]) -> str:
    worst = max(similar_breaches, key=lambda breach: breach.assumption.share)
    runs = f"{len(similar_breaches)} runs, the longest " if len(similar_breaches) > 1 else ""
    return f"{worst.assumption.fact()} ({runs}{worst.run_name}){f': {worst.permission}' if worst.permission else ''}"


_CURRENT_GROUNDS: ContextVar[Grounds | None] = ContextVar("grounds", default=None)
_ALLOWED_ASSUMPTIONS: ContextVar[dict[str, str]] = ContextVar("allowed", default={})  # noqa: B039  never changed in place


CaseResult = TypeVar("CaseResult")


def measured_rows(measure_case: Callable[[], CaseResult]) -> tuple[CaseResult, str]:
    """Measure a case: returns its rows with the broken assumptions of its runs, and text on the assumptions that were
    broken without permission after its last row."""
    grounds = Grounds()
    token = _CURRENT_GROUNDS.set(grounds)
    try:
        with result_observer(grounds.record):
            answer = measure_case()
    finally:
        _CURRENT_GROUNDS.reset(token)
    return answer, "" if grounds.rows_rest_on_them else grounds.breach_text(is_allowed=False)


def _instruction_index() -> int:
    """Index of the bytecode instruction that the case's function ``measure`` is executing, also if it is decorated."""
    frame, outer = sys._getframe(), sys._getframe()
    while frame.f_back is not None and frame.f_code is not measured_rows.__code__:
        outer = outer if frame.f_globals["__name__"] == "contextlib" else frame
        frame = frame.f_back
    return outer.f_lasti


@contextmanager
def allowing_breaches(tolerance_reason: str, *assumption_names: str) -> Iterator[None]:
    """Context or decorator in which runs may break the named assumptions, or any assumption if none is named.
    tolerance_reason: why this is allowed."""
    token = _ALLOWED_ASSUMPTIONS.set(
        _ALLOWED_ASSUMPTIONS.get() | dict.fromkeys(assumption_names or (ANY_ASSUMPTION,), tolerance_reason)
    )
    try:
        yield
    finally:
        _ALLOWED_ASSUMPTIONS.reset(token)


def forbidden_breaches() -> str:
    """Text on the assumptions broken without permission by the runs that the row being made rests on."""
    grounds = _CURRENT_GROUNDS.get()
    return "" if grounds is None else grounds.breaches_of_row(is_allowed=False)


def allowed_breaches() -> str:
    """Text on the assumptions broken with permission by the runs that the row being made rests on."""
    grounds = _CURRENT_GROUNDS.get()
    return "" if grounds is None else grounds.breaches_of_row(is_allowed=True)
