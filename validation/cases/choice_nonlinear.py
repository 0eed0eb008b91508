"""Effects chosen within a tolerance for scenes that are simulated in time: is each choice right, and how many force
calls does it save?"""

from pathlib import Path

import numpy as np

from models.advice.choice.choose import EffectChooser
from models.advice.choice.variants import Variants
from models.advice.ride_choice.in_time import FEWEST_COPIES
from models.core.errors import InputError
from validation.choice.drawn_scenes import draw_scene
from validation.choice.judged import ChoiceCheckedByRuns, choice_checked_by_runs
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table, behaviour_row
from validation.ride.drawn_rides import COPIES, NonlinearRide, random_nonlinear_ride

TITLE = "Effects that a scene run in time calls for, chosen by runs and confirmed"
SYSTEM: System = "effects"
SCENE_COUNT_BY_SYSTEM = {"pitch-plane": 22, "wheelset": 3, "braking": 3, "ride": 7}
"""Number of random scenes of each system."""
ENGINES_BY_SYSTEM = {
    "pitch-plane": ("reference", "mujoco"),
    "wheelset": ("reference", "mujoco", "exudyn"),
    "braking": ("mujoco", "reference", "reference"),
    "ride": ("reference",),
}
"""Engines of each system that take turns over its scenes."""
FRESH_COPIES_RATIO, FRESH_SEED = 4, 77
"""Factor on the number of Monte Carlo copies with which a choice for a ride is judged, and the seed of the roads of
these copies."""
UNDERSAMPLED_SEED, FINE_TOLERANCE = 4, 0.005
"""Seed of a random ride, and a tolerance that is too fine for the fewest Monte Carlo copies."""
RESAMPLE_COUNT, SIGNIFICANT_CHANGE_QUANTILE = 4000, 0.0015
"""Number of bootstrap samples of the copies, and the quantile of the resampled changes that counts as significant."""
QUICK_SCENE_SEEDS = (0, 2, 3)
"""Seeds of the pitch-plane scenes in a quick run, which has no other system."""
JUDGED_CHANGE_RANGE = (1e-4, 0.05)
"""Smallest and largest relative change whose prediction is judged, as for linear scenes."""


def judge_choice_for_scene(system_name: str, seed: int) -> ChoiceCheckedByRuns:
    """Choose effects for the random scene of a seed, and judge the choice."""
    if system_name == "ride":
        return judge_choice_for_ride(random_nonlinear_ride(seed))
    return choice_checked_by_runs(
        draw_scene(system_name, seed),
        system_name,
        ENGINES_BY_SYSTEM[system_name][seed % len(ENGINES_BY_SYSTEM[system_name])],
    )


def judge_choice_for_ride(nonlinear_ride: NonlinearRide) -> ChoiceCheckedByRuns:
    """Choose effects for a ride with nonlinear springs, then compare the complete and the reduced vehicle on new roads
    that the choice did not use."""
    engine = ENGINES_BY_SYSTEM["ride"][0]
    choice = EffectChooser(
        nonlinear_ride.prepared_in_time(), engine, list(nonlinear_ride.quantities), nonlinear_ride.tolerance
    ).choose()
    fresh = Variants(nonlinear_ride.prepared_in_time(FRESH_COPIES_RATIO * COPIES, FRESH_SEED), engine)
    full_scene, rest = fresh.quantities_of_run(), fresh.quantities_of_run(choice.left_out, choice.step_factor)
    if full_scene is None or rest is None:
        return ChoiceCheckedByRuns(
            "ride", engine, nonlinear_ride, choice, np.full(len(nonlinear_ride.quantities), np.inf)
        )
    again = [
        _significant_change(full_scene.quantity(name).case_values[0], rest.quantity(name).case_values[0])
        for name in nonlinear_ride.quantities
    ]
    return ChoiceCheckedByRuns("ride", engine, nonlinear_ride, choice, np.array(again))


def _significant_change(full_mean_squares: np.ndarray, reduced_mean_squares: np.ndarray) -> float:
    """Smallest relative change of a standard deviation that is significant, by resampling the mean squares (m,) of the
    Monte Carlo copies."""
    picked = np.random.default_rng(FRESH_SEED).integers(
        len(full_mean_squares), size=(RESAMPLE_COUNT, len(full_mean_squares))
    )
    changes = np.abs(np.sqrt(reduced_mean_squares[picked].mean(axis=1) / full_mean_squares[picked].mean(axis=1)) - 1.0)
    return float(np.quantile(changes, SIGNIFICANT_CHANGE_QUANTILE))


