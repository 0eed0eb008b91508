"""A recommendation as a person reads it, and as JSON."""

from collections import defaultdict
from dataclasses import asdict
from typing import Any

from models.advice.price.problem import Setting
from models.advice.price.recommendation import Choice, Recommendation, Winners
from models.advice.price.search import Tried
from models.drawing.figures import LABELS
from models.machine.seconds import cost

SAME = 0.005
"""Ratios so near to one are not worth a word."""
HEAD = f"  {'':<24}{'setting':<36}{'error':>11}{{counted:>16}}   time"


def lines(found: Recommendation) -> list[str]:
    """The table of cheapest settings, what the defaults lose, what failed, and what to write into the scene."""
    own = found.scene
    first = (
        f"  over the first {own.first:g} s, where all methods are tried: {found.searched.how} "
        f"{found.searched.uncertainty:.1e} {own.unit}"
    )
    doubt = (
        f"  DOUBT: {own.quantity} is at most {found.truth.size:.3g} {own.unit} itself: within {found.tolerance:g} "
        f"{own.unit} even zero would do"
    )
    return [
        f"{own.title}: {own.quantity} within {found.tolerance:g} {own.unit} over {own.whole:g} s",
        f"  truth: {found.truth.how} {found.truth.uncertainty:.1e} {own.unit}",
        *([] if found.whole else [first]),
        *([f"  {own.note}"] if own.note else []),
        *([doubt] if found.tolerance >= found.truth.size else []),
        *(f"  with every setting: {one.line()}" for one in found.truth.broken),
        "",
        *(_table(found) if found.winners else _none(found)),
        *_defaults(found),
        *_failures(found.tried),
        *_into_the_scene(found),
    ]


def _table(found: Recommendation) -> list[str]:
    rows, unit = [HEAD.format(counted=found.scene.counted)], found.scene.unit
    for (engine, kinds), one in _merged(found.winners).items():
        who = f"{LABELS[engine] if engine else 'all'}, by {kinds}"
        rows.append(
            f"  {who:<24}{_named(one.tried.setting, not engine):<36}{one.error:>9.2g} {unit}"
            f"{one.calls:>16,.0f}   {cost(one.rounds or (one.seconds,))}"
        )
    over = " over the whole run" if found.whole or all(one.confirmed for one in found.winners.values()) else ""
    return [
        *rows,
        f"  errors are measured{over}, against the truth; times are those of this machine's processor, model built "
        "anew: median and range of interleaved runs, or of one run",
    ]


def _merged(winners: Winners) -> Winners:
    """One row where the same setting is the cheapest by both costs."""
    rows = Winners()
    for (engine, kind), one in winners.items():
        if (engine, "seconds") in rows and rows[engine, "seconds"] is one:
            rows[engine, "both"] = rows.pop((engine, "seconds"))
        else:
            rows[engine, kind] = one
    return rows


def _none(found: Recommendation) -> list[str]:
    able = [one for one in found.tried if one.status == "ok"]
    if not able:
        return ["  no setting gave an answer"]
    best = min(able, key=lambda one: one.error)
    return [
        f"  no setting tried meets the tolerance; the nearest is {_named(best.setting, True)} with "
        f"{best.error:.2g} {found.scene.unit}"
    ]


def _named(setting: Setting, whole: bool) -> str:
    engine = f"{LABELS[setting.engine]} " if whole else ""
    return f"{engine if setting.method != setting.engine else ''}{setting.method}, {setting.label()}"


def _defaults(found: Recommendation) -> list[str]:
    rows = [""]
    for engine, one in found.defaults.items():
        tried = one.as_it_is
        known = max(tried.error, found.searched.uncertainty)
        error = f"{'' if known == tried.error else 'below '}{known:.2g} {found.scene.unit}"
        over = "" if found.whole else f" over {found.scene.first:g} s"
        as_it_is = f"{error}{over}" if tried.status == "ok" else tried.status
        lost = _lost(found, engine, one.refined, one.extrapolated)
        rows.append(f"  {LABELS[engine]}'s default, {_named(tried.setting, False)}: {as_it_is}{lost}")
    return rows if found.defaults else []


def _lost(found: Recommendation, engine: str, refined: Choice | None, extrapolated: bool) -> str:
    """What the default method costs beside the engine's cheapest and the cheapest of all, once refined."""
    if refined is None:
        return "; no step tried gives an answer"
    parts = [
        f"{ratio:.3g} times the {kind} of {whose}"
        for whose, key in ((f"{LABELS[engine]}'s cheapest", engine), ("the cheapest of all", ""))
        for kind in ("calls", "seconds")
        if (best := found.winners.get((key, kind))) is not None
        and abs((ratio := getattr(refined, kind) / max(getattr(best, kind), 1e-12)) - 1.0) > SAME
    ]
    met = f"within the tolerance at {refined.tried.setting.label()}{' (extrapolated)' if extrapolated else ''}"
    return f"; {met}: {', '.join(parts) or 'nothing is cheaper'}"


def _failures(tried: tuple[Tried, ...]) -> list[str]:
    """Settings without an answer, by method, with the reason of the last one that was tried."""
    known = defaultdict[tuple[str, str], list[Tried]](list)
    for one in tried:
        if one.status != "ok":
            known[one.status, f"{LABELS[one.setting.engine]} {one.setting.method}"].append(one)
    if not known:
        return []
    return [
        "",
        "  without an answer to rely on",
        *(
            f"    {status:<9}{method}, {', '.join(dict.fromkeys(one.setting.label() for one in own))}: {own[-1].reason}"
            for (status, method), own in known.items()
        ),
    ]


def _into_the_scene(found: Recommendation) -> list[str]:
    """What to write into the scene to have the recommended setting."""
    best = found.winners.get(("", "seconds"))
    if best is None:
        return []
    return ["", "  in the scene", *(f"    {line}" for line in found.scene.lines(best.tried.setting))]


def as_dict(found: Recommendation) -> dict[str, Any]:
    """All of it as JSON keeps it."""
    own = found.scene
    return {
        "scene": own.title,
        "quantity": own.quantity,
        "unit": own.unit,
        "tolerance": found.tolerance,
        "duration": own.whole,
        "truth": found.truth.how,
        "uncertainty": found.truth.uncertainty,
        "broken assumptions": [asdict(one) for one in found.truth.broken],
        "cheapest": [
            {"engine": engine or "all", "by": kind, **_choice(one)} for (engine, kind), one in found.winners.items()
        ],
        "defaults": {
            engine: {
                "as it is": _tried(one.as_it_is),
                "extrapolated": one.extrapolated,
                "refined": None if one.refined is None else _choice(one.refined),
            }
            for engine, one in found.defaults.items()
        },
        "tried": [_tried(one) for one in found.tried],
    }


def _choice(one: Choice) -> dict[str, Any]:
    return {**_tried(one.tried), "error": one.error, "calls": one.calls, "seconds": one.seconds}


def _tried(one: Tried) -> dict[str, Any]:
    setting = {name: getattr(one.setting, name) for name in ("engine", "method", "value")}
    told = {name: getattr(one, name) for name in ("status", "reason", "error", "seconds")}
    return {**setting, **told, "error": one.error if one.status == "ok" else None}
