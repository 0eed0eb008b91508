"""The one work-precision runner: every setting of a problem tried, judged, counted and timed.

    problem (validation/problems) -> points -> curves -> table of cheapest settings

Counts are what the report is gated on; seconds stand beside them. A setting that fails is a point like
any other, and one that gives a wrong answer without saying so is called SILENT.
"""

import math
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from models.errors import InputError, RunFailed
from validation.price import curves
from validation.price.problems import Problem, Setting
from validation.timing import interleave, interval, resamples

Status = Literal["ok", "raised", "refused", "flagged", "SILENT"]
WORK = ("contact cells", "force calls")
"""What work may be counted in: the first that a problem's points have."""
SLOW = 0.1
"""A setting that takes longer (s) is timed in rounds among its like, so that the others have more of them."""
PATIENCE = {True: 0.5, False: 2.0}
"""Seconds for all rounds of a problem's slow settings, and for those of the others, by ``quick``."""
FEWEST = {True: 1, False: 5}
"""Rounds there are at least, however long they take; with fewer than in full no interval is told, for that of one round
would look exact."""
DRAWS = 200
"""Bootstrapped sets of rounds behind the interval of an interpolated ratio."""


@dataclass(frozen=True)
class Point:
    """One setting and what became of it: errors by quantity, counts, seconds of every round.

    changed : whether the last of those rounds counted, or erred by, anything else.
    """

    setting: Setting
    status: Status
    reason: str = ""
    errors: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    seconds: tuple[float, ...] = ()
    changed: bool = False

    def cost(self, kind: str) -> float:
        """A count, or the median of the seconds."""
        return float(np.median(self.seconds)) if kind == "seconds" else float(self.counts[kind])

    def as_dict(self) -> dict[str, Any]:
        """The point as ``data/price.json`` keeps it."""
        return asdict(self)


def point(saved: dict[str, Any]) -> Point:
    """A point from what ``as_dict`` saved."""
    return Point(**{**saved, "setting": Setting(**saved["setting"]), "seconds": tuple(saved["seconds"])})


def costs(points: list[Point]) -> tuple[str, str]:
    """What work is counted in, and seconds."""
    return next(kind for kind in WORK if any(kind in p.counts for p in points)), "seconds"


def attempt(problem: Problem, setting: Setting) -> Point:
    """Try one setting: ok, raised (the run failed and said so), refused (it was not run), flagged (an answer came with
    a doubt, the solution's ``doubt``), or SILENT.
    """
    try:
        solution = problem.build(setting).run()
    except InputError as error:
        return Point(setting, "refused", str(error))
    except RunFailed as error:
        return Point(setting, "raised", str(error))
    errors, counts = problem.errors(solution), dict(solution.counts)
    doubt = getattr(solution, "doubt", "")
    return Point(setting, *(("flagged", doubt) if doubt else _judged(problem, errors)), errors, counts)


def _judged(problem: Problem, errors: dict[str, float]) -> tuple[Status, str]:
    """An answer that came back without a word is SILENT if it is not finite or beyond all sense."""
    first = errors[next(iter(problem.units))]
    if not all(math.isfinite(error) for error in errors.values()):
        return "SILENT", "an error that is not a number came back as a result"
    if first > problem.bound:
        return "SILENT", f"an error of {first:.3g}, more than {problem.bound:.3g}, came back as a result"
    return "ok", ""


def describe(problem: Problem, points: list[Point]) -> dict[str, Any]:
    """What tables and figures need to know of a problem, as JSON keeps it."""
    names = ("key", "title", "note", "units", "reference", "uncertainty", "bound", "tolerances", "duration")
    return {**{name: getattr(problem, name) for name in names}, "rounds": max(len(p.seconds) for p in points)}


def miscounted(points: list[Point], duration: float) -> list[str]:
    """Settings with fixed stages whose force calls are not stages times steps."""
    wrong = []
    for p in points:
        if p.status == "ok" and p.setting.stages:
            steps = round(duration / p.setting.value)
            found = (p.counts["steps"], p.counts["force calls"])
            if found != (steps, p.setting.stages * steps):
                wrong.append(f"{p.setting.curve} {p.setting.label()}: {found[1]} instead of {p.setting.stages * steps}")
    return wrong


def measure(problem: Problem, quick: bool, rounds: int, least: float) -> list[Point]:
    """All points of a problem, with the seconds of up to ``rounds`` interleaved rounds for those that are ok.

    Seconds are those of building the model and running it, input tables included, for every engine alike.
    """
    points, ends = [], [time.perf_counter()]
    for setting in problem.settings(quick):
        points.append(attempt(problem, setting))
        ends.append(time.perf_counter())
    lasted, fine = np.diff(ends), np.array([p.status == "ok" for p in points])
    for chosen in (np.flatnonzero(fine & (lasted <= SLOW)), np.flatnonzero(fine & (lasted > SLOW))):
        once = max(lasted[chosen].sum(), least * chosen.size, 1e-9)
        most = max(FEWEST[quick], min(rounds, int(PATIENCE[quick] / once)))
        for i, again in zip(chosen, _timed(problem, [points[i] for i in chosen], most, least, lasted[chosen]),
                            strict=True):  # fmt: skip
            points[i] = again
    return points


