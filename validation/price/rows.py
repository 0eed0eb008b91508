"""Rows of the report that judge every work-precision problem."""

from models.advice.price.curves import ToleranceCost
from models.advice.price.problem import Setting, WorkPrecisionProblem
from models.advice.price.runner import WorkPrecisionPoint, WorkPrecisionPoints, attempt, cheapest_curve
from validation.common.rows import Observed, Row, System
from validation.price.tables import curve_name

SYSTEM: System = "cost"
ORDER_TOLERANCE = {1: 0.1, 2: 0.1, 3: 0.2, 4: 0.2, 6: 0.5}
"""Allowed difference of the observed from the declared order, by order: at these steps the next power still shows,
the more the higher the order (RK4 between 1 and 0.25 ms: 4.17)."""
REFERENCE_SHARE = 1e-4
"""Largest uncertainty of a reference divided by the finest tolerance, for problems without ``uncertain_share``."""
SETTLED_ERROR_RATIO = 0.9
"""Ratio of a curve's last error to the one before from which it no longer falls: it has reached the theory's error."""
INTERPOLATION_FACTOR = 1.25
"""Allowed error of an interpolated cheapest setting divided by the tolerance: curves bend between two settings."""


def rows_of(priced_problem: WorkPrecisionProblem, measured_points: WorkPrecisionPoints, is_quick: bool) -> list[Row]:
    """All rows of one work-precision problem; the row on the number of tried settings is part of the full report
    only."""
    points, repeated = measured_points.points, [p for p in measured_points.points if p.changed is not None]
    return [
        _reference_row(priced_problem, measured_points),
        *_order_rows(measured_points),
        _offenders_row(
            f"price.{priced_problem.key}.silent",
            f"wrong answers without a word, of {len(points)} settings",
            [_setting_text(p) for p in points if p.status == "SILENT"],
            f"an error that is not finite, or beyond {priced_problem.bound:.3g} {measured_points.unit}, "
            "must come with an exception",
        ),
        _offenders_row(
            f"price.{priced_problem.key}.counts.said",
            "settings whose force calls are not stages times steps",
            measured_points.miscounted_methods(),
            "exact: stages from the methods' tableaux",
        ),
        _offenders_row(
            f"price.{priced_problem.key}.counts.repeat",
            f"settings that count or err otherwise in the last round, of {len(repeated)} that have rounds",
            [_setting_text(p) for p in repeated if p.changed],
            "exact: all counts, and errors to the last digit",
        ),
        _cheapest_settings_row(priced_problem, measured_points),
        *([] if is_quick else [_sweep_row(measured_points)]),
        *_loss_rows(measured_points),
    ]


def _setting_text(measured_point: WorkPrecisionPoint) -> str:
    return f"{measured_point.setting.curve} {measured_point.setting.label()}"


def _offenders_row(row_id: str, offence_text: str, offending_settings: list[str], tolerance_reason: str) -> Row:
    """Row that passes if the list of offending settings is empty; otherwise it names them."""
    offenders = f": {', '.join(offending_settings)}" if offending_settings else ""
    return Observed(row_id, SYSTEM, offence_text + offenders, len(offending_settings), "settings").within(
        0, 0, tolerance_reason, "closed form"
    )


def _reference_row(priced_problem: WorkPrecisionProblem, measured_points: WorkPrecisionPoints) -> Row:
    """Row: uncertainty of the reference solution, compared with a share of the finest tolerance."""
    quantity, share = measured_points.quantity, getattr(priced_problem, "uncertain_share", REFERENCE_SHARE)
    return Observed(
        f"price.{priced_problem.key}.reference",
        SYSTEM,
        f"uncertainty of the reference ({priced_problem.reference}) in the {quantity}",
        priced_problem.uncertainty[quantity],
        measured_points.unit,
    ).at_most(
        share * min(priced_problem.tolerances),
        "what the reference states of itself or solvers of different "
        f"families differ by; {share:g} of the finest tolerance, so that curves stand clear",
        "closed form",
    )


def _order_rows(measured_points: WorkPrecisionPoints) -> list[Row]:
    """Rows: observed order of every fixed-step method with a declared order, for each quantity."""
    settings = {p.setting.curve: p.setting for p in measured_points.points}
    return [
        Observed(
            f"price.{measured_points.key}.order.{quantity}.{curve}".replace(" ", "-"),
            SYSTEM,
            f"observed order of the largest error of the {quantity}, {curve_name(curve)}",
            order,
            "",
        ).within(
            setting.order,
            ORDER_TOLERANCE[setting.order],
            "slope on the three finest steps that stand clear of the reference; the next power of "
            "the step still shows in it",
            "closed form",
        )
        for quantity in measured_points.units
        for curve, order in measured_points.observed_orders(quantity).items()
        if (setting := settings[curve]).order and not setting.adaptive
    ]


