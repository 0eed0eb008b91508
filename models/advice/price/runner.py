"""The work-precision runner: every setting of a problem is tried, judged, counted and timed.

    problem (validation/price/problems) -> points -> curves -> table of cheapest settings

Counts are what the report is gated on; seconds stand beside them. A setting that fails is a point like
any other, and one that gives a wrong answer without saying so is called SILENT.
"""

import math
import time
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from models.advice.price.curves import (
    RESOLVED_ERROR_FACTOR,
    ToleranceCost,
    coinciding_curves,
    cost_at_tolerance,
    observed_order,
    pareto_front,
)
from models.advice.price.problem import Setting, WorkPrecisionProblem
from models.core.assumptions import collected_broken_assumptions
from models.core.errors import InputError, RunFailed
from models.machine.timing import bootstrap_interval, bootstrap_rounds, interleave

PointStatus = Literal["ok", "raised", "refused", "flagged", "SILENT"]
CostsAtTolerance = dict[str, ToleranceCost]
WORK_COUNT_NAMES = ("contact cells", "force calls")
"""Names of the counts that can measure work; the first one that a problem's points have is used."""
COMPARED_ENGINES = ("exudyn", "mujoco")
"""Engines whose cheapest settings are reported, where a problem has them."""
PROCESSOR_CLOCK = time.process_time
"""Clock of processor seconds: other work of the machine is not in them, nor does it decide which settings are timed in
rounds.
"""
NEARLY_CHEAPEST_SECONDS_RATIO = 1.25
"""Ratio to the least seconds in one run up to which a curve may be the cheapest, so that it is timed in rounds."""
SLOW_RUN_DURATION = 0.05
"""Duration (s) of a run above which only FEWEST_TIMING_ROUNDS rounds are timed, with the first run as the first of
them: long runs scatter less.
"""
LONG_RUN_DURATION = 0.25
"""Duration (s) of a run above which rounds are timed for the middle tolerance alone, which the report's rows are
about.
"""
FEWEST_TIMING_ROUNDS = 5
"""Least number of rounds for an interval of seconds; that of a single round would look exact."""
BOOTSTRAP_DRAWS = 200
"""Number of bootstrap samples of the rounds for the interval of an interpolated ratio."""


@dataclass(frozen=True)
class WorkPrecisionPoint:
    """Outcome of one setting of a work-precision problem: errors by quantity, counts, and the seconds of every round,
    or of the only run.

    changed : whether the last of those rounds counted, or erred by, anything else; None without rounds. broken :
    assumptions that the run broke, of a problem whose solutions are judged.
    """

    setting: Setting
    status: PointStatus
    reason: str = ""
    errors: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    seconds: tuple[float, ...] = ()
    changed: bool | None = None
    broken: tuple[str, ...] = ()

    def cost(self, cost_kind: str) -> float:
        """Cost of this kind: a count, or the median of the seconds."""
        return float(np.median(self.seconds)) if cost_kind == "seconds" else float(self.counts[cost_kind])


@dataclass(frozen=True)
class LossByDefault:
    """Loss by a default method: ratio of its cost to that of the cheapest setting with the same error.

    cost_ratio with its 95 % interval (equal to it for counts, NaN after too few rounds); ``origin`` as in
    ``ToleranceCost``, for the default's side.
    """

    cost_ratio: float
    lower_limit: float
    upper_limit: float
    origin: str