def _timed(problem: Problem, points: list[Point], rounds: int, least: float, lasted: np.ndarray) -> list[Point]:
    """The points with their seconds, and whether their last run was as their first, which ``lasted`` (n,) s."""
    last: dict[int, Any] = {}
    jobs = [lambda i=i, p=p: last.update({i: problem.build(p.setting).run()}) for i, p in enumerate(points)]
    return [replace(p, seconds=tuple(seconds), changed=_changed(problem, p, last[i]))
            for i, (p, seconds) in enumerate(zip(points, interleave(jobs, rounds, least, lasted=lasted), strict=True))]


def _changed(problem: Problem, p: Point, again: Any) -> bool:
    """Whether a repeated run counted or gave something else."""
    return dict(again.counts) != p.counts or problem.errors(again) != p.errors


def by_curve(points: list[Point], status: Status | None = "ok") -> dict[str, list[Point]]:
    """Points of each curve, from coarse to fine; None takes every status."""
    found: dict[str, list[Point]] = defaultdict(list)
    for p in sorted(points, key=lambda p: -p.setting.value):
        if status is None or p.status == status:
            found[p.setting.curve].append(p)
    return found


def orders(points: list[Point], quantity: str, uncertainty: float) -> dict[str, float]:
    """Observed order of each curve: over the step, or over 1 / force calls for adaptive methods."""
    found = {}
    for curve, own in by_curve(points).items():
        sizes = [1 / p.cost(costs(points)[0]) if p.setting.adaptive else p.setting.value for p in own]
        found[curve] = curves.observed_order(sizes, [p.errors[quantity] for p in own], curves.HOLLOW * uncertainty)
    return found


def same(points: list[Point], quantity: str, uncertainty: float) -> list[tuple[str, ...]]:
    """Groups of curves that coincide, judged on the points that stand clear of the reference's uncertainty."""
    clear = {curve: {p.setting.value: p.errors[quantity] for p in own
                     if p.errors[quantity] >= curves.HOLLOW * uncertainty}
             for curve, own in by_curve(points).items()}  # fmt: skip
    return curves.coinciding(clear)


def reaches(points: list[Point], quantity: str, target: float, kind: str,
            extrapolate: bool = False) -> dict[str, curves.Reach]:  # fmt: skip
    """What each curve needs to meet ``target``, in one of ``costs``; curves that do not are left out."""
    found = {}
    for curve, own in by_curve(points).items():
        one = _reach(own, quantity, target, [p.cost(kind) for p in own], extrapolate)
        if one is not None:
            found[curve] = one
    return found


def _reach(own: list[Point], quantity: str, target: float, costs: Sequence[float],
           extrapolate: bool = False) -> curves.Reach | None:  # fmt: skip
    """``curves.reach`` on the points of one curve."""
    values, errors = [p.setting.value for p in own], [p.errors[quantity] for p in own]
    order = 0 if own[0].setting.adaptive else own[0].setting.order
    return curves.reach(values, errors, costs, target, order, extrapolate)


def cheapest(found: dict[str, curves.Reach], among: str = "") -> tuple[str, curves.Reach] | None:
    """The curve that meets a tolerance at the least cost, among those of one engine or of all."""
    able = {curve: one for curve, one in found.items() if curve.startswith(among)}
    return min(able.items(), key=lambda item: item[1].cost) if able else None


@dataclass(frozen=True)
class Loss:
    """How many times the cheapest setting's cost a default method takes for the same error.

    factor with its 95 % interval (equal to it for counts, NaN after too few rounds); ``how`` as in ``Reach``, for the
    default's side.
    """

    factor: float
    low: float
    high: float
    how: str


def loss(points: list[Point], quantity: str, target: float, kind: str, default: str, among: str = "") -> Loss | None:
    """Loss of the curve ``default`` against the cheapest one among ``among`` ("" for all); None if none meets it."""
    best = cheapest(reaches(points, quantity, target, kind), among)
    own = reaches(points, quantity, target, kind, extrapolate=True).get(default)
    if best is None or own is None:
        return None
    factor = low = high = own.cost / best[1].cost
    if kind == "seconds" and best[0] != default:
        pair = [by_curve(points)[curve] for curve in (default, best[0])]
        if min(len(p.seconds) for curve in pair for p in curve) < FEWEST[False]:
            return Loss(factor, math.nan, math.nan, own.how)
        sides = [_resampled(curve, quantity, target) for curve in pair]
        _, low, high = interval(sides[0] / sides[1])
    return Loss(factor, low, high, own.how)


def _resampled(own: list[Point], quantity: str, target: float) -> np.ndarray:
    """Seconds that one curve needs, once per bootstrapped set of rounds."""
    medians = np.array([np.median(np.array(p.seconds)[resamples(len(p.seconds), DRAWS)], axis=1) for p in own])
    found = [_reach(own, quantity, target, costs, extrapolate=True) for costs in medians.T]
    return np.array([one.cost for one in found if one is not None])


def defaults(points: list[Point]) -> dict[str, Point]:
    """The points that are somebody's default setting, by whose."""
    return {p.setting.default: p for p in points if p.setting.default}
