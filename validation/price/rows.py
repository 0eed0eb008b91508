"""Rows that every work-precision problem answers for."""

from models.advice.price import runner as cost
from models.advice.price.curves import Reach
from models.advice.price.problem import Problem, Setting
from models.advice.price.runner import Point
from validation.common.rows import Row, System, at_most, finding, within
from validation.price.tables import named

SYSTEM: System = "cost"
BANDS = {1: 0.1, 2: 0.1, 3: 0.2, 4: 0.2, 6: 0.5}
"""Allowed distance of the observed from the declared order: at these steps the next power still shows,
the more the higher the order (RK4 between 1 and 0.25 ms: 4.17)."""
SURE = 1e-4
"""Share of the finest tolerance that a reference may leave uncertain, where a problem has no ``sure`` of its own."""
SETTLED = 0.9
"""Of the last but one error: a curve that falls no further has come down to its theory's own."""
PROMISE = 1.25
"""Allowed error at an interpolated cheapest setting, by its tolerance: curves bend between two settings."""


def rows_of(problem: Problem, points: list[Point], quick: bool) -> list[Row]:
    """All rows of one problem; the width of the sweep is asked of the full run only."""
    rows = [
        _reference(problem),
        *_orders(problem, points),
        _silent(problem, points),
        _counts(problem, points),
        _repeat(problem, points),
    ]
    rows += [_promises(problem, points)] if quick else [_promises(problem, points), _sweep(problem, points)]
    return rows + _losses(problem, points)


def _quantity(problem: Problem) -> tuple[str, str]:
    """Name and unit of what tolerances are set on."""
    return next(iter(problem.units.items()))


def _reference(problem: Problem) -> Row:
    """The reference must know more than the finest tolerance asks."""
    quantity, unit = _quantity(problem)
    share = getattr(problem, "sure", SURE)
    return at_most(
        f"price.{problem.key}.reference",
        SYSTEM,
        f"uncertainty of the reference ({problem.reference}), {quantity}",
        problem.uncertainty[quantity],
        unit,
        share * min(problem.tolerances),
        "what the reference states of itself or solvers of different "
        f"families differ by; {share:g} of the finest tolerance, so that curves stand clear",
        "closed form",
    )


def _orders(problem: Problem, points: list[Point]) -> list[Row]:
    """Observed order of every fixed-step method that declares one, for every quantity."""
    rows = []
    for quantity in problem.units:
        for curve, found in cost.orders(points, quantity, problem.uncertainty[quantity]).items():
            setting = cost.by_curve(points)[curve][0].setting
            if setting.adaptive or not setting.order:
                continue
            name = f"price.{problem.key}.order.{quantity}.{curve}".replace(" ", "-")
            what = f"observed order of the largest {quantity} error, {named(curve)}"
            rows.append(
                within(
                    name,
                    SYSTEM,
                    what,
                    found,
                    "",
                    setting.order,
                    BANDS[setting.order],
                    "slope on the three finest steps that stand clear of the reference; the next power of "
                    "the step still shows in it",
                    "closed form",
                )
            )
    return rows


def _silent(problem: Problem, points: list[Point]) -> Row:
    """No wrong answer without a word."""
    silent = [f"{p.setting.curve} {p.setting.label()}" for p in points if p.status == "SILENT"]
    unit = _quantity(problem)[1]
    return _none_of(
        f"price.{problem.key}.silent",
        f"wrong answers without a word, of {len(points)} settings",
        silent,
        f"an error that is not finite, or beyond {problem.bound:.3g} {unit}, must come with an exception",
    )


def _counts(problem: Problem, points: list[Point]) -> Row:
    """What adapters say about steps and force calls."""
    return _none_of(
        f"price.{problem.key}.counts.said",
        "settings whose force calls are not stages times steps",
        cost.miscounted(points, problem.duration),
        "exact: stages from the methods' tableaux",
    )


def _repeat(problem: Problem, points: list[Point]) -> Row:
    """A run that is repeated counts the same and errs by the same."""
    changed = [f"{p.setting.curve} {p.setting.label()}" for p in points if p.changed]
    again = sum(p.changed is not None for p in points)
    return _none_of(
        f"price.{problem.key}.counts.repeat",
        f"settings that count or err otherwise in the last round, of {again} that have rounds",
        changed,
        "exact: all counts, and errors to the last digit",
    )