@allowing_breaches("random scenes: whether what is left changes them as foretold is judged")
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of random scenes of four systems; a quick run has three scenes of the pitch plane."""
    seeds = (
        {"pitch-plane": QUICK_SCENE_SEEDS}
        if quick
        else {system: range(count) for system, count in SCENE_COUNT_BY_SYSTEM.items()}
    )
    choices = [judge_choice_for_scene(system, seed) for system, seeds_of in seeds.items() for seed in seeds_of]
    rows = [
        *_kept_tolerance_rows(choices),
        _predicted_change_row(choices, quick),
        *(row for system in seeds for row in _saving_rows(choices, system)),
    ]
    rows += [] if quick else [_refused_choice_row()]
    return rows, {"scenes": [_summary_of_choice(judged_choice) for judged_choice in choices], "systems": list(seeds)}


def _kept_tolerance_rows(judged_choices: list[ChoiceCheckedByRuns]) -> list[Row]:
    """Rows: share of scenes whose tolerance is kept, and number of choices that claim so wrongly."""
    kept_share = float(
        np.mean([judged_choice.choice.within_tolerance and judged_choice.is_honest for judged_choice in judged_choices])
    )
    return [
        Observed(
            "choice_nonlinear.kept",
            SYSTEM,
            f"share of {len(judged_choices)} random scenes whose tolerance is kept",
            kept_share,
            "",
        ).within(1.0, 0.05, "asked: at least 95 of 100", "none"),
        Observed(
            "choice_nonlinear.honest",
            SYSTEM,
            "choices that are reported as kept although two more runs show that they are not",
            float(sum(not judged_choice.is_honest for judged_choice in judged_choices)),
            "",
        ).at_most(0.0, "asked: never", "none"),
    ]


def _refused_choice_row() -> Row:
    """Row: a choice is refused for a ride with few copies and a fine tolerance, since random scatter could exceed the
    tolerance."""
    asked, outcome = random_nonlinear_ride(UNDERSAMPLED_SEED), "a choice"
    try:
        EffectChooser(
            asked.prepared_in_time(FEWEST_COPIES), ENGINES_BY_SYSTEM["ride"][0], list(asked.quantities), FINE_TOLERANCE
        ).choose()
    except InputError as error:
        outcome = "refused" if "samples would tell" in error.allowed else error.allowed
    return behaviour_row(
        "choice_nonlinear.refused",
        SYSTEM,
        f"choice for a ride of {FEWEST_COPIES} copies at a tolerance of {100 * FINE_TOLERANCE:g} %, where chance may "
        "add more than that",
        outcome,
        "refused",
        "and how many samples would tell",
    )


def _predicted_and_confirmed_changes(judged_choices: list[ChoiceCheckedByRuns]) -> np.ndarray:
    """Predicted and confirmed relative changes (n, 2) of all quantities whose confirmed change is in
    JUDGED_CHANGE_RANGE."""
    pairs = [
        (p, c)
        for judged_choice in judged_choices
        for p, c in zip(judged_choice.choice.predicted_change, judged_choice.choice.confirmed_change, strict=True)
    ]
    return np.array([pair for pair in pairs if JUDGED_CHANGE_RANGE[0] < pair[1] < JUDGED_CHANGE_RANGE[1]]).reshape(
        -1, 2
    )


def _predicted_change_row(judged_choices: list[ChoiceCheckedByRuns], quick: bool) -> Row:
    """Row: share of the predicted changes that are within a factor of 2 of the confirmed ones."""
    ratios = np.divide(*_predicted_and_confirmed_changes(judged_choices).T)
    share = float(np.mean((ratios >= 0.5) & (ratios <= 2.0))) if len(ratios) else 1.0
    name, asked = "choice_nonlinear.predictions", "asked: within a factor of 2"
    quantity = f"share of {len(ratios)} predicted changes below 5 % within a factor of 2 of the confirmed ones"
    if quick:  # too few for a share
        return Observed(name, SYSTEM, quantity, share, "").beside(
            "1 within 0.05", f"{asked}; judged in the full share", "none"
        )
    return Observed(name, SYSTEM, quantity, share, "").within(1.0, 0.05, asked, "none")


def _saving_rows(judged_choices: list[ChoiceCheckedByRuns], system_name: str) -> list[Row]:
    """Rows: saving of force calls and of computing time in the scenes of one system."""
    of_system = [judged_choice for judged_choice in judged_choices if judged_choice.system == system_name]
    calls = np.array([judged_choice.choice.calls for judged_choice in of_system], float)
    seconds = np.array([judged_choice.choice.seconds for judged_choice in of_system])
    name = f"choice_nonlinear.saving.{system_name}"
    note = (
        "steps within a sample alone may grow"
        if system_name == "braking"
        else "it depends on the step that a scene has"
    )
    return [
        Observed(
            name,
            SYSTEM,
            f"ratio of calls before and after the choice, median of {len(of_system)} scenes of {system_name}",
            float(np.median(calls[:, 0] / calls[:, 2])),
            "times",
        ).aim(5.0, note, "at least"),
        Observed(
            f"{name}.step",
            SYSTEM,
            "ratio of calls before and after longer steps alone, with all effects, median of "
            f"{len(of_system)} scenes of {system_name}",
            float(np.median(calls[:, 0] / calls[:, 1])),
            "times",
        ).beside("", "what is left is due to effects", "none"),
        Observed(
            f"{name}.seconds",
            SYSTEM,
            "ratio of CPU seconds before and after the choice, each run once, median of the scenes",
            float(np.median(seconds[:, 0] / seconds[:, 2])),
            "times",
        ).beside("", "of calls, and of what a call takes", "none"),
    ]


def _summary_of_choice(judged_choice: ChoiceCheckedByRuns) -> Saved:
    """Numbers of a choice that the report's tables and figure need."""
    choice = judged_choice.choice
    return {
        "system": judged_choice.system,
        "engine": judged_choice.engine,
        "tolerance": judged_choice.question.tolerance,
        "quantities": list(judged_choice.question.quantities),
        "left out": list(choice.left_out),
        "times": choice.step_factor,
        "predicted": choice.predicted_change.tolist(),
        "confirmed": choice.confirmed_change.tolist(),
        "kept": choice.within_tolerance,
        "calls": list(choice.calls),
        "seconds": list(choice.seconds),
    }


