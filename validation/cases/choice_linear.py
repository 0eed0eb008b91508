"""Effects chosen for linear stationary ride scenes within a tolerance: is each choice right, and how many force calls
does it save?"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.advice.ride_choice.activity import activity_by_element
from models.advice.ride_choice.choose import EQUAL_COST_LOG, Chooser, RideChoice
from models.advice.ride_choice.screen import Screen, exact_variances
from models.core.systems import load
from models.systems.ride.reduced_scene import OmissibleEffect, reduced_without
from validation.choice.judged import changes_by_frequency, chooser_over_speeds, measured_step, worst_nearby
from validation.choice.price_of_choice import car_scene
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.ride.drawn_rides import LinearRide, random_linear_ride

HALF_CAR_SCENE = Path(__file__).parents[2] / "studies" / "scenes" / "ride_choice.toml"
"""Scene file of the published half car."""
TITLE = "Effects that a ride scene calls for, chosen with a certificate"
SYSTEM: System = "effects"
SCENE_COUNT, FREQUENCY_JUDGED_COUNT = 40, 10
"""Number of random scenes, three of four with detailed vehicles; and number of these scenes that are also judged by
frequency responses."""
NEARBY_SCENE_COUNT = 8
"""Number of random speeds, and of random parameter sets, at which a choice is checked."""
COMMON_TOLERANCE = 0.02
"""Relative tolerance of every other scene; the others have random tolerances from 0.5 to 10 %."""
QUICK_SCENE_SEEDS = (2, 5)
"""Seeds of the random scenes of a quick run; in both scenes effects are left out."""
STAGES_OF_CHANGE = ("predicted", "confirmed")
JUDGED_CHANGE_RANGE = (1e-4, 0.05)
"""Smallest and largest relative change whose prediction is judged: above rounding errors, and below 5 %."""


@dataclass(frozen=True)
class JudgedChoice:
    """A choice of effects for a random scene, with its results by independent methods. identity_error : largest error
    of the identity that relates covariance and adjoint; frequency_changes (quantities,) : changes by frequency
    responses, or None.

    nearby_change_ratio : largest change at random speeds and with random parameters, divided by the tolerance;
    sampled_saving : saving by the covariance of sampled runs.
    """

    ride: LinearRide
    effect_choice: RideChoice
    identity_error: float
    frequency_changes: np.ndarray | None
    nearby_change_ratio: float
    sampled_saving: float

    @property
    def force_call_saving(self) -> float:
        """Number of force calls that the complete scene needs, divided by that of the reduced scene, at equal
        accuracy."""
        return self.effect_choice.cost_before.calls / self.effect_choice.cost_after.calls

    @property
    def is_honest(self) -> bool:
        """False if the choice claims to keep the tolerance although frequency responses or, without them, its own
        confirmed changes show that it does not."""
        changes = self.effect_choice.confirmed_change if self.frequency_changes is None else self.frequency_changes
        return not self.effect_choice.within_tolerance or bool((abs(changes) <= self.ride.tolerance * (1 + 1e-2)).all())


def judge_choice_for_ride(ride: LinearRide, with_frequency_responses: bool) -> JudgedChoice:
    """Choose effects for a scene, then check the choice by the identity of covariance and adjoint and, if
    ``with_frequency_responses``, by frequency responses."""
    chooser = chooser_over_speeds(ride)
    choice, full_scene = chooser.choose(), chooser.full_scenes[0]
    rest = full_scene.reduced(reduced_without(ride.scene, choice.left_out))
    two, deviation = Screen(full_scene.full, chooser.rows).certificate_sides(rest)
    chosen, none = frozenset(choice.left_out), frozenset[OmissibleEffect]()
    return JudgedChoice(
        ride,
        choice,
        float(abs(two / deviation - 1).max()),
        changes_by_frequency(chooser, choice) if with_frequency_responses else None,
        worst_nearby(chooser, chosen, NEARBY_SCENE_COUNT if chosen else 0, NEARBY_SCENE_COUNT),
        measured_step(chooser, chosen) / measured_step(chooser, none) if chosen else 1.0,
    )


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of forty scenes of random vehicles and speed ranges, and of the published half car. A quick run has two
    random scenes and the half car."""
    seeds = QUICK_SCENE_SEEDS if quick else range(SCENE_COUNT)
    choices = [
        judge_choice_for_ride(
            random_linear_ride(seed, COMMON_TOLERANCE if seed % 2 == 0 else None, with_details=seed % 4 != 0),
            quick or seed < FREQUENCY_JUDGED_COUNT,
        )
        for seed in seeds
    ]
    rows = [*_kept_tolerance_rows(choices), _adjoint_identity_row(choices), *_nearby_and_saving_rows(choices)]
    if not quick:
        rows += [_predicted_change_row(choices), _saving_row(choices), *_solved_equation_count_rows()]
    pair_rows, pair = _half_car_rows()
    return [*rows, *pair_rows, *_energy_activity_rows()], {
        "scenes": [_summary_of_choice(choice) for choice in choices],
        "pair": pair,
    }


