"""Which effects of a ride scene its quantities need within a tolerance: chosen, and confirmed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from models.advice.choice.systems.ride import copies_of_scene
from models.advice.ride_choice.activity import activity_by_element
from models.advice.ride_choice.choose import Chooser, RideChoice
from models.advice.ride_choice.in_time import Samples
from models.advice.ride_choice.reduced_files import SCENE_FILE_NAME, write
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.strict import read
from models.core.told import derived_result
from models.core.whole_files import write_whole
from models.systems import run as run_scene
from models.systems.ride.of_scene import needs_run_in_time, scene_errors
from models.systems.ride.reduced_scene import OmissibleEffect, ReducedScene, refusal_reason
from models.systems.ride.scene import RideScene
from studies.choice import save_choices

SYSTEM = "ride"
ReportProgress = Callable[[str, float], None]

LOWEST_CHANGE, HIGHEST_CHANGE = 1e-4, 1e3
"""Ends of the axis of changes (per cent); smaller or larger changes are drawn at the ends."""
DRAWN_ELEMENT_LIMIT = 12
"""Largest number of elements whose energy activity is drawn, the most active first."""


class Options(Samples):
    """Keys of the table [options] of this study: Monte Carlo copies of a vehicle with nonlinear springs; none for a
    linear vehicle."""


@dataclass(frozen=True)
class SingleRideEffect:
    """A single effect of a ride scene: predicted and confirmed relative changes (quantities,) if only it is left out,
    and the reason why it may not be left out, else ""."""

    effect: OmissibleEffect
    predicted_change: np.ndarray
    confirmed_change: np.ndarray
    refusal_reason: str


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for scenes without a choice of effects, and for options of copies if the vehicle is linear."""
    read(Options, scene.options, scene.file, "options")
    if needs_run_in_time(scene):
        copies_of_scene(scene)
    elif scene.options:
        option_name, value = next(iter(scene.options.items()))
        raise InputError(
            scene.file,
            f"options.{option_name}",
            value,
            "is read where springs are bent, and effects chosen by runs; for this vehicle there is a closed form",
        )


