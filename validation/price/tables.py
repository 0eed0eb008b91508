"""Tables of a work-precision run: cheapest settings, what defaults lose, all curves, and what failed."""

import math
from collections import Counter, defaultdict
from dataclasses import replace
from typing import Any

import numpy as np

from models.advice.price import runner as cost
from models.advice.price.curves import HOLLOW, Reach
from models.advice.price.problem import Setting
from models.advice.price.runner import Loss, Point, by_curve
from models.drawing.figures import LABELS
from models.machine.timing import describe
from validation.common.rows import Table


def tables(problem: dict[str, Any], points: list[Point]) -> list[Table]:
    """All tables of one problem from its saved data."""
    return [
        cheapest(problem, points),
        losses(problem, points),
        every_curve(problem, points),
        outcomes(points),
        failures(points),
    ]


def named(curve: str, groups: list[tuple[str, ...]] | None = None) -> str:
    """A curve as a reader names it, with those that coincide with it."""
    alike = next((group for group in groups or [] if curve in group), (curve,))
    return " = ".join(_plain(one) for one in sorted(alike, key=lambda one: one != curve))


def _plain(curve: str) -> str:
    engine, _, method = curve.partition(" ")
    return f"{LABELS.get(engine, engine)} {method}"


def quantity_of(problem: dict[str, Any]) -> str:
    """The quantity that tolerances are set on."""
    return next(iter(problem["units"]))


def groups_of(problem: dict[str, Any], points: list[Point]) -> list[tuple[str, ...]]:
    """Coinciding curves of a saved problem."""
    quantity = quantity_of(problem)
    return cost.same(points, quantity, problem["uncertainty"][quantity])


def cheapest(problem: dict[str, Any], points: list[Point]) -> Table:
    """The cheapest setting that meets each tolerance."""
    quantity, groups = quantity_of(problem), groups_of(problem, points)
    unit, work = problem["units"][quantity], cost.costs(points)[0]
    rivals = [engine for engine in cost.RIVALS if any(p.setting.engine == engine for p in points)]
    rows = []
    for target in problem["tolerances"]:
        calls = cost.reaches(points, quantity, target, work)
        seconds = cost.reaches(points, quantity, target, "seconds")
        rows.append(
            (
                f"{target:g}",
                _won(points, calls, "", work.split()[-1], groups),
                *(_won(points, seconds, among, "ms") for among in ("", *rivals)),
            )
        )
    note = (
        "Fixed steps are interpolated log-log between neighbouring settings; methods without one order count at "
        "the loosest setting tried that does; 'coarsest' is the coarsest setting tried. Nothing is extrapolated. "
        f"{work.capitalize()} are exact and the same on every machine; seconds are those of this processor, "
        f"everything built anew. {rounds_of(points)}"
    )
    heads = (
        f"{quantity} error at most [{unit}]",
        f"fewest {work}",
        "fewest seconds",
        *(f"fewest in {LABELS[engine]}" for engine in rivals),
    )
    return Table("Cheapest setting that meets the tolerance", note, heads, tuple(rows))


def rounds_of(points: list[Point]) -> str:
    """How many settings have how many rounds, and how far these wander."""
    in_rounds = [p.seconds for p in points if p.status == "ok" and p.changed is not None]
    numbers = Counter(map(len, in_rounds))
    told = " and ".join(f"{n} interleaved rounds for {count}" for n, count in sorted(numbers.items(), reverse=True))
    if not in_rounds:
        return "Seconds are those of one run each."
    spread = float(np.median([one["mad"] / one["median"] for one in map(describe, in_rounds)]))
    once = sum(p.status == "ok" for p in points) - len(in_rounds)
    return (
        f"Seconds are medians of {told} settings whose seconds decide something (fewer where a run is longer than "
        f"{1e3 * cost.SLOW:g} ms; median absolute deviation {100 * spread:.0f} %), and of one run for {once} that "
        f"are far from the cheapest, or longer than {1e3 * cost.LONG:g} ms and not for the middle "
        "tolerance."
    )


def _won(
    points: list[Point], found: dict[str, Reach], among: str, unit: str, groups: list[tuple[str, ...]] | None = None
) -> str:
    best = cost.cheapest(found, among)
    if best is None:
        return "none of those tried"
    curve, one = best
    paid = f"{1e3 * one.cost:.3g} ms" if unit == "ms" else f"{one.cost:,.0f} {unit}"
    return f"{named(curve, groups)}, {_setting(points, curve, one)}: {paid}"


def _setting(points: list[Point], curve: str, one: Reach) -> str:
    label = replace(by_curve(points)[curve][0].setting, value=one.value).label()
    return f"{label} (coarsest)" if one.how == "coarsest" else label


