"""Broken assumptions that rows rest on: those of the runs that were made before a row.

While a case is measured, every result that is judged is noted. A row rests on the results that were judged between the
rows before it and itself, and so do those that follow it until another result is judged, or until the part of the case
ends that made both run and row. A row that rests on a broken assumption fails, unless the runs were made within
``allowing_breaches``. Runs in other processes are not seen.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TypeVar

from models.core.assumptions import BrokenAssumption, broken_of, result_observer
from models.core.result import Result

ANY_ASSUMPTION = ""
"""Stands for the name of every assumption."""


@dataclass(frozen=True)
class Breach:
    """An assumption that a run broke. ``permission``: reason why this is allowed, "" if it is not."""

    run: str
    assumption: BrokenAssumption
    permission: str


@dataclass
class Grounds:
    """Broken assumptions of the runs since the last rows were made, and whether rows rest on them already."""

    breaches: list[Breach] = field(default_factory=list)
    rows_rest_on_them: bool = False
    part: int = 0
    is_closed: bool = False

    def note(self, run: Result) -> None:
        """Record the broken assumptions of a result."""
        if self.rows_rest_on_them:
            self.breaches, self.rows_rest_on_them, self.is_closed = [], False, False
        self.part = _instruction_index()
        name, reasons = f"{run.data.attrs['title']}, {run.data.attrs['engine']}".strip(", "), _ALLOWED_ASSUMPTIONS.get()
        for broken in broken_of(run):
            self.breaches.append(Breach(name, broken, reasons.get(broken.name) or reasons.get(ANY_ASSUMPTION, "")))

    def rest(self, is_allowed: bool) -> str:
        """Text on the broken assumptions on which the current row rests: the allowed ones, or those that are not."""
        same_part = self.part == _instruction_index()
        self.rows_rest_on_them, self.is_closed = True, self.is_closed or same_part
        return "" if self.is_closed and not same_part else self.told(is_allowed)

    def told(self, is_allowed: bool) -> str:
        """Text on each broken assumption (allowed or not): number of runs, longest share of time, and why it is
        allowed."""
        by_name: dict[str, list[Breach]] = {}
        for breach in self.breaches:
            if bool(breach.permission) == is_allowed:
                by_name.setdefault(breach.assumption.name, []).append(breach)
        return "; ".join(_assumption_text(similar_breaches) for similar_breaches in by_name.values())


def _assumption_text(similar_breaches: list[Breach]) -> str:
    worst = max(similar_breaches, key=lambda breach: breach.assumption.share)
    runs = f"{len(similar_breaches)} runs, the longest " if len(similar_breaches) > 1 else ""
    return f"{worst.assumption.fact()} ({runs}{worst.run}){f': {worst.permission}' if worst.permission else ''}"


_CURRENT_GROUNDS: ContextVar[Grounds | None] = ContextVar("grounds", default=None)
_ALLOWED_ASSUMPTIONS: ContextVar[dict[str, str]] = ContextVar("allowed", default={})  # noqa: B039  never changed in place


Answer = TypeVar("Answer")


def measured_rows(measure: Callable[[], Answer]) -> tuple[Answer, str]:
    """Rows of a case with the broken assumptions of its runs, and the assumptions that were broken without permission
    after its last row."""
    grounds = Grounds()
    token = _CURRENT_GROUNDS.set(grounds)
    try:
        with result_observer(grounds.note):
            answer = measure()
    finally:
        _CURRENT_GROUNDS.reset(token)
    return answer, "" if grounds.rows_rest_on_them else grounds.told(is_allowed=False)


def _instruction_index() -> int:
    """Index of the bytecode instruction that ``measure`` is executing, also if ``measure`` is decorated."""
    frame, outer = sys._getframe(), sys._getframe()
    while frame.f_back is not None and frame.f_code is not measured_rows.__code__:
        outer = outer if frame.f_globals["__name__"] == "contextlib" else frame
        frame = frame.f_back
    return outer.f_lasti


@contextmanager
def allowing_breaches(tolerance_reason: str, *names: str) -> Iterator[None]:
    """Context in which runs may break the named assumptions, or any if none is named; it can decorate a function."""
    token = _ALLOWED_ASSUMPTIONS.set(
        _ALLOWED_ASSUMPTIONS.get() | dict.fromkeys(names or (ANY_ASSUMPTION,), tolerance_reason)
    )
    try:
        yield
    finally:
        _ALLOWED_ASSUMPTIONS.reset(token)


def forbidden_breaches() -> str:
    """Broken assumptions that are not allowed and on which the current row rests."""
    grounds = _CURRENT_GROUNDS.get()
    return "" if grounds is None else grounds.rest(is_allowed=False)


def allowed_breaches() -> str:
    """Allowed broken assumptions on which the current row rests."""
    grounds = _CURRENT_GROUNDS.get()
    return "" if grounds is None else grounds.rest(is_allowed=True)