def _kept_tolerance_rows(judged_choices: list[JudgedChoice]) -> list[Row]:
    """Rows: share of scenes whose tolerance is kept, and scenes for which the choice claims so wrongly."""
    share = float(np.mean([judged.effect_choice.within_tolerance for judged in judged_choices]))
    lies = sum(not judged.is_honest for judged in judged_choices)
    second = [judged for judged in judged_choices if judged.frequency_changes is not None]
    gap = max(float(abs(judged.frequency_changes - judged.effect_choice.confirmed_change).max()) for judged in second)
    return [
        Observed(
            "choice_linear.kept",
            SYSTEM,
            f"share of {len(judged_choices)} random scenes whose tolerance is kept after confirmation",
            share,
            "",
        ).within(1.0, 0.05, "asked: 95 of 100", "none"),
        behaviour_row(
            "choice_linear.honest",
            SYSTEM,
            "scenes that are reported as kept although another route shows that they are not",
            str(lies),
            "0",
            "never reported as kept when it is not",
            "native",
        ),
        Observed(
            "choice_linear.frequency",
            SYSTEM,
            "largest difference of confirmed changes from sums over frequencies of M, D and K with "
            f"singular mass, {len(second)} scenes",
            gap,
            "",
        ).at_most(1e-3, "what the frequency grid leaves", "native"),
    ]


def _predicted_change_row(judged_choices: list[JudgedChoice]) -> Row:
    """Row: share of predicted changes that are within a factor of 2 of the confirmed ones, over all choices and all
    quantities whose change is above rounding and below 5 %."""
    predicted, confirmed_ = (
        np.concatenate([getattr(judged.effect_choice, f"{stage}_change") for judged in judged_choices])
        for stage in STAGES_OF_CHANGE
    )
    is_judged = (abs(confirmed_) > JUDGED_CHANGE_RANGE[0]) & (abs(confirmed_) < JUDGED_CHANGE_RANGE[1])
    ratios = predicted[is_judged] / confirmed_[is_judged]
    share = float(np.mean((ratios >= 0.5) & (ratios <= 2.0)))
    return Observed(
        "choice_linear.predictions",
        SYSTEM,
        f"share of {len(ratios)} predicted changes below 5 % that are within a factor of 2 of the confirmed ones",
        share,
        "",
    ).within(
        1.0,
        0.05,
        "asked: within a factor of 2; where two larger changes cancel, what is left cannot be told that well",
        "none",
    )


def _adjoint_identity_row(judged_choices: list[JudgedChoice]) -> Row:
    """Row: largest error of the identity of covariance and adjoint over all scenes."""
    return Observed(
        "choice_linear.identity",
        SYSTEM,
        "difference of the variance of what is left, from the whole scene's covariance and the "
        "reduced adjoint, from the reduced covariance, worst of all scenes",
        max(judged.identity_error for judged in judged_choices),
        "",
    ).at_most(1e-12, "asked; an identity", "closed form")


