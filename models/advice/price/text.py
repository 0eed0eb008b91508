"""A recommendation of solver settings as text for a reader, and as JSON."""

from collections import defaultdict
from dataclasses import asdict
from typing import Any

from models.advice.price.problem import Setting
from models.advice.price.recommendation import CheapestChoices, Recommendation, SettingChoice
from models.advice.price.search import TriedSetting
from models.drawing.figures import LABELS
from models.machine.seconds import seconds_text

EQUAL_RATIO_MARGIN = 0.005
"""Distance of a cost ratio from 1 up to which it is not reported."""
TABLE_HEADING = f"  {'':<24}{'setting':<36}{'error':>11}{{counted:>16}}   time"


def recommendation_lines(recommendation: Recommendation) -> list[str]:
    """Text lines of a recommendation: the cheapest settings, the extra cost of defaults, what failed, and what to write
    into the scene.
    """
    scene = recommendation.scene
    first = (
        f"  over the first {scene.searched_duration:g} s, where all methods are tried: "
        f"{recommendation.search_truth.origin} {recommendation.search_truth.uncertainty:.1e} {scene.unit}"
    )
    doubt = (
        f"  DOUBT: {scene.quantity} is at most {recommendation.truth.size:.3g} {scene.unit} itself: "
        f"within {recommendation.tolerance:g} {scene.unit} even zero would do"
    )
    extent = getattr(scene, "extent_text", f"over {scene.full_duration:g} s")
    return [
        f"{scene.title}: {scene.quantity} within {recommendation.tolerance:g} {scene.unit} {extent}",
        f"  truth: {recommendation.truth.origin} {recommendation.truth.uncertainty:.1e} {scene.unit}",
        *([] if recommendation.searched_whole_run else [first]),
        *([f"  {scene.note}"] if scene.note else []),
        *([doubt] if recommendation.tolerance >= recommendation.truth.size else []),
        *(f"  with every setting: {assumption.line()}" for assumption in recommendation.truth.broken_assumptions),
        "",
        *(_cheapest_settings_table(recommendation) if recommendation.winners else _no_setting_lines(recommendation)),
        *_default_lines(recommendation),
        *_failure_lines(recommendation.tried),
        *_scene_file_lines(recommendation),
    ]


def _cheapest_settings_table(recommendation: Recommendation) -> list[str]:
    rows, unit = [TABLE_HEADING.format(counted=recommendation.scene.work_count_name)], recommendation.scene.unit
    for (engine, kinds), choice in _merged_winners(recommendation.winners).items():
        winner_text = f"{LABELS[engine] if engine else 'all'}, by {kinds}"
        rows.append(
            f"  {winner_text:<24}{_setting_text(choice.tried.setting, not engine):<36}{choice.error:>9.2g} {unit}"
            f"{choice.calls:>16,.0f}   {seconds_text(choice.rounds or (choice.seconds,))}"
        )
    duration_text = (
        " over the whole run"
        if recommendation.searched_whole_run or all(choice.confirmed for choice in recommendation.winners.values())
        else ""
    )
    return [
        *rows,
        f"  errors are measured{duration_text}, against the truth; times are those of this machine's processor, "
        "model built anew: median and range of interleaved runs, or of one run",
    ]


def _merged_winners(cheapest_choices: CheapestChoices) -> CheapestChoices:
    """The cheapest settings, with one row instead of two where the same setting is the cheapest by both costs."""
    rows = CheapestChoices()
    for (engine, kind), choice in cheapest_choices.items():
        if (engine, "seconds") in rows and rows[engine, "seconds"] is choice:
            rows[engine, "both"] = rows.pop((engine, "seconds"))
        else:
            rows[engine, kind] = choice
    return rows


def _no_setting_lines(recommendation: Recommendation) -> list[str]:
    able = [attempt for attempt in recommendation.tried if attempt.status == "ok"]
    if not able:
        return ["  no setting gave an answer"]
    best = min(able, key=lambda attempt: attempt.error)
    return [
        f"  no setting tried meets the tolerance; the nearest is {_setting_text(best.setting, True)} with "
        f"{best.error:.2g} {recommendation.scene.unit}"
    ]


def _setting_text(setting: Setting, with_engine: bool) -> str:
    engine = f"{LABELS[setting.engine]} " if with_engine else ""
    return f"{engine if setting.method != setting.engine else ''}{setting.method}, {setting.label()}"