def tables(case_data: Saved) -> list[Table]:
    """Table of savings by system, and of how often each effect was left out."""
    rows = []
    for system in case_data["systems"]:
        of_system = [judged_choice for judged_choice in case_data["scenes"] if judged_choice["system"] == system]
        saved = [judged_choice["calls"][0] / judged_choice["calls"][2] for judged_choice in of_system]
        alone = [judged_choice["calls"][0] / judged_choice["calls"][1] for judged_choice in of_system]
        faster = [judged_choice["seconds"][0] / judged_choice["seconds"][2] for judged_choice in of_system]
        went = sorted({name for judged_choice in of_system for name in judged_choice["left out"]})
        rows.append(
            (
                system,
                str(len(of_system)),
                *(f"{np.median(values):.3g}" for values in (saved, alone, faster)),
                ", ".join(
                    f"{name} {sum(name in judged_choice['left out'] for judged_choice in of_system)}" for name in went
                )
                or "none",
            )
        )
    heads = ("system", "scenes", "fewer calls", "by steps alone", "fewer CPU seconds", "effects left out, how often")
    note = (
        "Medians, times; tolerances are 0.5, 2 and 5 % in turn, of rides 1, 2 and 5 %. Each choice is confirmed "
        "over the whole run."
    )
    return [Table("What choosing effects and steps saves", note, heads, tuple(rows))]


def draw(case_data: Saved) -> Drawn:
    """Plot predicted over confirmed changes, and savings in force calls over the tolerance."""
    from models.drawing.figures import COLUMN_WIDTH, DARK, add_heading, subplots

    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8))
    ends = np.array([1e-4, 6.0])
    left.fill_between(ends, ends / 2, ends * 2, color="#999999", alpha=0.25, label="factor 2")
    for i, system in enumerate(case_data["systems"]):
        of_system = [judged_choice for judged_choice in case_data["scenes"] if judged_choice["system"] == system]
        predicted, confirmed = (
            100 * np.array([value for judged_choice in of_system for value in judged_choice[key]])
            for key in ("predicted", "confirmed")
        )
        left.plot(confirmed.clip(ends[0]), predicted.clip(ends[0]), "os^D"[i], ms=4, color=f"C{i}", label=system)
        shift = 1.06 ** (i - 1)
        right.plot(
            [100 * judged_choice["tolerance"] * shift for judged_choice in of_system],
            [judged_choice["calls"][0] / judged_choice["calls"][2] for judged_choice in of_system],
            "os^D"[i],
            ms=4,
            color=f"C{i}",
            label=system,
        )
    left.set(
        xscale="log",
        yscale="log",
        xlabel="confirmed change [%] (at the end: smaller)",
        ylabel="predicted change [%]",
        title="All that was left out, and longer steps",
    )
    right.axhline(5.0, color=DARK, ls="--", lw=0.8, label="5 times")
    right.set(xscale="log", yscale="log", xlabel="tolerance [%]", ylabel="times fewer calls [-]", title="What it saves")
    left.legend(loc="upper left")
    right.legend(loc="best")
    add_heading(figure, "Choice by runs: changes as predicted and as confirmed, and calls saved")
    return [(FIGURE_CAPTION, figure)]


FIGURE_CAPTION = (
    "Random scenes of half cars on roads, wheelsets, braked trucks and rides on bent springs: effects that the "
    "quantities can do without are left out and steps lengthened as far as the tolerance allows, predicted from runs "
    "without one and two effects in steps as long as hardly matters, and confirmed by the whole run."
)
"""Caption of the figure."""
