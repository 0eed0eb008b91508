"""Which effects of a scene its quantities need within a tolerance: chosen by runs, and confirmed; for any system."""

import csv
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.advice.choice.choose import (
    CONFIRMATION_LIMIT,
    PAIRS_COMPUTED_IN_ADVANCE,
    SEARCH_BUDGET_IN_RUNS,
    TOLERANCE_SHARE_OF_PREDICTION,
    EffectChoice,
    EffectChooser,
)
from models.advice.choice.variants import Variants, module_of_system
from models.core.errors import InputError
from models.core.result import Result
from models.core.strict import Strict, read
from models.ensemble.workers import Crew, folders_for_workers
from studies.command.asked import ANY_SYSTEM, load_scene, plan_module_of

SYSTEM = ANY_SYSTEM
ACTIVE_SHARE, BLIND_CHANGE = 0.1, 1e-3
"""Share of the energy activity above which an element is active; relative change below which a quantity ignores it."""
LOWEST_CHANGE, HIGHEST_CHANGE = 1e-3, 1e3
"""Ends of the axis of changes (per cent); smaller or larger changes are drawn at the ends."""
DRAWN_ELEMENT_LIMIT = 8
"""Largest number of elements whose energy activity is drawn, the most active first."""
ReportProgress = Callable[[str, float], None]


class Options(Strict):
    """Keys of the table [options] of this study."""

    beside: list[str] = Field(default_factory=list, description="other scenes, drawn beside this one")


@dataclass(frozen=True)
class SingleEffect:
    """A single effect of a scene. predicted_changes (quantities,) : predicted relative changes if only this effect is
    left out, inf if it cannot be; work_ratio : work of the complete scene, at the steps that accuracy allows, divided
    by the work without the effect at the longest step then allowed."""

    effect: str
    predicted_changes: np.ndarray
    work_ratio: float


@dataclass(frozen=True)
class SceneEffectChoice:
    """The choice of effects for a scene, and the changes by each single effect. further_tolerances : tolerance above
    which a staying effect would be left out, too; activity_of_element : energy activity (W) by element, if it has a
    closed form. results: runs of the reduced scene, with their errors."""

    scene: Any
    engine: str
    choice: EffectChoice
    single_effects: list[SingleEffect]
    further_tolerances: dict[str, float]
    activity_of_element: dict[str, float]
    results: list[Result] = field(default_factory=list)

    @property
    def staying_effects(self) -> list[str]:
        """Names of the effects that were not left out."""
        return [name for name in self.choice.candidates if name not in self.choice.left_out]


def check(scene: Any, engines: tuple[str, ...]) -> None:
    """Raise InputError for further scenes of the option "beside" that ask for no choice of effects."""
    module_of_system(scene)
    for name in read(Options, scene.options, scene.file, "options").beside:
        other_scene = load_scene(name, None)
        if other_scene.tolerance is None:
            raise InputError(scene.file, "options.beside", name, 'asks for no choice: it has no effects = "auto"')


