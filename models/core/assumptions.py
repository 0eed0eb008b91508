"""Assumptions of a vehicle, an effect or a law, and whether a run kept to them."""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from models.core.result import Result

ALLOWED_TIME_SHARE = 0.00135
"""Share of the time for which a Gaussian may lie beyond a limit: that of three standard deviations."""


@dataclass(frozen=True)
class Gaussian:
    """Values known only by mean and standard deviation (rows,); ``rows`` holds a label for each, such as "at 20
    m/s"."""

    mean: np.ndarray
    deviation: np.ndarray
    rows: Sequence[str] = ()


Watched = Mapping[str, np.ndarray | Gaussian]
"""Values at every row of a run, by the name of the part (wheel, strut, joint) that they are of."""


@dataclass(frozen=True)
class Assumption:
    """One assumption: that the values of ``watched_values`` stay between ``lower_limit`` and ``upper_limit``, in
    ``unit``.

    name : a few words; says : a sentence; remedy : what removes the assumption, such as an effect to name.
    """

    name: str
    says: str
    remedy: str
    watched_values: Callable[[Result], Watched]
    unit: str
    lower_limit: float = -math.inf
    upper_limit: float = math.inf

    @property
    def allowed(self) -> str:
        """Text on the allowed range."""
        low, high = f"at least {self.lower_limit:g}", f"at most {self.upper_limit:g}"
        if math.isinf(self.upper_limit):
            return f"{low} {self.unit}".rstrip()
        return (
            high if math.isinf(self.lower_limit) else f"from {self.lower_limit:g} to {self.upper_limit:g}"
        ) + f" {self.unit}".rstrip()


@dataclass(frozen=True)
class BrokenAssumption:
    """A violated assumption: ``where``, the share of time, the time of the first violation (s), and the worst value.

    law : by which the share is told where no values over time are known; the worst value then is three deviations off.
    """

    name: str
    says: str
    where: str
    share: float
    first: float
    worst: float
    unit: str
    allowed: str
    remedy: str
    law: str = ""

    @property
    def _worst_value_text(self) -> str:
        """Text with the worst value in four digits and its unit; no power of ten below a million."""
        return f"worst {float(f'{self.worst:.4g}'):g} {self.unit}".rstrip()

    def brief(self) -> str:
        """Short text for a figure."""
        return f"assumption broken: {self.fact()}"

    def fact(self) -> str:
        """Sentence that the assumption was broken, for readers who know the assumption."""
        return f"{self.says}; {self.where}, {self._time_text}, {self._worst_value_text}"

    @property
    def _time_text(self) -> str:
        if math.isnan(self.first) and not self.law:
            return "once"
        return f"{100.0 * self.share:.3g} % of the time" + self.law

    def line(self) -> str:
        """A full sentence for readers who do not know the assumption."""
        first = "" if math.isnan(self.first) else f", first at {self.first:.4g} s"
        return (
            f"assumption broken: {self.says}; {self.where}: {self._time_text}{first}, {self._worst_value_text} "
            f"(allowed {self.allowed}); {self.remedy}"
        )


def worst_violation(run: Result, assumption: Assumption) -> BrokenAssumption | None:
    """The worst violation of an assumption in a run, or None if there is none; NaN and infinite values are not
    judged."""
    judged = [
        _longest_exceedance(run, assumption, value_name, values)
        if isinstance(values, Gaussian)
        else _gaussian_violation(run, assumption, value_name, np.asarray(values, float))
        for value_name, values in assumption.watched_values(run).items()
    ]
    return max((breach for breach in judged if breach is not None), key=lambda breach: breach.share, default=None)


def _gaussian_violation(run: Result, a: Assumption, where: str, values: np.ndarray) -> BrokenAssumption | None:
    beyond = (values < a.lower_limit) | (values > a.upper_limit)
    if not beyond.any():
        return None
    excess = np.where(beyond, np.maximum(a.lower_limit - values, values - a.upper_limit), -np.inf)
    timed = "time" in run.data.coords and len(values) == len(run.times)
    first = float(run.times[np.argmax(beyond)]) if timed else math.nan
    worst, share = float(values[np.argmax(excess)]), float(np.mean(beyond))
    return BrokenAssumption(a.name, a.says, where, share, first, worst, a.unit, a.allowed, a.remedy)