def _cheapest_settings_row(problem: WorkPrecisionProblem, measured_points: WorkPrecisionPoints) -> Row:
    """Row: largest ratio of error to tolerance of the settings in the table of cheapest settings, which are run for
    it."""
    worst = 0.0
    for target in problem.tolerances:
        best = cheapest_curve(measured_points.costs_at_tolerance(target, measured_points.cost_kinds[0]))
        if best is not None:
            point = attempt(problem, _runnable_setting(problem, measured_points, *best))
            worst = max(worst, point.errors.get(measured_points.quantity, float("inf")) / target)
    return Observed(
        f"price.{problem.key}.cheapest",
        SYSTEM,
        "largest ratio of the error of a recommended cheapest setting to its tolerance, each of them run",
        worst,
        "",
    ).within(
        0.0,
        INTERPOLATION_FACTOR,
        "interpolated between two settings tried: a quarter is how far a curve may bend between them",
        "closed form",
    )


def _runnable_setting(
    problem: WorkPrecisionProblem, measured_points: WorkPrecisionPoints, curve_name: str, cheapest_reach: ToleranceCost
) -> Setting:
    """The setting of a curve that the table of cheapest settings names; a fixed step is changed to the nearest one that
    divides the run."""
    like = measured_points.curves()[curve_name][0].setting
    value = cheapest_reach.value if like.adaptive else problem.duration / round(problem.duration / cheapest_reach.value)
    return problem.setting(like.engine, like.method, value)


def _sweep_row(measured_points: WorkPrecisionPoints) -> Row:
    """Row: methods that were tried with too few settings. At least six are required; from order 4 up they must span
    four decades of the setting or the error, unless the curve ends at a failure or at its smallest error."""
    tried, short = measured_points.curves(None), []
    for curve, points in measured_points.curves().items():
        errors, setting = list(map(measured_points.error, points)), points[0].setting
        wide = errors[0] >= 1e4 * errors[-1] or setting.value >= 1e4 * points[-1].setting.value
        ended = tried[curve][0].status != "ok" or setting.cells
        reaches_tolerance = ended and errors[-1] <= min(measured_points.tolerances)
        settled = len(points) > 1 and errors[-1] >= SETTLED_ERROR_RATIO * errors[-2]
        low = 0 < (setting.order or setting.nominal) < 4
        if len(points) < 6 or not (wide or reaches_tolerance or settled or low):
            short.append(curve)
    requirement = (
        "methods with fewer than 6 settings that answered, or from order 4 up with fewer than 4 decades of them or "
        "of error although coarser settings answer, or the finest tolerance is not met and the error still falls"
    )
    return _offenders_row(f"price.{measured_points.key}.sweep", requirement, short, "what the study was asked to cover")


def _loss_rows(measured_points: WorkPrecisionPoints) -> list[Row]:
    """Rows: cost of each engine's default method divided by the cost of the cheapest setting, at the middle
    tolerance."""
    return [
        row
        for owner, p in measured_points.defaults.items()
        if p.status == "ok"
        for engine_filter, words in ((p.setting.engine, f"{owner}'s own cheapest"), ("", "the cheapest of all"))
        for kind in measured_points.cost_kinds
        for row in _rows_of_loss(measured_points, owner, engine_filter, words, kind)
    ]


def _rows_of_loss(
    measured_points: WorkPrecisionPoints, owner_of_default: str, engine: str, loss_words: str, cost_kind: str
) -> list[Row]:
    target, unit, p = measured_points.middle_tolerance, measured_points.unit, measured_points.defaults[owner_of_default]
    lost = measured_points.loss_by_default(target, cost_kind, p.setting.curve, engine)
    if lost is None:
        return []
    extrapolation_text = ", extrapolated by its order" if lost.origin == "extrapolated" else ""
    shared = [default.setting.engine for default in measured_points.defaults.values()].count(p.setting.engine) > 1
    whose = f"{p.setting.engine}.{owner_of_default}" if shared else p.setting.engine
    name = f"price.{measured_points.key}.default.{whose}.{'own' if engine else 'all'}.{cost_kind}".replace(" ", "-")
    interval_text = (
        f"95 % interval {lost.lower_limit:.3g} to {lost.upper_limit:.3g}"
        if lost.lower_limit <= lost.upper_limit
        else "too few rounds to tell"
    )
    bounds = interval_text if cost_kind == "seconds" else "exact"
    quantity = (
        f"ratio of {cost_kind}: {owner_of_default}'s default, {p.setting.method}, refined to {target:g} "
        f"{unit}{extrapolation_text}, to {loss_words}"
    )
    why = f"at its default {p.setting.label()} its error is {measured_points.error(p):.3g} {unit}"
    return [Observed(name, SYSTEM, quantity, lost.cost_ratio, "times").beside(bounds, why, "none")]
