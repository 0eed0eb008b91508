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

from models.advice.price import curves
from models.advice.price.problem import Problem, Setting
from models.core.errors import InputError, RunFailed
from models.machine.timing import interleave, interval, resamples

Status = Literal["ok", "raised", "refused", "flagged", "SILENT"]
WORK = ("contact cells", "force calls")
"""What work may be counted in: the first that a problem's points have."""
RIVALS = ("exudyn", "mujoco")
"""Engines whose own cheapest setting is told, where a problem has them."""
CLOCK = time.process_time
"""Seconds of the processor: what else the machine does is not in them, nor in which settings have rounds."""
NEAR = 1.25
"""A curve that takes up to so many times the least seconds in one run may be the cheapest: rounds tell."""
SLOW = 0.05
"""A setting that takes longer (s) has FEWEST rounds, its first run as the first of them: a long run wanders less."""
LONG = 0.25
"""A setting that takes longer (s) has rounds for the tolerance in the middle alone, which the rows are about."""
FEWEST = 5
"""With fewer rounds no interval is told: that of one would look exact."""
DRAWS = 200
"""Bootstrapped sets of rounds behind the interval of an interpolated ratio."""


@dataclass(frozen=True)
class Point:
    """One setting and what became of it: errors by quantity, counts, seconds of every round, or of the one run.

    changed : whether the last of those rounds counted, or erred by, anything else; None without rounds.
    """

    setting: Setting
    status: Status
    reason: str = ""
    errors: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    seconds: tuple[float, ...] = ()
    changed: bool | None = None

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
    begun = CLOCK()
    try:
        solution = problem.build(setting).run()
    except InputError as error:
        return Point(setting, "refused", str(error))
    except RunFailed as error:
        return Point(setting, "raised", str(error))
    seconds, errors, counts = CLOCK() - begun, problem.errors(solution), dict(solution.counts)
    doubt = getattr(solution, "doubt", "")
    return Point(setting, *(("flagged", doubt) if doubt else _judged(problem, errors)), errors, counts, (seconds,))


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
    return {name: getattr(problem, name) for name in names}


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
    """All points of a problem: with the seconds of ``rounds`` interleaved rounds where they decide something, else with
    those of one run.

    Seconds are those of building the model and running it, input tables included, for every engine alike.
    """
    settings = problem.settings(quick)
    for first in {setting.curve: setting for setting in reversed(settings)}.values():
        attempt(problem, first)  # imports and compiled code are loaded before anything is timed
    points = [attempt(problem, setting) for setting in settings]
    again = _timed(problem, racing(problem, points), rounds, least)
    return [again.get(p.setting, p) for p in points]


def racing(problem: Problem, points: list[Point]) -> list[Point]:
    """Points whose seconds decide something, by one run of each: the defaults; what the cheapest settings rest on, and
    what those may that take little longer, of all and of each engine; what a default rests on that is refined; of the
    front of the figure what is not slow; what takes LONG, for the middle tolerance alone. Work is counted, so what wins
    by it needs no rounds.
    """
    quantity, own, usual = next(iter(problem.units)), by_curve(points), defaults(points).values()
    best = front(points, quantity, problem.uncertainty[quantity], "seconds")
    chosen = [p for p in usual if p.status == "ok"] + [p for p in best if p.cost("seconds") <= SLOW]
    for target in problem.tolerances:
        met, all_of = (reaches(points, quantity, target, "seconds", extrapolate) for extrapolate in (False, True))
        near = {
            curve: one
            for engine in ("", *RIVALS, *(p.setting.engine for p in usual))
            for curve, one in _near(met, engine).items()
        }
        near |= {p.setting.curve: all_of[p.setting.curve] for p in usual if p.setting.curve in all_of}
        chosen += [
            p
            for curve, one in near.items()
            for p in resting(own[curve], one)
            if target == middle(problem.tolerances) or p.cost("seconds") <= LONG
        ]
    return list({p.setting: p for p in chosen}.values())