def _longest_exceedance(run: Result, a: Assumption, where: str, values: Gaussian) -> BrokenAssumption | None:
    """The violation by the row whose normally distributed values exceed a limit for the largest share of time; None if
    no share is above ALLOWED_TIME_SHARE."""
    from scipy.special import ndtr

    with np.errstate(divide="ignore", invalid="ignore"):
        sides = np.array([a.lower_limit - values.mean, values.mean - a.upper_limit]) / values.deviation
    known = np.isfinite(values.deviation) & (values.deviation > 0.0)
    shares = np.where(known, ndtr(np.where(known, sides, -np.inf)), 0.0)
    if not (shares > ALLOWED_TIME_SHARE).any():
        return None
    side, row = (int(i) for i in np.unravel_index(shares.argmax(), shares.shape))
    timed = "time" in run.data.coords and len(values.mean) == len(run.times)
    first = float(run.times[np.argmax((shares > ALLOWED_TIME_SHARE).any(axis=0))]) if timed else math.nan
    worst = float(values.mean[row] + (-3.0, 3.0)[side] * values.deviation[row])
    value_name = f"{where} {values.rows[row]}" if values.rows else where
    share, law = float(shares[side, row]), " by the normal law"
    return BrokenAssumption(a.name, a.says, value_name, share, first, worst, a.unit, a.allowed, a.remedy, law)


def with_assumptions(run: Result, assumptions: Iterable[Assumption]) -> Result:
    """The result with a list of its assumptions and of those that it violates; its status names violations, too."""
    listed = list(assumptions)
    breaches = [breach for breach in (worst_violation(run, assumption) for assumption in listed) if breach is not None]
    run.data.attrs["assumptions"] = json.dumps(
        {"assumed": [assumption.says for assumption in listed], "broken": [asdict(breach) for breach in breaches]}
    )
    if breaches:
        run.data.attrs["status"] += ", assumptions broken"
    _RESULT_OBSERVER.get()(run)
    return run


_RESULT_OBSERVER: ContextVar[Callable[[Result], None]] = ContextVar("noted", default=lambda run: None)


@contextmanager
def watching(note: Callable[[Result], None]) -> Iterator[None]:
    """Context in which ``note`` is called with each result that is checked for assumptions. Of nested contexts only the
    inner one is called."""
    token = _RESULT_OBSERVER.set(note)
    try:
        yield
    finally:
        _RESULT_OBSERVER.reset(token)


def assumption_lines(assumptions: Iterable[Assumption], width: int = 10) -> list[str]:
    """Lines of ``twinrig show`` that list the assumptions of a scene."""
    return [f"  {'assumes':<{width}} {assumption.says} ({assumption.allowed})" for assumption in assumptions]


def broken_of(run: Result) -> list[BrokenAssumption]:
    """Violated assumptions that are stored in a result."""
    stored: dict[str, Any] = json.loads(run.data.attrs.get("assumptions", "{}"))
    return [BrokenAssumption(**entry) for entry in stored.get("broken", ())]


def assumed_of(run: Result) -> list[str]:
    """Assumptions against which a result was checked."""
    stored: dict[str, Any] = json.loads(run.data.attrs.get("assumptions", "{}"))
    return list(stored.get("assumed", ()))


@contextmanager
def collected_breaches() -> Iterator[dict[str, BrokenAssumption]]:
    """Context that collects the assumptions violated by the results checked inside: the worst violation of each, by
    name."""
    worst: dict[str, BrokenAssumption] = {}

    def note(run: Result) -> None:
        for breach in broken_of(run):
            if breach.name not in worst or breach.share > worst[breach.name].share:
                worst[breach.name] = breach

    with watching(note):
        yield worst