@dataclass(frozen=True)
class WorkPrecisionPoints:
    """All points of a work-precision problem, with the facts about it that tables and figures need (see
    ``WorkPrecisionProblem``), in the form that is saved as JSON.
    """

    key: str
    title: str
    note: str
    units: dict[str, str]
    reference: str
    uncertainty: dict[str, float]
    bound: float
    tolerances: Sequence[float]
    duration: float
    points: list[WorkPrecisionPoint]

    @property
    def quantity(self) -> str:
        """Name of the quantity to which the tolerances apply."""
        return next(iter(self.units))

    @property
    def unit(self) -> str:
        """Unit of the quantity to which the tolerances apply."""
        return self.units[self.quantity]

    @property
    def middle_tolerance(self) -> float:
        """The tolerance that the report's rows use: the middle one of all; of two middle ones, the looser."""
        return sorted(self.tolerances)[len(self.tolerances) // 2]

    @property
    def cost_kinds(self) -> tuple[str, str]:
        """Names of the two kinds of cost: the count that measures the work, and "seconds"."""
        return next(kind for kind in WORK_COUNT_NAMES if any(kind in p.counts for p in self.points)), "seconds"

    @property
    def defaults(self) -> dict[str, WorkPrecisionPoint]:
        """Points at default settings, by the name of the engine whose default it is."""
        return {p.setting.default: p for p in self.points if p.setting.default}

    def error(self, point: WorkPrecisionPoint) -> float:
        """Error of a point in the quantity to which the tolerances apply."""
        return point.errors[self.quantity]

    def judging_floor(self, quantity: str = "") -> float:
        """Error of a quantity, in its unit, below which the reference is too uncertain to judge a setting."""
        return RESOLVED_ERROR_FACTOR * self.uncertainty[quantity or self.quantity]

    def curves(self, point_status: PointStatus | None = "ok") -> dict[str, list[WorkPrecisionPoint]]:
        """Points of each work-precision curve with this status, from coarse to fine; None means any status."""
        points_of = defaultdict(list)
        for p in sorted(self.points, key=lambda p: -p.setting.value):
            if point_status in (None, p.status):
                points_of[p.setting.curve].append(p)
        return points_of

    def pareto_points(self, cost_kind: str) -> list[WorkPrecisionPoint]:
        """Pareto front: points that no other point beats in both cost and error, in the order of rising cost, without
        errors below ``judging_floor``.
        """
        clear = [p for p in self.points if p.status == "ok" and self.error(p) >= self.judging_floor()]
        return [clear[i] for i in pareto_front([p.cost(cost_kind) for p in clear], list(map(self.error, clear)))]

    def observed_orders(self, quantity: str) -> dict[str, float]:
        """Observed order of convergence of each curve in an error: over the step, or over 1 / force calls for adaptive
        methods.
        """
        orders = {}
        for curve, points in self.curves().items():
            sizes = [1 / p.cost(self.cost_kinds[0]) if p.setting.adaptive else p.setting.value for p in points]
            orders[curve] = observed_order(sizes, [p.errors[quantity] for p in points], self.judging_floor(quantity))
        return orders

    def coinciding_curves(self) -> list[tuple[str, ...]]:
        """Groups of curves that coincide in their errors above ``judging_floor``."""
        return coinciding_curves(
            {
                curve: {p.setting.value: self.error(p) for p in points if self.error(p) >= self.judging_floor()}
                for curve, points in self.curves().items()
            }
        )

    def miscounted_methods(self) -> list[str]:
        """Texts on settings of methods with fixed stages whose number of force calls is not stages times steps."""
        wrong = []
        for p in self.points:
            steps = round(self.duration / p.setting.value)
            calls = p.setting.stages * steps
            if p.status == "ok" and p.setting.stages and (p.counts["steps"], p.counts["force calls"]) != (steps, calls):
                count_text = f"{p.counts['force calls']} instead of {calls}"
                wrong.append(f"{p.setting.curve} {p.setting.label()}: {count_text}")
        return wrong

    def costs_at_tolerance(self, target_error: float, cost_kind: str, extrapolate: bool = False) -> CostsAtTolerance:
        """Cost of the kind ``cost_kind`` at which each curve meets the error ``target_error``; curves that do not meet
        it are left out.
        """
        reaches = {
            curve: self._cost_at_tolerance(points, target_error, [p.cost(cost_kind) for p in points], extrapolate)
            for curve, points in self.curves().items()
        }
        return {curve: cheapest for curve, cheapest in reaches.items() if cheapest is not None}

    def _cost_at_tolerance(
        self,
        curve_points: list[WorkPrecisionPoint],
        target_error: float,
        costs: Sequence[float],
        extrapolate: bool = True,
    ) -> ToleranceCost | None:
        """Cost at which the points of one curve meet a target error, interpolated by ``curves.cost_at_tolerance``."""
        order = 0 if curve_points[0].setting.adaptive else curve_points[0].setting.order
        values = [p.setting.value for p in curve_points]
        return cost_at_tolerance(values, list(map(self.error, curve_points)), costs, target_error, order, extrapolate)

    def loss_by_default(
        self, target_error: float, cost_kind: str, default_curve: str, engine: str = ""
    ) -> LossByDefault | None:
        """Loss by the curve ``default_curve`` compared with the cheapest curve of ``engine`` ("" for all engines), at a
        target error; None if no curve meets it.
        """
        best = cheapest_curve(self.costs_at_tolerance(target_error, cost_kind), engine)
        usual = self.costs_at_tolerance(target_error, cost_kind, extrapolate=True).get(default_curve)
        if best is None or usual is None:
            return None
        factor = low = high = usual.cost / best[1].cost
        if cost_kind == "seconds" and best[0] != default_curve:
            pair = [
                bracketing_points(self.curves()[curve], cheapest) for curve, cheapest in ((default_curve, usual), best)
            ]
            rounds = min(len(p.seconds) for side in pair for p in side)
            if rounds < FEWEST_TIMING_ROUNDS:
                return LossByDefault(factor, math.nan, math.nan, usual.origin)
            sides = [self._bootstrapped_seconds(side, target_error, rounds) for side in pair]
            factor, low, high = bootstrap_interval(sides[0] / sides[1])
        return LossByDefault(factor, low, high, usual.origin)

    def _bootstrapped_seconds(
        self, bracket: list[WorkPrecisionPoint], target_error: float, round_count: int
    ) -> np.ndarray:
        """Seconds that a curve needs to meet a target error, interpolated between its bracketing points: one value per
        bootstrap sample of the timing rounds.
        """
        timed_rounds = [np.array(p.seconds)[:: len(p.seconds) // round_count][:round_count] for p in bracket]
        medians = np.array(
            [np.median(seconds[bootstrap_rounds(round_count, BOOTSTRAP_DRAWS)], axis=1) for seconds in timed_rounds]
        )
        cheapest_reaches = [self._cost_at_tolerance(bracket, target_error, costs) for costs in medians.T]
        return np.array([cheapest.cost for cheapest in cheapest_reaches if cheapest is not None])

    def points_to_time(self) -> list[WorkPrecisionPoint]:
        """Points that are timed in several rounds because their seconds in a single run are decisive: default settings,
        points that determine the cheapest settings and those little slower, of each engine and of all, points that
        determine a refined default, and those on the figure's front that are not slow. Runs longer than
        LONG_RUN_DURATION are chosen for the middle tolerance alone. Work is counted, so that it needs no rounds.
        """
        curves, usual = self.curves(), self.defaults.values()
        chosen = [p for p in usual if p.status == "ok"] + [
            p for p in self.pareto_points("seconds") if p.cost("seconds") <= SLOW_RUN_DURATION
        ]
        for target in self.tolerances:
            met, refined = (self.costs_at_tolerance(target, "seconds", extrapolate) for extrapolate in (False, True))
            near: CostsAtTolerance = {}
            for engine in ("", *COMPARED_ENGINES, *(p.setting.engine for p in usual)):
                near |= _nearly_cheapest(met, engine)
            near |= {p.setting.curve: refined[p.setting.curve] for p in usual if p.setting.curve in refined}
            bracketing = (p for curve, cheapest in near.items() for p in bracketing_points(curves[curve], cheapest))
            chosen += [
                p for p in bracketing if target == self.middle_tolerance or p.cost("seconds") <= LONG_RUN_DURATION
            ]
        return list({p.setting: p for p in chosen}.values())


def measured_points(priced_problem: WorkPrecisionProblem, points: Iterable[WorkPrecisionPoint]) -> WorkPrecisionPoints:
    """The points of a work-precision problem, together with the facts about the problem."""
    problem_facts = {
        problem_field.name: getattr(priced_problem, problem_field.name)
        for problem_field in fields(WorkPrecisionPoints)
        if problem_field.name != "points"
    }
    return WorkPrecisionPoints(**problem_facts, points=list(points))


SAVED_TUPLE_KEYS = ("seconds", "broken")
"""Fields of a point that are tuples, but lists in JSON."""


def points_from_saved(saved_points: dict[str, Any]) -> WorkPrecisionPoints:
    """``WorkPrecisionPoints`` restored from the dictionary that ``dataclasses.asdict`` made from them."""
    points = [
        WorkPrecisionPoint(
            **p | {"setting": Setting(**p["setting"])} | {name: tuple(p.get(name, ())) for name in SAVED_TUPLE_KEYS}
        )
        for p in saved_points["points"]
    ]
    return WorkPrecisionPoints(**{**saved_points, "points": points})


def attempt(priced_problem: WorkPrecisionProblem, setting: Setting) -> WorkPrecisionPoint:
    """Try one setting of a problem. Its status is ok, raised (the run failed with a message), refused (it was not run),
    flagged (the solution has a ``doubt``), or SILENT (the solution is not finite, or absurd, without any message).
    """
    start_time = PROCESSOR_CLOCK()
    try:
        with collected_broken_assumptions() as broken:
            solution = priced_problem.build(setting).run()
            seconds, errors = PROCESSOR_CLOCK() - start_time, priced_problem.errors(solution)
    except InputError as error:
        return WorkPrecisionPoint(setting, "refused", str(error))
    except RunFailed as error:
        return WorkPrecisionPoint(setting, "raised", str(error))
    status: PointStatus = "SILENT"
    first = errors[next(iter(priced_problem.units))]
    if reason := getattr(solution, "doubt", ""):
        status = "flagged"
    elif not all(map(math.isfinite, errors.values())):
        reason = "an error that is not a number came back as a result"
    elif first > priced_problem.bound:
        reason = f"an error of {first:.3g}, more than {priced_problem.bound:.3g}, came back as a result"
    else:
        status = "ok"
    counts = dict(solution.counts)
    return WorkPrecisionPoint(
        setting,
        status,
        reason,
        errors,
        counts,
        (seconds,),
        broken=tuple(assumption.says for assumption in broken.values()),
    )


def measure(
    priced_problem: WorkPrecisionProblem, quick: bool, round_count: int, minimum_seconds: float
) -> WorkPrecisionPoints:
    """All points of a work-precision problem. Decisive points have the seconds of ``round_count`` interleaved rounds,
    the others those of one run.

    Seconds are those of building the model and running it, input tables included, for every engine alike.
    """
    settings = priced_problem.settings(quick)
    for first in {setting.curve: setting for setting in reversed(settings)}.values():
        attempt(priced_problem, first)  # imports and compiled code are loaded before anything is timed
    once = measured_points(priced_problem, [attempt(priced_problem, setting) for setting in settings])
    rerun = _timed_points(priced_problem, once.points_to_time(), round_count, minimum_seconds)
    return replace(once, points=[rerun.get(p.setting, p) for p in once.points])


def _timed_points(
    priced_problem: WorkPrecisionProblem, points: list[WorkPrecisionPoint], round_count: int, minimum_seconds: float
) -> dict[Setting, WorkPrecisionPoint]:
    """The points with the seconds of their rounds, and whether counts or errors of the last run differ from those of
    the first run.
    """
    last_runs: dict[Setting, Any] = {}

    def run(setting: Setting) -> None:
        last_runs[setting] = priced_problem.build(setting).run()

    lasted = [p.cost("seconds") for p in points]
    interval_of_slow = -(-round_count // FEWEST_TIMING_ROUNDS) if round_count >= FEWEST_TIMING_ROUNDS else round_count
    round_intervals = [interval_of_slow if seconds > SLOW_RUN_DURATION else 1 for seconds in lasted]
    jobs = [partial(run, p.setting) for p in points]
    timed = interleave(
        jobs, round_count, minimum_seconds, warm_up_times=lasted, round_interval=round_intervals, clock=PROCESSOR_CLOCK
    )
    return {
        p.setting: replace(
            p,
            seconds=tuple(seconds[np.isfinite(seconds)].tolist()),
            changed=dict(last_runs[p.setting].counts) != p.counts
            or priced_problem.errors(last_runs[p.setting]) != p.errors,
        )
        for p, seconds in zip(points, timed, strict=True)
        if p.setting in last_runs
    }


def _nearly_cheapest(costs_by_curve: CostsAtTolerance, engine: str) -> CostsAtTolerance:
    """The cheapest curve of one engine, or of all ("") engines, and the curves that cost little more."""
    best = cheapest_curve(costs_by_curve, engine)
    return {
        curve: cheapest
        for curve, cheapest in costs_by_curve.items()
        if best and curve.startswith(engine) and cheapest.cost <= NEARLY_CHEAPEST_SECONDS_RATIO * best[1].cost
    }


def bracketing_points(curve_points: list[WorkPrecisionPoint], cheapest_cost: ToleranceCost) -> list[WorkPrecisionPoint]:
    """The one or two points of a work-precision curve between which the cost of meeting a tolerance is interpolated."""
    coarser = [p for p in curve_points if p.setting.value >= cheapest_cost.value * (1 - 1e-12)]
    finer = [p for p in curve_points if p.setting.value <= cheapest_cost.value * (1 + 1e-12)]
    return [*coarser[-1:], *(p for p in finer[:1] if p is not coarser[-1])] if coarser else finer[:1]


def cheapest_curve(costs_by_curve: CostsAtTolerance, engine: str = "") -> tuple[str, ToleranceCost] | None:
    """The name and cost of the curve that meets a tolerance at the least cost, among those of one engine or of all
    engines; None if there is none.
    """
    able = [item for item in costs_by_curve.items() if item[0].startswith(engine)]
    return min(able, key=lambda item: item[1].cost, default=None)
