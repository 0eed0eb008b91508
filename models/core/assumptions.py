"""Assumptions of a vehicle, an effect or a force law, and whether a run satisfies them."""

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
"""Share of the time for which a normally distributed quantity may exceed a limit: the tail beyond three standard
deviations."""


@dataclass(frozen=True)
class GaussianValues:
    """Normally distributed quantities known only by their means and standard deviations (rows,); ``rows`` labels each
    of them, such as "at 20 m/s"."""

    mean: np.ndarray
    deviation: np.ndarray
    rows: Sequence[str] = ()


Watched = Mapping[str, np.ndarray | GaussianValues]
"""Values of a quantity at every row of a run, by the name of the wheel, strut or joint."""


@dataclass(frozen=True)
class Assumption:
    """One modelling assumption: the values that ``watched_values`` takes from a result stay between ``lower_limit`` and
    ``upper_limit``, in ``unit``.

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
        """The allowed range with its unit, as text."""
        low, high = f"at least {self.lower_limit:g}", f"at most {self.upper_limit:g}"
        if math.isinf(self.upper_limit):
            return f"{low} {self.unit}".rstrip()
        return (
            high if math.isinf(self.lower_limit) else f"from {self.lower_limit:g} to {self.upper_limit:g}"
        ) + f" {self.unit}".rstrip()


@dataclass(frozen=True)
class BrokenAssumption:
    """A violated assumption: ``where`` (such as a wheel, strut or joint), the share of time, the time of the first
    violation (s), and the worst value.

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
        """The worst value with its unit as text of four digits, without a power of ten below a million."""
        return f"worst {float(f'{self.worst:.4g}'):g} {self.unit}".rstrip()

    def brief(self) -> str:
        """Short text for a figure that says which assumption was broken, where, and how far."""
        return f"assumption broken: {self.fact()}"

    def fact(self) -> str:
        """Sentence that states where and how far the assumption was broken, for readers who know the assumption."""
        return f"{self.says}; {self.where}, {self._time_text}, {self._worst_value_text}"

    @property
    def _time_text(self) -> str:
        if math.isnan(self.first) and not self.law:
            return "once"
        return f"{100.0 * self.share:.3g} % of the time" + self.law

    def line(self) -> str:
        """Full sentence on the violation with the allowed range and a remedy, for readers who do not know the
        assumption."""
        first = "" if math.isnan(self.first) else f", first at {self.first:.4g} s"
        return (
            f"assumption broken: {self.says}; {self.where}: {self._time_text}{first}, {self._worst_value_text} "
            f"(allowed {self.allowed}); {self.remedy}"
        )


def worst_violation(run_result: Result, assumption: Assumption) -> BrokenAssumption | None:
    """The worst violation of an assumption in a run, or None if there is none; NaN and infinite values are not
    judged."""
    judged = [
        _gaussian_violation(run_result, assumption, value_name, values)
        if isinstance(values, GaussianValues)
        else _sampled_violation(run_result, assumption, value_name, np.asarray(values, float))
        for value_name, values in assumption.watched_values(run_result).items()
    ]
    return max((breach for breach in judged if breach is not None), key=lambda breach: breach.share, default=None)


def _violation(
    assumption: Assumption,
    place_name: str,
    time_share: float,
    first_time: float,
    worst_value: float,
    tyre_law: str = "",
) -> BrokenAssumption:
    """The violation of an assumption at ``place_name`` for a share of the time, with its first time (s) and worst
    value."""
    named = assumption.name, assumption.says, place_name, time_share, first_time, worst_value
    return BrokenAssumption(*named, assumption.unit, assumption.allowed, assumption.remedy, tyre_law)


def _sampled_violation(
    run_result: Result, assumption: Assumption, place_name: str, sampled_values: np.ndarray
) -> BrokenAssumption | None:
    """The violation of an assumption by values sampled over a run; None if all lie within the limits."""
    beyond = (sampled_values < assumption.lower_limit) | (sampled_values > assumption.upper_limit)
    if not beyond.any():
        return None
    excess = np.where(
        beyond, np.maximum(assumption.lower_limit - sampled_values, sampled_values - assumption.upper_limit), -np.inf
    )
    timed = "time" in run_result.data.coords and len(sampled_values) == len(run_result.times)
    first = float(run_result.times[np.argmax(beyond)]) if timed else math.nan
    worst, share = float(sampled_values[np.argmax(excess)]), float(np.mean(beyond))
    return _violation(assumption, place_name, share, first, worst)