def _default_lines(recommendation: Recommendation) -> list[str]:
    rows = [""]
    for engine, default in recommendation.defaults.items():
        tried = default.as_it_is
        error_bound = max(tried.error, recommendation.search_truth.uncertainty)
        error = f"{'' if error_bound == tried.error else 'below '}{error_bound:.2g} {recommendation.scene.unit}"
        duration_text = (
            "" if recommendation.searched_whole_run else f" over {recommendation.scene.searched_duration:g} s"
        )
        as_it_is = f"{error}{duration_text}" if tried.status == "ok" else tried.status
        lost = _cost_of_default_text(recommendation, engine, default.refined, default.extrapolated)
        rows.append(f"  {LABELS[engine]}'s default, {_setting_text(tried.setting, False)}: {as_it_is}{lost}")
    return rows if recommendation.defaults else []


def _cost_of_default_text(
    recommendation: Recommendation, engine: str, refined_choice: SettingChoice | None, is_extrapolated: bool
) -> str:
    """Text on the cost of the refined default method, as a ratio to the engine's cheapest setting and to the cheapest
    of all.
    """
    if refined_choice is None:
        return "; no step that was tried holds the tolerance over the whole run"
    parts = [
        f"{ratio:.3g} times the {kind} of {whose}"
        for whose, key in ((f"{LABELS[engine]}'s cheapest", engine), ("the cheapest of all", ""))
        for kind in ("calls", "seconds")
        if (best := recommendation.winners.get((key, kind))) is not None
        and abs((ratio := getattr(refined_choice, kind) / max(getattr(best, kind), 1e-12)) - 1.0) > EQUAL_RATIO_MARGIN
    ]
    met = (
        f"within the tolerance at {refined_choice.tried.setting.label()}{' (extrapolated)' if is_extrapolated else ''}"
    )
    return f"; {met}: {', '.join(parts) or 'nothing is cheaper'}"


def _failure_lines(tried_settings: tuple[TriedSetting, ...]) -> list[str]:
    """Text lines on settings without a valid result, by method, with the reason of the last one that was tried."""
    known = defaultdict[tuple[str, str], list[TriedSetting]](list)
    for attempt in tried_settings:
        if attempt.status != "ok":
            known[attempt.status, f"{LABELS[attempt.setting.engine]} {attempt.setting.method}"].append(attempt)
    if not known:
        return []
    return [
        "",
        "  without an answer to rely on",
        *(
            f"    {status:<9}{method}, {', '.join(dict.fromkeys(attempt.setting.label() for attempt in attempts))}: "
            f"{attempts[-1].reason}"
            for (status, method), attempts in known.items()
        ),
    ]


def _scene_file_lines(recommendation: Recommendation) -> list[str]:
    """Text lines on how to select the recommended setting: the lines of a scene file."""
    best = recommendation.winners.get(("", "seconds"))
    if best is None:
        return []
    head = getattr(recommendation.scene, "where", "in the scene")
    return ["", f"  {head}", *(f"    {line}" for line in recommendation.scene.scene_file_lines(best.tried.setting))]


def as_dict(recommendation: Recommendation) -> dict[str, Any]:
    """The recommendation of settings as plain values for JSON."""
    scene = recommendation.scene
    return {
        "scene": scene.title,
        "quantity": scene.quantity,
        "unit": scene.unit,
        "tolerance": recommendation.tolerance,
        "duration": scene.full_duration,
        "truth": recommendation.truth.origin,
        "uncertainty": recommendation.truth.uncertainty,
        "broken assumptions": [asdict(entry) for entry in recommendation.truth.broken_assumptions],
        "cheapest": [
            {"engine": engine or "all", "by": kind, **_choice_as_json(entry)}
            for (engine, kind), entry in recommendation.winners.items()
        ],
        "defaults": {
            engine: {
                "as it is": _tried_as_json(entry.as_it_is),
                "extrapolated": entry.extrapolated,
                "refined": None if entry.refined is None else _choice_as_json(entry.refined),
            }
            for engine, entry in recommendation.defaults.items()
        },
        "tried": [_tried_as_json(entry) for entry in recommendation.tried],
    }


def _choice_as_json(choice: SettingChoice) -> dict[str, Any]:
    return {**_tried_as_json(choice.tried), "error": choice.error, "calls": choice.calls, "seconds": choice.seconds}


def _tried_as_json(tried_setting: TriedSetting) -> dict[str, Any]:
    setting = {name: getattr(tried_setting.setting, name) for name in ("engine", "method", "value")}
    outcome = {name: getattr(tried_setting, name) for name in ("status", "reason", "error", "seconds")}
    return {**setting, **outcome, "error": tried_setting.error if tried_setting.status == "ok" else None}