def _nearby_and_saving_rows(judged_choices: list[JudgedChoice]) -> list[Row]:
    """Rows over all scenes: whether the tolerance also holds at other speeds and with changed parameters, and the
    saving. Both are computed by methods that the choice does not use."""
    told_in_advance = sum(
        bool(judged.effect_choice.refusal_texts) and not judged.effect_choice.left_out for judged in judged_choices
    )
    gaps = [abs(judged.force_call_saving / judged.sampled_saving - 1.0) for judged in judged_choices]
    saving = [judged for judged in judged_choices if judged.effect_choice.left_out]
    return [
        Observed(
            "choice_linear.nearby",
            SYSTEM,
            f"largest ratio of the change to the tolerance in {len(saving)} of {len(judged_choices)} scenes in "
            f"which effects were left out, {NEARBY_SCENE_COUNT} random speeds each, every mass, stiffness and "
            "damping up to 5 % off at random",
            max(judged.nearby_change_ratio for judged in judged_choices),
            "",
        ).at_most(1.0, "the tolerance holds nearby, too, or nothing is left out", "native"),
        Observed(
            "choice_linear.said",
            SYSTEM,
            f"share of {len(judged_choices)} scenes in which all effects that could go were refused with a reason",
            told_in_advance / len(judged_choices),
            "",
        ).at_most(0.1, "asked: at most a tenth", "none"),
        Observed(
            "choice_linear.equal_accuracy",
            SYSTEM,
            "difference of the printed saving in calls at equal accuracy from the covariance of what "
            f"runs sample, worst of {len(saving)} scenes",
            max(gaps),
            "",
        ).at_most(
            0.05,
            "asked; "
            "standard deviations within the tolerance of the whole scene's exact ones, by what is left out and by "
            "steps together",
            "closed form",
        ),
        behaviour_row(
            "choice_linear.saves",
            SYSTEM,
            "choices that leave effects out and save no calls",
            str(sum(judged.force_call_saving < 1.0 + EQUAL_COST_LOG for judged in saving)),
            "0",
            "what saves nothing stays in",
            "none",
        ),
    ]


def _saving_row(judged_choices: list[JudgedChoice]) -> Row:
    """Row: median saving of force calls over the scenes with the common tolerance."""
    saved = [judged.force_call_saving for judged in judged_choices if judged.ride.tolerance == COMMON_TOLERANCE]
    return Observed(
        "choice_linear.saving",
        SYSTEM,
        "ratio of calls of the whole scene to calls of what is left, at equal accuracy, median of "
        f"{len(saved)} scenes at 2 % (upper quartile {np.percentile(saved, 75):.3g})",
        float(np.median(saved)),
        "times",
    ).beside("", "it depends on what is asked of which vehicle: a wheel's force needs the wheel", "none")


def _solved_equation_count_rows() -> list[Row]:
    """Rows: numbers of eigenvalue problems and of Lyapunov equations that a choice solves for a car of 19 degrees of
    freedom, divided by the square of its number of effects."""
    chooser = Chooser.from_scene(car_scene())
    chooser.choose()
    pairs = len(chooser.effects) ** 2
    return [
        Observed(
            f"choice_linear.{name.replace(' ', '_')}",
            SYSTEM,
            f"{name} of a choice for a car of 19 degrees of freedom, by the square of its {len(chooser.effects)} "
            f"effects ({chooser.counts[name]:,})",
            chooser.counts[name] / pairs,
            "",
        ).at_most(most, why, "none")
        for name, most, why in (
            ("eigenvalue problems", 0.4, "each reduced vehicle is made once, and no effect is tried that breaks alone"),
            ("Lyapunov equations", 0.4, "no equation is solved for an effect that breaks alone, or for a refused set"),
        )
    ]


def _half_car_chooser() -> Chooser:
    """Chooser of effects for the published half car."""
    return Chooser.from_scene(load(HALF_CAR_SCENE))


def _half_car_rows() -> tuple[list[Row], dict[str, Any]]:
    """Rows on wheel mass and tyre damper of the published half car: leaving out the wheel mass alone spoils the result;
    leaving out both hardly changes it."""
    chooser = _half_car_chooser()
    choice = chooser.choose()
    named = {effect.name: effect for effect in choice.candidates}
    mass, damper = named["mass of all wheels"], named["tyre damping"]
    alone, both = chooser.confirmed_changes(frozenset([mass])), chooser.confirmed_changes(frozenset([mass, damper]))
    step = chooser.cost(frozenset([mass, damper])).step / chooser.cost(frozenset()).step
    return [
        behaviour_row(
            "choice_linear.pair.alone",
            SYSTEM,
            "change of the body acceleration by wheels without mass under damped tyres",
            "infinite" if np.isinf(alone[0]) else "finite",
            "infinite",
            "white noise reaches the body",
            "closed form",
        ),
        behaviour_row(
            "choice_linear.pair.chosen",
            SYSTEM,
            "both effects are left out at 3 %, each for the other's sake",
            "yes" if {mass, damper} <= set(choice.left_out) else "no",
            "yes",
            f"together they change body acceleration by {100 * both[0]:.2f} %",
            "none",
        ),
        Observed(
            "choice_linear.pair.step",
            SYSTEM,
            "ratio of the step limit with both effects left out to that of the whole scene",
            step,
            "times",
        ).within(691 / 24, 0.6, "published: 691 1/s fall to 24 1/s, as far as these digits go", "published"),
    ], {"alone": alone.tolist(), "both": both.tolist(), "step": step}