def _gaussian_violation(
    run_result: Result, assumption: Assumption, place_name: str, gaussian_values: GaussianValues
) -> BrokenAssumption | None:
    """The violation by the normally distributed quantity that exceeds a limit for the largest share of the time; None
    if no share is above ALLOWED_TIME_SHARE."""
    from scipy.special import ndtr

    with np.errstate(divide="ignore", invalid="ignore"):
        sides = (
            np.array([assumption.lower_limit - gaussian_values.mean, gaussian_values.mean - assumption.upper_limit])
            / gaussian_values.deviation
        )
    known = np.isfinite(gaussian_values.deviation) & (gaussian_values.deviation > 0.0)
    shares = np.where(known, ndtr(np.where(known, sides, -np.inf)), 0.0)
    if not (shares > ALLOWED_TIME_SHARE).any():
        return None
    side, row = (int(i) for i in np.unravel_index(shares.argmax(), shares.shape))
    timed = "time" in run_result.data.coords and len(gaussian_values.mean) == len(run_result.times)
    first = float(run_result.times[np.argmax((shares > ALLOWED_TIME_SHARE).any(axis=0))]) if timed else math.nan
    worst = float(gaussian_values.mean[row] + (-3.0, 3.0)[side] * gaussian_values.deviation[row])
    value_name = f"{place_name} {gaussian_values.rows[row]}" if gaussian_values.rows else place_name
    return _violation(assumption, value_name, float(shares[side, row]), first, worst, " by the normal law")


def with_assumptions(run_result: Result, assumptions: Iterable[Assumption]) -> Result:
    """The result with the list of its assumptions and of the violated ones; violations are named in its status, too."""
    listed = list(assumptions)
    breaches = [
        breach for breach in (worst_violation(run_result, assumption) for assumption in listed) if breach is not None
    ]
    run_result.data.attrs["assumptions"] = json.dumps(
        {"assumed": [assumption.says for assumption in listed], "broken": [asdict(breach) for breach in breaches]}
    )
    if breaches:
        run_result.data.attrs["status"] += ", assumptions broken"
    _RESULT_OBSERVER.get()(run_result)
    return run_result


_RESULT_OBSERVER: ContextVar[Callable[[Result], None]] = ContextVar("noted", default=lambda run: None)


@contextmanager
def result_observer(observe_result: Callable[[Result], None]) -> Iterator[None]:
    """Context in which ``observe_result`` is called with each result that is checked for assumptions. Of nested
    contexts only the inner one is called."""
    token = _RESULT_OBSERVER.set(observe_result)
    try:
        yield
    finally:
        _RESULT_OBSERVER.reset(token)


def assumption_lines(assumptions: Iterable[Assumption], line_width: int = 10) -> list[str]:
    """Lines of ``twinrig show`` that list the assumptions of a scene."""
    return [f"  {'assumes':<{line_width}} {assumption.says} ({assumption.allowed})" for assumption in assumptions]


def broken_assumptions_of(run_result: Result) -> list[BrokenAssumption]:
    """Violated assumptions that are stored in a result."""
    stored: dict[str, Any] = json.loads(run_result.data.attrs.get("assumptions", "{}"))
    return [BrokenAssumption(**entry) for entry in stored.get("broken", ())]


def assumption_sentences(run_result: Result) -> list[str]:
    """Sentences of the assumptions against which a result was checked."""
    stored: dict[str, Any] = json.loads(run_result.data.attrs.get("assumptions", "{}"))
    return list(stored.get("assumed", ()))


@contextmanager
def collected_broken_assumptions() -> Iterator[dict[str, BrokenAssumption]]:
    """Context that collects the assumptions violated by the results checked inside: the worst violation of each, by
    name."""
    worst: dict[str, BrokenAssumption] = {}

    def note(run_result: Result) -> None:
        for breach in broken_assumptions_of(run_result):
            if breach.name not in worst or breach.share > worst[breach.name].share:
                worst[breach.name] = breach

    with result_observer(note):
        yield worst