def losses(problem: dict[str, Any], points: list[Point]) -> Table:
    """What each engine's default method costs beside the cheapest one, for the same error."""
    quantity = quantity_of(problem)
    owners = cost.defaults(points)
    rows = [
        (
            f"{target:g}",
            *(
                _lost(cost.loss(points, quantity, target, kind, own.setting.curve, among))
                for own in owners.values()
                for among in (own.setting.engine, "")
                for kind in cost.costs(points)
            ),
        )
        for target in problem["tolerances"]
    ]
    heads = tuple(
        f"{owner} by best of {among}: {kind}"
        for owner in owners
        for among in (owner, "all")
        for kind in cost.costs(points)
    )
    as_is = "; ".join(
        f"{owner}: {own.setting.method} at {own.setting.label()}, which by itself "
        + (
            f"gives {own.errors[quantity]:.3g} {problem['units'][quantity]}"
            if own.status == "ok"
            else f"is {STATUSES[own.status]}"
        )
        for owner, own in owners.items()
    )
    note = (
        "The default method, its step refined until it meets the tolerance, by the cheapest setting that does. "
        f"{as_is}. * means that no step tried was fine enough: extrapolated by the method's declared order. "
        "In brackets: 95 % interval, bootstrapped over the rounds that both have; none after fewer than "
        f"{cost.FEWEST}."
    )
    return Table("Factor that a default setting loses", note, (f"{quantity} error at most", *heads), tuple(rows))


def _lost(found: Loss | None) -> str:
    if found is None:
        return "-"
    mark = "*" if found.how == "extrapolated" else ""
    if not found.low < found.high:  # a count, or too few rounds
        return f"{_short(found.factor)}{mark}"
    return f"{_short(found.factor)}{mark} [{_short(found.low)}, {_short(found.high)}]"


def _short(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def every_curve(problem: dict[str, Any], points: list[Point]) -> Table:
    """A row per curve: settings, errors, observed order, what an error of 1 costs."""
    quantity, groups = quantity_of(problem), groups_of(problem, points)
    orders = cost.orders(points, quantity, problem["uncertainty"][quantity])
    work, middle = cost.costs(points)[0], cost.middle(problem["tolerances"])
    calls, seconds = (cost.reaches(points, quantity, middle, kind) for kind in (work, "seconds"))
    rows = tuple(
        (
            _plain(curve),
            str(len(own)),
            f"{own[0].setting.label()} to {own[-1].setting.label()}",
            f"{own[0].errors[quantity]:.2g} to {own[-1].errors[quantity]:.2g}",
            _order(orders[curve]),
            _declared(own[0].setting),
            _number(calls.get(curve), 1, ",.0f"),
            _once(own, seconds.get(curve)) + _number(seconds.get(curve), 1e3, ".3g"),
            named(curve, groups).partition(" = ")[2] or "-",
        )
        for curve, own in by_curve(points).items()
    )
    unit = problem["units"][quantity]
    note = (
        f"Order: slope of the error over the step on the three finest settings whose error exceeds {HOLLOW:g} "
        "times the uncertainty of the reference; for adaptive methods over 1 / calls, where loose tolerances "
        "are still ruled by stability. Curves coincide if their errors agree to 1 % at every common "
        "setting. ~: seconds of one run."
    )
    heads = (
        "curve",
        "settings",
        "from, to",
        f"{quantity} error [{unit}]",
        "observed order",
        "declared",
        f"{work} for {middle:g} {unit}",
        f"ms for {middle:g} {unit}",
        "coincides with",
    )
    return Table("Every integrator that each engine offers", note, heads, rows)


def _once(own: list[Point], one: Reach | None) -> str:
    """A mark for what rests on a setting that has no rounds."""
    return "~" if one is not None and any(p.changed is None for p in cost.resting(own, one)) else ""


def _order(found: float) -> str:
    return "-" if math.isnan(found) else f"{found:.2f}"


def _declared(setting: Setting) -> str:
    return str(setting.order) if setting.order else "varies"


def _number(one: Reach | None, scale: float, form: str) -> str:
    if one is None:
        return "not met"
    return format(scale * one.cost, form) + (" (coarsest)" if one.how == "coarsest" else "")


def outcomes(points: list[Point]) -> Table:
    """How many settings of each engine ended in which way."""
    engines = dict.fromkeys(p.setting.engine for p in points)
    rows = tuple(
        (LABELS.get(engine, engine), *(_ended(points, engine, status) for status in ("", *STATUSES)))
        for engine in engines
    )
    note = (
        "Fine: an answer; raised: the run failed and said so; refused: not run, with the reason; flagged: "
        "an answer came with a doubt; silent: a wrong answer that came back as a result, of which there must be "
        "none."
    )
    return Table("Settings by how they ended", note, ("engine", "settings", *STATUSES.values()), rows)


STATUSES = {"ok": "fine", "raised": "raised", "refused": "refused", "flagged": "flagged", "SILENT": "silent"}


def _ended(points: list[Point], engine: str, status: str) -> str:
    return str(sum(p.setting.engine == engine and status in ("", p.status) for p in points))


def failures(points: list[Point]) -> Table:
    """Everything that gave no answer to rely on, with what was said."""
    found: dict[tuple[str, str, str], list[str]] = defaultdict(list)
    for p in points:
        if p.status != "ok":
            found[_plain(p.setting.curve), STATUSES[p.status], p.reason].append(p.setting.label())
    rows = tuple((curve, ", ".join(labels), status, reason) for (curve, status, reason), labels in found.items())
    return Table(
        "Settings that gave no answer to rely on",
        "What was said, by how the setting ended.",
        ("curve", "setting", "status", "what was said"),
        rows,
    )
