"""Tables of a work-precision measurement: cheapest settings, loss by defaults, all curves, and failed settings."""

import math
from collections import Counter, defaultdict
from dataclasses import replace

import numpy as np

from models.advice.price import runner
from models.advice.price.curves import RESOLVED_ERROR_FACTOR, ToleranceCost
from models.advice.price.runner import CostsAtTolerance, LossByDefault, WorkPrecisionPoint, WorkPrecisionPoints
from models.drawing.figures import LABELS
from models.machine.timing import timing_statistics
from validation.common.rows import Table

STATUS_WORDS = {"ok": "fine", "raised": "raised", "refused": "refused", "flagged": "flagged", "SILENT": "silent"}


def tables(measured_points: WorkPrecisionPoints) -> list[Table]:
    """All tables of one work-precision problem, from its measured points."""
    return [make(measured_points) for make in (cheapest_table, loss_table, curve_table, outcome_table, failure_table)]


def curve_name(curve: str, coinciding_curves: list[tuple[str, ...]] | None = None) -> str:
    """Name of a curve for readers, followed by the names of the curves in ``coinciding_curves`` that coincide with
    it."""
    coinciding = next((group for group in coinciding_curves or [] if curve in group), (curve,))
    return " = ".join(map(_plain_name, sorted(coinciding, key=lambda curve_key: curve_key != curve)))


def _plain_name(curve: str) -> str:
    engine, _, method = curve.partition(" ")
    return f"{LABELS[engine]} {method}"


def cheapest_table(measured_points: WorkPrecisionPoints) -> Table:
    """Table of the cheapest settings for each tolerance."""
    work, groups = measured_points.cost_kinds[0], measured_points.coinciding_curves()
    rivals = [
        engine for engine in runner.COMPARED_ENGINES if any(p.setting.engine == engine for p in measured_points.points)
    ]
    rows = []
    for target in measured_points.tolerances:
        calls, seconds = (measured_points.costs_at_tolerance(target, kind) for kind in measured_points.cost_kinds)
        timed = (_text_of_winner(measured_points, seconds, engine_filter, "ms") for engine_filter in ("", *rivals))
        rows.append((f"{target:g}", _text_of_winner(measured_points, calls, "", work.split()[-1], groups), *timed))
    note = (
        "Fixed steps are interpolated log-log between neighbouring settings; methods without one order count at "
        "the loosest setting tried that does; 'coarsest' is the coarsest setting tried. Nothing is extrapolated. "
        f"{work.capitalize()} are exact and the same on every machine; seconds are those of this processor, "
        f"everything built anew. {rounds_sentence(measured_points.points)}"
    )
    heads = (
        f"{measured_points.quantity} error at most [{measured_points.unit}]",
        f"fewest {work}",
        "fewest seconds",
        *(f"fewest in {LABELS[engine]}" for engine in rivals),
    )
    return Table("Cheapest setting that meets the tolerance", note, heads, tuple(rows))


def rounds_sentence(timed_points: list[WorkPrecisionPoint]) -> str:
    """Sentence on how many settings were timed in how many rounds, and how much the times scatter."""
    answered = [p for p in timed_points if p.status == "ok"]
    in_rounds = [p.seconds for p in answered if p.changed is not None]
    numbers = Counter(map(len, in_rounds))
    rounds_text = " and ".join(
        f"{n} interleaved rounds for {count}" for n, count in sorted(numbers.items(), reverse=True)
    )
    if not in_rounds:
        return "Seconds are those of one run each."
    spread = float(
        np.median([statistics["mad"] / statistics["median"] for statistics in map(timing_statistics, in_rounds)])
    )
    return (
        f"Seconds are medians of {rounds_text} settings whose seconds decide something (fewer where a run is "
        "longer than "
        f"{1e3 * runner.SLOW_RUN_DURATION:g} ms; median absolute deviation {100 * spread:.0f} %), and of one run for "
        f"{len(answered) - len(in_rounds)} that "
        f"are far from the cheapest, or longer than {1e3 * runner.LONG_RUN_DURATION:g} ms and not for the middle "
        "tolerance."
    )


def _text_of_winner(
    measured_points: WorkPrecisionPoints,
    costs_at_tolerance: CostsAtTolerance,
    engine: str,
    cost_unit: str,
    coinciding_curves: list[tuple[str, ...]] | None = None,
) -> str:
    best = runner.cheapest_curve(costs_at_tolerance, engine)
    if best is None:
        return "none of those tried"
    curve, cheapest = best
    label = replace(measured_points.curves()[curve][0].setting, value=cheapest.value).label() + _coarsest_text(cheapest)
    paid = f"{1e3 * cheapest.cost:.3g} ms" if cost_unit == "ms" else f"{cheapest.cost:,.0f} {cost_unit}"
    return f"{curve_name(curve, coinciding_curves)}, {label}: {paid}"


def _coarsest_text(cheapest_reach: ToleranceCost) -> str:
    return " (coarsest)" if cheapest_reach.origin == "coarsest" else ""