def run(
    scene: RideScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Choose the effects of a ride scene, by runs for nonlinear springs; saves ``choice.nc``, two CSV files, a figure
    and files of the reduced scene; returns the summary."""
    check(scene, engines)
    if needs_run_in_time(scene):
        return save_choices([scene], engines, output_folder, report_progress)
    report_progress("screening", 0.1)
    with scene_errors(scene):
        chooser = Chooser.from_scene(scene)
        choice = chooser.choose()
        report_progress("single effects", 0.7)
        further = chooser.change_if_left_out_too(frozenset(choice.left_out))
        single_effects = [_single_effect(chooser, effect) for effect in chooser.effects]
        activities = activity_by_element(chooser.full_scenes[len(chooser.full_scenes) // 2])
    if choice.left_out:
        write(chooser.reduced_scene_without(frozenset(choice.left_out)), output_folder)
    report_progress("what is left", 0.9)
    results = _deviation_results(scene, chooser.reduced_scene_without(frozenset(choice.left_out)))
    _save_effect_table(scene, single_effects, choice, activities, (results, chooser.counts), output_folder)
    choice_figure(scene, single_effects, choice, activities, results, output_folder / "choice.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "results": results,
        "answer": _summary_of_choice(scene, choice, further),
        "table": _table_lines(scene, choice, single_effects, further),
    }


def _deviation_results(scene: RideScene, reduced_scene: ReducedScene) -> dict[str, Result]:
    """Results of the complete scene and of the reduced scene: standard deviations with their errors and assumptions."""
    results = {"whole scene": run_scene(scene, "reference", error=scene.error)}
    vehicle = replace(reduced_scene.vehicle, limits=reduced_scene.limits)
    if reduced_scene != ReducedScene.complete(scene):
        results["what is left"] = run_scene(reduced_scene.ride_scene, "reference", vehicle=vehicle, error=scene.error)
    return results


def _single_effect(chooser: Chooser, ride_effect: OmissibleEffect) -> SingleRideEffect:
    single = frozenset([ride_effect])
    return SingleRideEffect(
        ride_effect, chooser.predicted_changes(single), chooser.changes_by_modes(single), refusal_reason(single)
    )


def _summary_of_choice(
    scene: RideScene, effect_choice: RideChoice, change_by_effect: dict[OmissibleEffect, float]
) -> dict[str, Any]:
    """Summary of a ride's choice as plain values: its effects, their changes and the saving."""
    columns = {
        "predicted": effect_choice.predicted_change,
        "confirmed": effect_choice.confirmed_change,
        "between speeds": effect_choice.change_between_speeds,
        "parameters off": effect_choice.change_with_parameters_off,
    }
    errors = {
        name: {key: float(values[i]) for key, values in columns.items()} for i, name in enumerate(scene.quantities)
    }
    return {
        "left out": [effect.name for effect in effect_choice.left_out],
        "stay": [effect.name for effect in effect_choice.candidates if effect not in effect_choice.left_out],
        "errors": errors,
        "kept": effect_choice.within_tolerance,
        "states": [effect_choice.cost_before.states, effect_choice.cost_after.states],
        "step": [effect_choice.cost_before.step, effect_choice.cost_after.step],
        "step limit": list(effect_choice.stable_steps),
        "calls": [effect_choice.cost_before.calls, effect_choice.cost_after.calls],
        "said": list(effect_choice.refusal_texts),
        "confirmations": effect_choice.confirmations,
        "would matter no more above": {effect.name: change for effect, change in change_by_effect.items()},
    }


def _save_effect_table(
    scene: RideScene,
    single_effects: list[SingleRideEffect],
    effect_choice: RideChoice,
    activity_of_element: dict[str, float],
    results_and_calls: tuple[dict[str, Result], dict[str, int]],
    output_folder: Path,
) -> None:
    """Save, as netCDF and CSV, each effect's predicted and confirmed changes if only it is left out, and whether it was
    left out; and as another CSV file the energy activity (W) of every element."""
    import pandas as pd

    results, counts = results_and_calls
    columns: dict[str, Any] = {"left out": [single.effect in effect_choice.left_out for single in single_effects]}
    changes = {
        stage: np.array([getattr(single, f"{stage}_change") for single in single_effects]).reshape(
            -1, len(scene.quantities)
        )
        for stage in ("predicted", "confirmed")
    }
    effects, why = (
        [single.effect.name for single in single_effects],
        [single.refusal_reason for single in single_effects],
    )
    channels = {stage: Channel(("effect", "quantity"), values, "1") for stage, values in changes.items()}
    channels |= {"left_out": Channel("effect", columns["left out"]), "not_alone_because": Channel("effect", why)}
    axes = {"effect": effects, "quantity": list(scene.quantities), "element": list(activity_of_element)}
    saved = result(
        scene,
        channels | {"activity": Channel("element", list(activity_of_element.values()), "W", "energy activity")},
        {name: Channel(name, values) for name, values in axes.items()},
        engine="reference",
        counts={"confirmations": effect_choice.confirmations} | counts,
    )
    derived_result(saved, results, "deviations of the whole scene and of what is left").save(
        output_folder / "choice.nc"
    )
    columns |= {
        f"{name}, {stage} [-]": values[:, i]
        for i, name in enumerate(scene.quantities)
        for stage, values in changes.items()
    }
    table = pd.DataFrame(columns | {"not alone because": why}, pd.Index(effects, name="effect"))
    write_whole(output_folder / "effects.csv", table.to_csv(na_rep="nan"))
    activity_column = saved.data["activity"].to_pandas().rename("activity [W]")
    write_whole(output_folder / "activity.csv", activity_column.to_csv(na_rep="nan"))


def choice_figure(
    scene: RideScene,
    single_effects: list[SingleRideEffect],
    effect_choice: RideChoice,
    activity_of_element: dict[str, float],
    shown_results: dict[str, Result],
    figure_path: Path,
) -> None:
    """Save a figure of the changes if each effect alone, or all chosen effects, are left out, with the tolerance; and
    of each element's energy activity."""
    from models.drawing.figures import COLUMN_WIDTH, DARK, add_heading, save, subplots

    names = [
        single.effect.name + ("  [left out]" if single.effect in effect_choice.left_out else "")
        for single in single_effects
    ]
    heights = 1.6 + 0.26 * (len(names) + 1), 0.7 + 0.2 * DRAWN_ELEMENT_LIMIT
    figure, (changes_axis, activity_axis) = subplots(
        2, 1, figsize=(COLUMN_WIDTH, sum(heights) + 0.4), height_ratios=heights
    )
    y = np.arange(len(names) + 1)[::-1]
    for i, name in enumerate(scene.quantities):
        shift = 0.16 * (i - (len(scene.quantities) - 1) / 2)
        for stage, marker, size in (("confirmed", "o", 5), ("predicted", "x", 6)):
            changes = 100 * abs(
                np.array([getattr(row, f"{stage}_change")[i] for row in (*single_effects, effect_choice)])
            )
            shown = np.clip(np.nan_to_num(changes, posinf=HIGHEST_CHANGE), LOWEST_CHANGE, HIGHEST_CHANGE)
            changes_axis.plot(shown, y + shift, marker, color=f"C{i}", label=f"{name}, {stage}", ms=size)
    changes_axis.axvline(100 * (scene.tolerance or 0), color=DARK, ls="--", label="tolerance")
    changes_axis.set(
        xscale="log",
        xlim=(LOWEST_CHANGE / 1.5, HIGHEST_CHANGE * 1.5),
        yticks=y,
        yticklabels=[*names, "all that is left out"],
        xlabel="change of the standard deviation [%], worst speed (at the ends: beyond)",
        title="What leaving out an effect changes",
    )
    changes_axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    _plot_activity(activity_axis, activity_of_element)
    add_heading(figure, scene.title, shown_results)
    save(figure, figure_path)


def _plot_activity(axis: Any, activity_of_element: dict[str, float]) -> None:
    """Draw a bar chart of each element's share of the mean power, from the ``activity_of_element`` (W); infinite ones,
    of inertias under white noise, are left out."""
    from models.drawing.figures import BLUE

    finite = {name: value for name, value in activity_of_element.items() if np.isfinite(value)}
    total = sum(finite.values())
    shown = sorted(finite.items(), key=lambda item: -item[1])[:DRAWN_ELEMENT_LIMIT][::-1]
    axis.barh([name for name, _ in shown], [100 * value / total for _, value in shown], color=BLUE, alpha=0.7)
    without = [name for name in activity_of_element if name not in finite]
    note = f"\n{len(without)} inertias are unbounded under white noise" if without else ""
    axis.set(title="Energy activity: blind to the question", xlabel=f"share of the mean power [%]{note}")


def percent_text(relative_change: float) -> str:
    """Text of a relative change in per cent, with its sign."""
    digits = "+.2g" if abs(relative_change) < 0.1 else "+,.0f"
    return f"{100 * relative_change:{digits}} %" if np.isfinite(relative_change) else "without end"


def _table_lines(
    scene: RideScene,
    effect_choice: RideChoice,
    single_effects: list[SingleRideEffect],
    change_by_effect: dict[OmissibleEffect, float],
) -> list[str]:
    """Lines for the screen on the choice of effects, their changes and the saving."""
    tolerance = f"{100 * (scene.tolerance or 0):g} %"
    lines = [f"  left out: {', '.join(effect.name for effect in effect_choice.left_out) or 'nothing'}"]
    lines += [f"    {effect.name}: {effect.says}" for effect in effect_choice.left_out]
    stay = [effect.name for effect in effect_choice.candidates if effect not in effect_choice.left_out]
    lines += [f"  stays: {', '.join(stay) or 'nothing'}", *(f"    {why}" for why in effect_choice.refusal_texts)]
    for i, name in enumerate(scene.quantities if effect_choice.left_out else ()):
        change_texts = map(
            percent_text,
            (
                effect_choice.predicted_change[i],
                effect_choice.confirmed_change[i],
                effect_choice.change_between_speeds[i],
                effect_choice.change_with_parameters_off[i],
            ),
        )
        lines.append(
            "  {}: {} predicted, {} confirmed; {} at the worst speed of the range, {} there with parameters "
            "5 % off; tolerance {}".format(name, *change_texts, tolerance)
        )
    lines += saved_work_lines(effect_choice, tolerance)
    lines += ["  alone, what leaving it out changes (confirmed):"]
    lines += [
        f"    {single.effect.name}: {', '.join(map(percent_text, single.confirmed_change))}"
        + (f" ({single.refusal_reason})" if single.refusal_reason else "")
        for single in single_effects
    ]
    for effect, change in sorted(change_by_effect.items(), key=lambda item: item[1]):
        idle = "  {} could go, too ({:.3g} %), but saves no calls, or does not hold nearby"
        matters = "  {} would matter no more at a tolerance above {:.3g} %"
        lines.append((idle if change <= (scene.tolerance or 0) else matters).format(effect.name, 100 * change))
    worst = float(
        max(abs(effect_choice.change_with_parameters_off).max(), abs(effect_choice.change_between_speeds).max())
    )
    return (
        [*lines, f"  the choice holds for tolerances down to {100 * worst:.3g} %"] if effect_choice.left_out else lines
    )


def saved_work_lines(effect_choice: RideChoice, tolerance_text: str) -> list[str]:
    """Lines for the screen on steps and calls at equal accuracy before and after the choice of effects."""
    cost_before, cost_after = effect_choice.cost_before, effect_choice.cost_after
    lines = [
        f"  a run confirms {1e3 * cost_before.step:.3g} ms as the longest step of the classical Runge-Kutta method "
        f"that keeps standard deviations within {tolerance_text} of the exact ones: {cost_before.calls:.4g} calls per "
        f"second of motion (stable up to {1e3 * effect_choice.stable_steps[0]:.3g} ms)"
    ]
    if not effect_choice.left_out:
        return [*lines, "  nothing that may be left out saves calls"]
    return [
        *lines,
        "  without what is left out, changes and steps together keep the same in steps of "
        f"{1e3 * cost_after.step:.3g} ms: {cost_after.calls:.4g} calls, "
        f"{cost_before.calls / cost_after.calls:.3g} times fewer at "
        f"equal accuracy (stable up to {1e3 * effect_choice.stable_steps[1]:.3g} ms); states {cost_before.states} "
        f"-> {cost_after.states}",
        f"  {SCENE_FILE_NAME} beside the results runs what is left",
    ]


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("ride_choice")