def _none_of(name: str, what: str, found: list[str], why: str) -> Row:
    """Row that passes if a list of offenders is empty, and names them if it is not."""
    named_ones = f": {', '.join(found)}" if found else ""
    return within(name, SYSTEM, what + named_ones, len(found), "settings", 0, 0, why, "closed form")


def _promises(problem: Problem, points: list[Point]) -> Row:
    """Run the winners of the table of cheapest settings: their error must be what the table promises."""
    quantity, _ = _quantity(problem)
    worst = 0.0
    for target in problem.tolerances:
        best = cost.cheapest(cost.reaches(points, quantity, target, cost.costs(points)[0]))
        if best is not None:
            found = cost.attempt(problem, _runnable(problem, points, *best))
            worst = max(worst, found.errors.get(quantity, float("inf")) / target)
    what = "error of the table's cheapest settings by their tolerance, each of them run, largest"
    return within(
        f"price.{problem.key}.cheapest",
        SYSTEM,
        what,
        worst,
        "",
        0.0,
        PROMISE,
        "interpolated between two settings tried: a quarter is how far a curve may bend between them",
        "closed form",
    )


def _runnable(problem: Problem, points: list[Point], curve: str, one: Reach) -> Setting:
    """The setting that the table names, a fixed step as the nearest one that divides the run."""
    like = cost.by_curve(points)[curve][0].setting
    value = one.value if like.adaptive else problem.duration / round(problem.duration / one.value)
    return problem.setting(like.engine, like.method, value)


def _sweep(problem: Problem, points: list[Point]) -> Row:
    """Six settings of each method, and from order 4 up four decades of them, or of error where nothing ends a curve."""
    quantity, _ = _quantity(problem)
    tried = cost.by_curve(points, None)
    short = []
    for curve, own in cost.by_curve(points).items():
        ends = own[0], own[-1]
        wide = any(a >= 1e4 * b for a, b in ([p.errors[quantity] for p in ends], [p.setting.value for p in ends]))
        ended = tried[curve][0].status != "ok" or own[0].setting.cells
        whole = ended and own[-1].errors[quantity] <= min(problem.tolerances)
        settled = len(own) > 1 and own[-1].errors[quantity] >= SETTLED * own[-2].errors[quantity]
        low = 0 < (own[0].setting.order or own[0].setting.nominal) < 4
        if len(own) < 6 or not (wide or whole or settled or low):
            short.append(curve)
    what = (
        "methods with fewer than 6 settings that answered, or from order 4 up with fewer than 4 decades of them or "
        "of error although coarser settings answer, or the finest tolerance is not met and the error still falls"
    )
    return _none_of(f"price.{problem.key}.sweep", what, short, "what the study was asked to cover")


def _losses(problem: Problem, points: list[Point]) -> list[Row]:
    """What each default loses at the middle tolerance."""
    target = cost.middle(problem.tolerances)
    return [
        row
        for owner, p in cost.defaults(points).items()
        if p.status == "ok"
        for among, words in ((p.setting.engine, f"{owner}'s own cheapest"), ("", "the cheapest of all"))
        for kind in cost.costs(points)
        for row in _loss(problem, points, owner, p, target, among, words, kind)
    ]


def _loss(
    problem: Problem, points: list[Point], owner: str, p: Point, target: float, among: str, words: str, kind: str
) -> list[Row]:
    quantity, unit = _quantity(problem)
    one = cost.loss(points, quantity, target, kind, p.setting.curve, among)
    if one is None:
        return []
    how = ", extrapolated by its order" if one.how == "extrapolated" else ""
    name = f"price.{problem.key}.default.{p.setting.engine}.{'own' if among else 'all'}.{kind}".replace(" ", "-")
    told = f"95 % interval {one.low:.3g} to {one.high:.3g}" if one.low <= one.high else "too few rounds to tell"
    bounds = told if kind == "seconds" else "exact"
    what = f"{owner}'s default, {p.setting.method}, refined to {target:g} {unit}{how}, by {words}: {kind}"
    why = f"at its default {p.setting.label()} its error is {p.errors[quantity]:.3g} {unit}"
    return [finding(name, SYSTEM, what, one.factor, "times", bounds, why, "none")]