def loss_table(measured_points: WorkPrecisionPoints) -> Table:
    """Table of the cost of each engine's default method divided by the cost of the cheapest setting with the same
    error."""
    owners = measured_points.defaults
    rows = tuple(
        (
            f"{target:g}",
            *(
                _text_of_loss(measured_points.loss_by_default(target, kind, usual.setting.curve, engine_filter))
                for usual in owners.values()
                for engine_filter in (usual.setting.engine, "")
                for kind in measured_points.cost_kinds
            ),
        )
        for target in measured_points.tolerances
    )
    heads = (
        f"{owner} by best of {engine_filter}: {kind}"
        for owner in owners
        for engine_filter in (owner, "all")
        for kind in measured_points.cost_kinds
    )
    as_is = "; ".join(
        f"{owner}: {usual.setting.method} at {usual.setting.label()}, which by itself "
        + (
            f"gives {measured_points.error(usual):.3g} {measured_points.unit}"
            if usual.status == "ok"
            else f"is {STATUS_WORDS[usual.status]}"
        )
        for owner, usual in owners.items()
    )
    note = (
        "The default method, its step refined until it meets the tolerance, by the cheapest setting that does. "
        f"{as_is}. * means that no step tried was fine enough: extrapolated by the method's declared order. "
        "In brackets: 95 % interval, bootstrapped over the rounds that both have; none after fewer than "
        f"{runner.FEWEST_TIMING_ROUNDS}."
    )
    return Table(
        "Factor that a default setting loses", note, (f"{measured_points.quantity} error at most", *heads), rows
    )


def _text_of_loss(loss_of_default: LossByDefault | None) -> str:
    if loss_of_default is None:
        return "-"
    factor, low, high = (
        f"{x:,.0f}" if x >= 100 else f"{x:.3g}"
        for x in (loss_of_default.cost_ratio, loss_of_default.lower_limit, loss_of_default.upper_limit)
    )
    mark = "*" if loss_of_default.origin == "extrapolated" else ""
    interval_text = (
        (f" [{low}, {high}]") if loss_of_default.lower_limit < loss_of_default.upper_limit else ""
    )  # none of a count, or after too few rounds
    return f"{factor}{mark}{interval_text}"


def curve_table(measured_points: WorkPrecisionPoints) -> Table:
    """Table with a row per curve: settings, errors, observed order, and cost at the middle tolerance."""
    groups, orders, work = (
        measured_points.coinciding_curves(),
        measured_points.observed_orders(measured_points.quantity),
        measured_points.cost_kinds[0],
    )
    calls, seconds = (
        measured_points.costs_at_tolerance(measured_points.middle_tolerance, kind)
        for kind in measured_points.cost_kinds
    )
    rows = tuple(
        (
            _plain_name(curve),
            str(len(points)),
            f"{points[0].setting.label()} to {points[-1].setting.label()}",
            f"{measured_points.error(points[0]):.2g} to {measured_points.error(points[-1]):.2g}",
            "-" if math.isnan(orders[curve]) else f"{orders[curve]:.2f}",
            str(points[0].setting.order or "varies"),
            _cost_text(calls.get(curve), 1, ",.0f"),
            _mark_of_single_runs(points, seconds.get(curve)) + _cost_text(seconds.get(curve), 1e3, ".3g"),
            curve_name(curve, groups).partition(" = ")[2] or "-",
        )
        for curve, points in measured_points.curves().items()
    )
    note = (
        "Order: slope of the error over the step on the three finest settings whose error exceeds "
        f"{RESOLVED_ERROR_FACTOR:g} "
        "times the uncertainty of the reference; for adaptive methods over 1 / calls, where loose tolerances "
        "are still ruled by stability. Curves coincide if their errors agree to 1 % at every common "
        "setting. ~: seconds of one run."
    )
    heads = (
        "curve",
        "settings",
        "from, to",
        f"{measured_points.quantity} error [{measured_points.unit}]",
        "observed order",
        "declared",
        f"{work} for {measured_points.middle_tolerance:g} {measured_points.unit}",
        f"ms for {measured_points.middle_tolerance:g} {measured_points.unit}",
        "coincides with",
    )
    return Table("Every integrator that each engine offers", note, heads, rows)


def _mark_of_single_runs(curve_points: list[WorkPrecisionPoint], cheapest_reach: ToleranceCost | None) -> str:
    """Text "~" if an interpolated cost depends on a setting that was timed only once, else ""."""
    return (
        "~"
        if cheapest_reach is not None
        and any(p.changed is None for p in runner.bracketing_points(curve_points, cheapest_reach))
        else ""
    )


def _cost_text(cheapest_reach: ToleranceCost | None, unit_scale: float, number_format: str) -> str:
    return (
        "not met"
        if cheapest_reach is None
        else format(unit_scale * cheapest_reach.cost, number_format) + _coarsest_text(cheapest_reach)
    )


def outcome_table(measured_points: WorkPrecisionPoints) -> Table:
    """Table of the number of settings of each engine by status."""
    ended = Counter((p.setting.engine, status) for p in measured_points.points for status in ("", p.status))
    engines = dict.fromkeys(p.setting.engine for p in measured_points.points)
    rows = tuple(
        (LABELS[engine], *(str(ended[engine, status]) for status in ("", *STATUS_WORDS))) for engine in engines
    )
    note = (
        "Fine: an answer; raised: the run failed and said so; refused: not run, with the reason; flagged: "
        "an answer came with a doubt; silent: a wrong answer that came back as a result, of which there must be "
        "none."
    )
    return Table("Settings by how they ended", note, ("engine", "settings", *STATUS_WORDS.values()), rows)


def failure_table(measured_points: WorkPrecisionPoints) -> Table:
    """Table of the settings without a reliable result, with their messages."""
    labels_of = defaultdict(list)
    for p in measured_points.points:
        if p.status != "ok":
            labels_of[_plain_name(p.setting.curve), STATUS_WORDS[p.status], p.reason].append(p.setting.label())
    rows = tuple((curve, ", ".join(labels), status, reason) for (curve, status, reason), labels in labels_of.items())
    return Table(
        "Settings that gave no answer to rely on",
        "What was said, by how the setting ended.",
        ("curve", "setting", "status", "what was said"),
        rows,
    )