def middle(tolerances: Sequence[float]) -> float:
    """The tolerance that rows are about, the looser of two."""
    return sorted(tolerances)[len(tolerances) // 2]


def _near(found: dict[str, curves.Reach], among: str) -> dict[str, curves.Reach]:
    """The cheapest curve among those of one engine, or of all, and those that take little longer."""
    best = cheapest(found, among)
    return {
        curve: one
        for curve, one in found.items()
        if best and curve.startswith(among) and one.cost <= NEAR * best[1].cost
    }


def resting(own: list[Point], one: curves.Reach) -> list[Point]:
    """The one or two points of a curve that a reach is made of."""
    coarser = [p for p in own if p.setting.value >= one.value * (1 - 1e-12)]
    finer = [p for p in own if p.setting.value <= one.value * (1 + 1e-12)]
    return [*coarser[-1:], *(p for p in finer[:1] if p is not coarser[-1])] if coarser else finer[:1]


def front(points: list[Point], quantity: str, uncertainty: float, kind: str) -> list[Point]:
    """The points that stand clear of the reference's uncertainty and that no other one beats, by rising cost."""
    clear = [p for p in points if p.status == "ok" and p.errors[quantity] >= curves.HOLLOW * uncertainty]
    return [clear[i] for i in curves.pareto([p.cost(kind) for p in clear], [p.errors[quantity] for p in clear])]


def _timed(problem: Problem, points: list[Point], rounds: int, least: float) -> dict[Setting, Point]:
    """The points with the seconds of their rounds, and whether their last run was as their first."""
    last: dict[int, Any] = {}
    jobs = [lambda i=i, p=p: last.update({i: problem.build(p.setting).run()}) for i, p in enumerate(points)]
    lasted = [p.cost("seconds") for p in points]
    apart = -(-rounds // FEWEST) if rounds >= FEWEST else rounds
    every = [apart if one > SLOW else 1 for one in lasted]
    found = interleave(jobs, rounds, least, lasted=lasted, every=every, clock=CLOCK)
    return {
        p.setting: replace(p, seconds=tuple(own[np.isfinite(own)].tolist()), changed=_changed(problem, p, last[i]))
        for i, (p, own) in enumerate(zip(points, found, strict=True))
        if i in last
    }


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
    clear = {
        curve: {p.setting.value: p.errors[quantity] for p in own if p.errors[quantity] >= curves.HOLLOW * uncertainty}
        for curve, own in by_curve(points).items()
    }
    return curves.coinciding(clear)


def reaches(
    points: list[Point], quantity: str, target: float, kind: str, extrapolate: bool = False
) -> dict[str, curves.Reach]:
    """What each curve needs to meet ``target``, in one of ``costs``; curves that do not are left out."""
    found = {}
    for curve, own in by_curve(points).items():
        one = _reach(own, quantity, target, [p.cost(kind) for p in own], extrapolate)
        if one is not None:
            found[curve] = one
    return found


def _reach(
    own: list[Point], quantity: str, target: float, costs: Sequence[float], extrapolate: bool = False
) -> curves.Reach | None:
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
        pair = [resting(by_curve(points)[curve], one) for curve, one in ((default, own), best)]
        rounds = min(len(p.seconds) for side in pair for p in side)
        if rounds < FEWEST:
            return Loss(factor, math.nan, math.nan, own.how)
        sides = [_resampled(side, quantity, target, rounds) for side in pair]
        factor, low, high = interval(sides[0] / sides[1])
    return Loss(factor, low, high, own.how)


def _resampled(side: list[Point], quantity: str, target: float, rounds: int) -> np.ndarray:
    """Seconds that a curve needs by the points it rests on, once per bootstrapped set of the rounds that both have."""
    kept = [np.array(p.seconds)[:: len(p.seconds) // rounds][:rounds] for p in side]
    medians = np.array([np.median(own[resamples(rounds, DRAWS)], axis=1) for own in kept])
    found = [_reach(side, quantity, target, costs, extrapolate=True) for costs in medians.T]
    return np.array([one.cost for one in found if one is not None])


def defaults(points: list[Point]) -> dict[str, Point]:
    """The points that are somebody's default setting, by whose."""
    return {p.setting.default: p for p in points if p.setting.default}