def _energy_activity_rows() -> list[Row]:
    """Rows: the pitch inertia has a large energy activity, yet locking the pitch does not change the bounce of a
    symmetric body."""
    chooser = _half_car_chooser()
    watts = activity_by_element(chooser.full_scenes[0])
    finite = {name: value for name, value in watts.items() if np.isfinite(value)}
    share = finite["inertia body ry"] / sum(finite.values())
    locked = next(effect for effect in chooser.effects if effect.name == "body ry")
    rest = chooser.full_scenes[0].reduced(reduced_without(chooser.scene, [locked]))
    change = float(np.sqrt(exact_variances(rest, chooser.rows)[0] / chooser.full[0][0]) - 1.0)
    return [
        Observed(
            "choice_linear.activity",
            SYSTEM,
            "share of the energy activity that the body's pitch inertia holds",
            share,
            "",
        ).beside(0.16, "published ranking, of a road whose details differ"),
        Observed(
            "choice_linear.activity.misleads",
            SYSTEM,
            "change of the body acceleration with the pitch locked",
            change,
            "",
        ).at_most(1e-12, "a symmetric body bounces without pitch, however active that is", "closed form"),
    ]


def _summary_of_choice(judged_choice: JudgedChoice) -> dict[str, Any]:
    """Numbers of a choice that the report's tables and figure need."""
    choice = judged_choice.effect_choice
    return {
        "tolerance": judged_choice.ride.tolerance,
        "predicted": choice.predicted_change.tolist(),
        "confirmed": choice.confirmed_change.tolist(),
        "saving": judged_choice.force_call_saving,
        "kept": choice.within_tolerance,
        "nearby": judged_choice.nearby_change_ratio,
        "measured": judged_choice.sampled_saving,
        "said": list(choice.refusal_texts),
        "left out": len(choice.left_out),
        "of": len(choice.candidates),
        "rounds": choice.confirmations,
    }


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of percentiles of the saving over all random scenes."""
    scenes = case_data["scenes"]
    saved = np.array([judged_choice["saving"] for judged_choice in scenes])
    rows = tuple((f"{share:g} %", f"{np.percentile(saved, share):.3g}") for share in (10, 25, 50, 75, 90))
    note = (
        f"Ratio of calls of the whole scene to calls of what is left, at equal accuracy, {len(scenes)} scenes with "
        "tolerances from 0.5 to 10 %."
    )
    return [Table("What choosing effects saves", note, ("percentile", "times fewer calls"), rows)]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot predicted over confirmed changes, and the saving in force calls over the tolerance."""
    from models.drawing.figures import BLUE, COLUMN_WIDTH, VERMILION, add_heading, subplots

    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8))
    predicted, confirmed_ = (
        100 * abs(np.array([v for judged_choice in case_data["scenes"] for v in judged_choice[key]]))
        for key in STAGES_OF_CHANGE
    )
    ends = np.array([1e-4, 12.0])
    left.fill_between(ends, ends / 2, ends * 2, color="#999999", alpha=0.25, label="factor 2")
    left.plot(confirmed_.clip(ends[0]), predicted.clip(ends[0]), "o", ms=4, color=BLUE, label="a quantity")
    left.set(
        xscale="log",
        yscale="log",
        xlabel="confirmed change [%] (at the end: smaller)",
        ylabel="predicted change [%]",
        title="All that was left out, together",
    )
    left.legend(loc="upper left")
    tolerance, saving = (
        np.array([judged_choice[key] for judged_choice in case_data["scenes"]]) for key in ("tolerance", "saving")
    )
    right.plot(100 * tolerance, saving, "o", ms=4, color=VERMILION)
    right.set(xscale="log", yscale="log", xlabel="tolerance [%]", ylabel="times fewer calls [-]", title="What it saves")
    add_heading(figure, "Choice in ride: changes as predicted and as confirmed, and calls saved")
    return [(FIGURE_CAPTION, figure)]


FIGURE_CAPTION = (
    "Random scenes of vehicles, most with stiff bushings and light parts on stiff mounts: what saves calls is left out "
    "as far as the tolerance allows, predicted from one covariance and one adjoint solve of the whole scene, and "
    "confirmed by the exact solve of what is left, between the speeds and with parameters off."
)
"""Caption of the figure."""