def run(scene: Any, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Choose the effects of the scene and of further scenes; saves a CSV table for each scene, and a figure."""
    check(scene, engines)
    further_scenes = [load_scene(name, None) for name in scene.options.get("beside", [])]
    return save_choices([scene, *further_scenes], engines, output_folder, report_progress)


def save_choices(
    scenes: list[Any], engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Choose, save and draw the effects of scenes, the first in one of ``engines``; returns the summary."""
    scene, choices = scenes[0], list[SceneEffectChoice]()
    for i, chosen_scene in enumerate(scenes):
        report_progress(chosen_scene.title, i / len(scenes))
        linear, engines_asked = has_closed_form(chosen_scene), engines if chosen_scene is scene else ()
        plan_module_of(chosen_scene).check(
            chosen_scene, () if linear else (engine_for_choice(chosen_scene, engines_asked),)
        )
        report_share = partial(
            _report_scene_progress,
            report_progress,
            f"{chosen_scene.title}, of at most {SEARCH_BUDGET_IN_RUNS} runs",
            i,
            len(scenes),
        )
        choices.append(
            _linear_ride_choice(chosen_scene) if linear else choice_of_scene(chosen_scene, engines_asked, report_share)
        )
        _save_effect_table(choices[-1], output_folder / f"{i + 1}_{chosen_scene.system.replace('-', '_')}.csv")
    report_progress("figure", 1.0)
    choice_figure(choices, output_folder / "choice.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "answer": [_summary_of_choice(choice) for choice in choices],
        "table": [line for choice in choices for line in choice_lines(choice, len(choices) > 1)],
        "results": _results_by_name(choices),
    }


def _results_by_name(scene_choices: list[SceneEffectChoice]) -> dict[str, Result]:
    """Results of the reduced scenes of all choices, by a name of the system (if there are several) and the run's
    number."""
    return {
        " ".join(
            (
                *([choice.scene.system] if scene_choices[1:] else []),
                f"what is left{f', run {i + 1}' if choice.results[1:] else ''}",
            )
        ): run
        for choice in scene_choices
        for i, run in enumerate(choice.results)
    }


def _report_scene_progress(
    report_progress: ReportProgress, scene_title: str, completed_scenes: int, scene_count: int, finished_share: float
) -> None:
    """Report progress over several scenes: ``completed_scenes`` scenes are done, and ``finished_share`` of the search
    of the current scene."""
    report_progress(scene_title, (completed_scenes + finished_share) / scene_count)


def has_closed_form(scene: Any) -> bool:
    """Whether the choice of a scene's effects has a closed form, without runs in time: a linear stationary ride."""
    if scene.system != "ride":
        return False
    from models.systems.ride.of_scene import needs_run_in_time

    return not needs_run_in_time(scene)


def engine_for_choice(scene: Any, engines: tuple[str, ...]) -> str:
    """Engine for the choice: the system's usual engine if it is requested or none is; else the first requested
    engine."""
    usual: str = module_of_system(scene).DEFAULT_ENGINE
    return usual if not engines or usual in engines else engines[0]


def search_effort_text(scene: Any) -> str:
    """Line for the screen on the number of runs that the search for a scene's choice of effects may take."""
    if has_closed_form(scene):
        from models.advice.ride_choice.estimate import estimate

        takes = estimate(scene)
        return (
            f"  choice     by a closed form, without runs in time: among {takes.effects} effects, "
            f"{takes.states} states and {takes.speeds} speeds, about {takes.seconds:.1g} s of the processor "
            "to a factor of two"
        )
    runs = Variants(scene, engine_for_choice(scene, ()))
    return (
        f"  choice     among {len(runs.effects)} effects; the search ends at the calls of {SEARCH_BUDGET_IN_RUNS} "
        f"runs of the scene, of {runs.system.step_count(runs.scene):,} steps each, and confirms "
        f"{CONFIRMATION_LIMIT} sets at most"
    )


def choice_of_scene(
    scene: Any, engines: tuple[str, ...], report_progress: Callable[[float], None] = lambda share: None
) -> SceneEffectChoice:
    """The choice of effects for a scene by runs in one engine."""
    engine = engine_for_choice(scene, engines)
    with Crew.of(scene, default_workers=1).at_work(PAIRS_COMPUTED_IN_ADVANCE, *folders_for_workers(scene)) as pool:
        chooser = EffectChooser(
            scene, engine, scene.quantities, scene.tolerance, report_progress=report_progress, executor=pool
        )
        choice, full_work = chooser.choose(), chooser.predicted_work(frozenset())
    results = (
        chooser.whole.variants.results_with_errors(frozenset(choice.left_out), choice.step_factor)
        if scene.error
        else []
    )
    single_effects = [
        SingleEffect(
            effect,
            chooser.reporting_screen.predicted_change(frozenset([effect])),
            full_work / chooser.predicted_work(frozenset([effect])),
        )
        for effect in chooser.effects
    ]
    return SceneEffectChoice(
        scene, engine, choice, single_effects, chooser.change_if_left_out_too(frozenset(choice.left_out)), {}, results
    )


def _linear_ride_choice(scene: Any) -> SceneEffectChoice:
    """The choice of effects for a linear stationary ride scene in closed form; numbers of calls are for one second of
    motion."""
    from models.advice.ride_choice.activity import activity_by_element
    from models.advice.ride_choice.choose import Chooser as Linear
    from models.systems.ride.of_scene import scene_errors

    with scene_errors(scene):
        chooser = Linear.from_scene(scene)
        linear = chooser.choose()
        singles = {effect: frozenset([effect]) for effect in chooser.effects}
        calls = chooser.cost(frozenset()).calls
        single_effects = [
            SingleEffect(
                effect.name, abs(chooser.predicted_changes(effect_set)), calls / chooser.cost(effect_set).calls
            )
            for effect, effect_set in singles.items()
        ]
        further = {
            effect.name: change for effect, change in chooser.change_if_left_out_too(frozenset(linear.left_out)).items()
        }
        watts = activity_by_element(chooser.full_scenes[len(chooser.full_scenes) // 2])
    calls_before, calls_after = round(linear.cost_before.calls), round(linear.cost_after.calls)
    work = tuple(cost.work for cost in (linear.cost_before, linear.cost_before, linear.cost_after))
    choice = EffectChoice(
        tuple(effect_set.name for effect_set in linear.candidates),
        tuple(effect_set.name for effect_set in linear.left_out),
        1,
        abs(linear.predicted_change),
        0.0 * linear.predicted_change,
        abs(linear.confirmed_change),
        0.0 * linear.predicted_change,
        linear.within_tolerance,
        (calls_before, calls_before, calls_after),
        work,
        linear.confirmations,
        0,
        0.0,
    )
    return SceneEffectChoice(scene, "closed form", choice, single_effects, further, watts)


def _summary_of_choice(scene_choice: SceneEffectChoice) -> dict[str, Any]:
    """Entry of the summary for a choice: its effects, their changes and the saving."""
    choice = scene_choice.choice
    return {
        "system": scene_choice.scene.system,
        "implementation": scene_choice.engine,
        "left out": list(choice.left_out),
        "stay": scene_choice.staying_effects,
        "step times": choice.step_factor,
        "errors": {
            name: {
                "predicted": float(choice.predicted_change[i]),
                "confirmed": float(choice.confirmed_change[i]),
                "chance": float(choice.statistical_error[i]),
            }
            for i, name in enumerate(scene_choice.scene.quantities)
        },
        "kept": choice.within_tolerance,
        "calls": list(choice.calls),
        "confirmations": choice.confirmations,
        "would matter no more above": scene_choice.further_tolerances,
        "would break an assumption": {
            name: [asdict(breach) for breach in barred] for name, barred in choice.assumptions_barring.items()
        },
    }


def _save_effect_table(scene_choice: SceneEffectChoice, table_path: Path) -> None:
    """Save a CSV file with a row per effect: the changes if only this effect is left out, the saved work, and whether
    it was left out."""
    with table_path.open("x", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        heads = [f"{name}, change [-]" for name in scene_choice.scene.quantities]
        writer.writerow(["effect", "left out", *heads, "times less work alone [-]", "would break"])
        for effect in scene_choice.single_effects:
            values = map(repr, effect.predicted_changes.tolist())
            broken = "; ".join(breach.says for breach in scene_choice.choice.assumptions_barring.get(effect.effect, ()))
            writer.writerow(
                [effect.effect, effect.effect in scene_choice.choice.left_out, *values, repr(effect.work_ratio), broken]
            )


def percent_text(relative_change: float) -> str:
    """Text of a relative change in per cent."""
    digits = ".2g" if abs(relative_change) < 0.1 else ",.0f"
    return f"{100 * relative_change:{digits}} %" if np.isfinite(relative_change) else "without end"


def _change_text(relative_change: float, uncertainty: float) -> str:
    return percent_text(relative_change) + (f" +- {percent_text(uncertainty)}" if uncertainty else "")


def _reason_to_stay_text(relative_change: float, scene_choice: SceneEffectChoice) -> str:
    """Text on why an effect stays: how much the quantities would change if it were left out, too."""
    if (
        relative_change > TOLERANCE_SHARE_OF_PREDICTION * scene_choice.scene.tolerance
        or scene_choice.activity_of_element
        or scene_choice.choice.ended_early
    ):
        return f"would matter no more at a tolerance above {percent_text(relative_change)}"
    return (
        f"stays at {percent_text(relative_change)}: steps would have to be shorter for it to go, or whole runs did "
        "not confirm it"
    )


def choice_lines(scene_choice: SceneEffectChoice, with_title: bool) -> list[str]:
    """Lines for the screen on the choice of a scene's effects."""
    choice, scene = scene_choice.choice, scene_choice.scene
    rows = [
        f"  {scene.title} ({scene.system}, {scene_choice.engine})" if with_title else f"  by {scene_choice.engine}",
        f"    left out: {', '.join(choice.left_out) or 'nothing'}",
        f"    stay: {', '.join(scene_choice.staying_effects) or 'nothing'}",
    ]
    for i, name in enumerate(scene.quantities):
        verdict = "kept" if choice.confirmed_change[i] + choice.statistical_error[i] <= scene.tolerance else "NOT KEPT"
        rows.append(
            f"    {name}: {_change_text(choice.predicted_change[i], choice.prediction_remainder[i])} predicted, "
            f"{_change_text(choice.confirmed_change[i], choice.statistical_error[i])} confirmed, tolerance "
            f"{100 * scene.tolerance:g} %: {verdict}"
        )
    calls_before, step, calls_after = choice.calls
    saved = f"{calls_before:,} -> {calls_after:,}, {calls_before / calls_after:.3g} times fewer"
    if scene_choice.activity_of_element:
        rows.append(f"    calls per second of motion {saved}")
    else:
        faster = choice.seconds[0] / choice.seconds[2]
        rows.append(
            f"    calls {saved}, by steps {choice.step_factor} times as long; {calls_before / step:.3g} times by "
            f"longer steps with all effects; CPU seconds {faster:.3g} times fewer, once"
        )
    rows += [
        f"    {name} {_reason_to_stay_text(change, scene_choice)}"
        for name, change in sorted(scene_choice.further_tolerances.items(), key=lambda item: item[1])
    ]
    rows += [
        f"    {name} stays; without it an assumption would be broken: {breach.fact()}"
        for name, breaches in choice.assumptions_barring.items()
        for breach in breaches
    ]
    if choice.ended_early:
        rows.append(
            f"    the search ended at the calls of {SEARCH_BUDGET_IN_RUNS} runs of the scene: "
            "larger sets were not tried"
        )
    if choice.sample_factor:
        rows.append(
            f"    chance alone stands in the way of more: {choice.sample_factor:.2g} times as many samples would tell"
        )
    rows += misleading_activity_lines(scene_choice)
    worst = float((choice.confirmed_change + choice.statistical_error).max())
    return [*rows, f"    the choice holds for tolerances down to {percent_text(worst)}"] if choice.left_out else rows


def misleading_activity_lines(scene_choice: SceneEffectChoice) -> list[str]:
    """Lines for the screen on inertias for which energy activity misleads: active ones without which a quantity hardly
    changes."""
    total, rows = sum(value for value in scene_choice.activity_of_element.values() if np.isfinite(value)), []
    for effect in scene_choice.single_effects:
        share = scene_choice.activity_of_element.get(f"inertia {effect.effect}", 0.0) / (total or 1.0)
        for name, change in zip(scene_choice.scene.quantities, effect.predicted_changes, strict=True):
            if np.isfinite(share) and share > ACTIVE_SHARE and change < BLIND_CHANGE:
                rows.append(
                    f"    energy activity misleads: {effect.effect} holds {percent_text(share)} of it, and without "
                    f"it {name} changes by {percent_text(change)}"
                )
    return rows


def choice_figure(scene_choices: list[SceneEffectChoice], figure_path: Path) -> None:
    """Save a figure with a panel of changes per scene, and a panel of energy activities if there are any."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, save, subplots

    shown = [(choice, False) for choice in scene_choices] + [
        (choice, True) for choice in scene_choices if choice.activity_of_element
    ]
    heights = [
        1.5 + 0.2 * (DRAWN_ELEMENT_LIMIT if active else max(len(choice.single_effects), 4)) for choice, active in shown
    ]
    figure, axes = subplots(
        len(shown), 1, figsize=(COLUMN_WIDTH, sum(heights) + 0.5), squeeze=False, height_ratios=heights
    )
    for axis, (choice, active) in zip(axes.flat, shown, strict=True):
        _plot_activity(axis, choice) if active else _plot_changes(axis, choice)
    title = "Which effects matter for which question: change by leaving out one effect, against the tolerance"
    add_heading(figure, title, _results_by_name(scene_choices))
    save(figure, figure_path)


def _plot_changes(axis: Any, scene_choice: SceneEffectChoice) -> None:
    """Plot how much each quantity changes if a single effect is left out, for each effect.

    Shaded rows, from the scene's tolerance on, tell why an effect stays; a name says whether it went with the others.
    """
    from models.drawing.figures import DARK, PALE, REJECTED_COLOUR, SMALL_TEXT

    shown = sorted(
        scene_choice.single_effects,
        key=lambda effect: float(np.nan_to_num(effect.predicted_changes, posinf=HIGHEST_CHANGE).max()),
    )
    y = np.arange(len(shown))
    for i, name in enumerate(scene_choice.scene.quantities):
        values = np.array([effect.predicted_changes[i] for effect in shown])
        axis.plot(
            np.clip(np.where(np.isfinite(values), 100 * values, np.nan), LOWEST_CHANGE, HIGHEST_CHANGE),
            y,
            "os^Dv"[i % 5],
            color=f"C{i}",
            ms=5,
            label=name.partition(" [")[0],
        )
    for row, effect in zip(y, shown, strict=True):
        if not np.isfinite(effect.predicted_changes).all():
            axis.text(HIGHEST_CHANGE, row, "cannot go alone", ha="right", va="center", fontsize=SMALL_TEXT)
    barred = [
        row for row, effect in zip(y, shown, strict=True) if effect.effect in scene_choice.choice.assumptions_barring
    ]
    if barred:
        highest = np.full(len(barred), HIGHEST_CHANGE)
        axis.plot(highest, barred, "x", color=REJECTED_COLOUR, ms=7, mew=1.6, label="would break an assumption")
    axis.axvline(100 * scene_choice.scene.tolerance, color=DARK, ls="--", lw=1, label="tolerance")
    axis.axvspan(
        100 * scene_choice.scene.tolerance, 1.5 * HIGHEST_CHANGE, color=PALE, alpha=0.25, lw=0, label="matters alone"
    )
    axis.set(
        xscale="log",
        xlim=(LOWEST_CHANGE / 1.5, HIGHEST_CHANGE * 1.5),
        ylim=(-0.5, len(shown) - 0.5),
        yticks=y,
        yticklabels=[_effect_label(scene_choice, effect) for effect in shown],
        xlabel="change by leaving out this effect alone [%] (at the ends: beyond)",
    )
    calls_before, _, calls_after = scene_choice.choice.calls
    axis.set_title(
        f"{scene_choice.scene.system}: {calls_before / calls_after:.3g} times fewer calls "
        f"at {100 * scene_choice.scene.tolerance:g} %, without the effects named 'left out'"
    )
    axis.legend(fontsize=SMALL_TEXT, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _effect_label(scene_choice: SceneEffectChoice, effect: SingleEffect) -> str:
    """Label of an effect with "(left out)" or "(stays)". An effect whose own change is small may stay, since it can
    matter together with others that were left out."""
    return effect.effect.replace("_", " ") + (
        " (left out)" if effect.effect in scene_choice.choice.left_out else " (stays)"
    )


def _plot_activity(axis: Any, scene_choice: SceneEffectChoice) -> None:
    """Draw a bar chart of each element's share of the energy activity."""
    from models.drawing.figures import BLUE

    finite = {name: value for name, value in scene_choice.activity_of_element.items() if np.isfinite(value)}
    total = sum(finite.values())
    shown = sorted(finite.items(), key=lambda item: -item[1])[:DRAWN_ELEMENT_LIMIT][::-1]
    axis.barh([name for name, _ in shown], [100 * value / total for _, value in shown], color=BLUE, alpha=0.7)
    axis.set(
        title=f"{scene_choice.scene.system}: energy activity, which knows neither the question nor pairs",
        xlabel="share of the mean power [%]",
    )


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("choice")
