"""Hard cases of drift: drifted runs that look right by a wrong figure, and damage of invalid loads."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from models.core.result import Result
from models.drift.growth import drift_off_time
from models.drift.score import (
    AcceptanceLimits,
    RunErrors,
    RunFigures,
    errors_of_run,
    figures_of_run,
    verdict_on_run,
    verdict_without_true_run,
)
from models.engines.assembly import Settings
from models.fatigue.damage import damage_ratio, pseudo_damage
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation.common.scenes import STUDY_ROAD, force_scene, road_scene
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import REFUSED, largest_magnitude

DURATION = 8.0
WRONG_PITCH_RATE = 0.1
"""Error (rad/s) of a drifted run's initial pitch rate; at a growth rate of 0.4 1/s it turns over in 8 s."""
SOFT_STIFFNESS = 50.0
"""Stiffness (N m/rad) of a pitch spring that is too soft; 82 are needed on this road."""
DRIFTED_PITCH = 0.05
"""Pitch error (rad) beyond which runs are not compared."""
HEAVY_FORCE_NOISE = 300.0
"""Standard deviation (N) of force noise with which a run drifts off after some seconds."""


@cache
def true_run(road_grade: float = 0.0) -> Result:
    """Virtual measurement on the study road with a grade (rad): the true run."""
    road = STUDY_ROAD | ({"grade": road_grade} if road_grade else {})
    return simulate(road_scene(duration=DURATION, road=road), "reference")


def scene_on_true_forces(
    work_folder: Path, true_result: Result, effects: dict[str, Any] | None = None, start_pitch_rate: float = 0.0
) -> Scene:
    """Scene under the wheel forces of the true run, with a wrong initial pitch rate ``start_pitch_rate`` (rad/s)."""
    write_measurement(true_result, work_folder, 1e-3)
    scene = force_scene(work_folder, duration=DURATION, effects=effects)
    return scene.model_copy(update={"start": {"pitch_rate": start_pitch_rate}} if start_pitch_rate else {})


def run_figures_and_errors(disturbed_run: Result, true_result: Result, scene: Scene) -> tuple[RunFigures, RunErrors]:
    """Figures of a run that can be computed without the true run, and errors of the run against the true run."""
    return figures_of_run(disturbed_run, scene.vehicle_parameters()), errors_of_run(disturbed_run, true_result)


def run_verdict_words(engine_name: str, scene: Scene, true_result: Result) -> tuple[str, str]:
    """Words of the verdicts on a run in an engine, with and without knowledge of the true run."""
    scores, wrong = run_figures_and_errors(simulate(scene, engine_name), true_result, scene)
    known = verdict_without_true_run(scores, scene.effects, DURATION, AcceptanceLimits())
    return verdict_on_run(scores, wrong, scene.effects, AcceptanceLimits()).word, known.word


def tumbled_verdict_error(engine_name: str, work_folder: Path) -> float:
    """Case: a free run that has turned over must be rejected, with and without the true run. Error: 1 if it is not."""
    judged = run_verdict_words(
        engine_name, scene_on_true_forces(work_folder, true_run(), start_pitch_rate=WRONG_PITCH_RATE), true_run()
    )
    return float(judged != ("rejected", "rejected"))


def tumbled_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: damage of a tumbled run from its vertical forces alone."""
    scene = scene_on_true_forces(work_folder, true_run(), start_pitch_rate=WRONG_PITCH_RATE)
    scores, wrong = run_figures_and_errors(simulate(scene, "reference"), true_run(), scene)
    return (
        f"at a pitch of {scores.pitch_max:.1f} rad its vertical f3 does {wrong.vertical_damage['f3']:.3f} times the "
        f"true damage, its f3 along the chassis {wrong.damage['f3x']:.0e} times"
    )


SOFT_SPRING = {"pitch_spring": {"stiffness": SOFT_STIFFNESS, "damping": 250.0}}
FIRM_SPRING = {"pitch_spring": {"stiffness": 300.0, "damping": 600.0}}


def soft_spring_verdict_error(engine_name: str, work_folder: Path) -> float:
    """Case: a run with a stabilising spring that is too soft must be rejected. Error: 1 if it is not."""
    return float(
        run_verdict_words(
            engine_name, scene_on_true_forces(work_folder, true_run(), SOFT_SPRING, WRONG_PITCH_RATE), true_run()
        )[0]
        != "rejected"
    )


def soft_spring_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: figures of the run itself, which do not show that the spring is too soft."""
    scene = scene_on_true_forces(work_folder, true_run(), SOFT_SPRING, WRONG_PITCH_RATE)
    scores, wrong = run_figures_and_errors(simulate(scene, "reference"), true_run(), scene)
    return (
        f"its artificial moment is {scores.moment_share_band:.1%} of I pitch'' and its vertical f3 does "
        f"{wrong.vertical_damage['f3']:.3f} times the true damage; its pitch is {wrong.pitch_max:.2f} rad wrong"
    )


def graded_verdict_error(engine_name: str, work_folder: Path) -> float:
    """Case: a stabilising spring on a grade, which gives wrong results. Error: 0 if the run is rejected with the true
    run and not accepted without it, else 1."""
    judged = run_verdict_words(
        engine_name, scene_on_true_forces(work_folder, true_run(0.1), FIRM_SPRING), true_run(0.1)
    )
    return float(judged != ("rejected", "stabilise"))


def graded_naive_result(work_folder: Path) -> str:
    """Figures of a run with a stabilising spring on a graded road, as text."""
    scene = scene_on_true_forces(work_folder, true_run(0.1), FIRM_SPRING)
    scores, wrong = run_figures_and_errors(simulate(scene, "reference"), true_run(0.1), scene)
    return (
        f"its artificial moment is {scores.moment_share_band:.1%} of I pitch''; its pitch is {wrong.pitch_max:.2f} "
        f"rad wrong, f3 along the chassis does {wrong.damage['f3x']:.2f} times the true damage"
    )


@cache
def random_walk_load() -> np.ndarray:
    """Load (500,) that is a random walk with steps of standard deviation 1, with a fixed seed."""
    return np.random.default_rng(2).standard_normal(500).cumsum()


def damage_with_nan(engine_name: str, work_folder: Path) -> float:
    """Case: a load with one sample that is NaN must be refused. Error: the damage that is returned."""
    load = random_walk_load().copy()
    load[250] = np.nan
    return pseudo_damage(load)


def damage_with_nan_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: damage of a load with a NaN by the rainflow library."""
    from rainflow import extract_cycles

    load = random_walk_load().copy()
    load[250] = np.nan
    damage = sum(count * span**5 for span, _, count, _, _ in extract_cycles(load.tolist()))
    return f"rainflow alone finds {damage / pseudo_damage(random_walk_load()):.2g} times the damage of the whole load"


def damage_without_samples(engine_name: str, work_folder: Path) -> float:
    """Case: a load without samples must be refused. Error: the damage that is returned."""
    return pseudo_damage(np.empty(0))


def ratio_to_constant_load(engine_name: str, work_folder: Path) -> float:
    """Case: a damage ratio to a constant true load, which has no damage, must be refused. Error: the ratio that is
    returned."""
    return damage_ratio(random_walk_load(), np.full(500, 3.0))


def ratio_of_huge_loads(engine_name: str, work_folder: Path) -> float:
    """Case: a ratio of two damages beyond the range of floating-point numbers must be refused. Error: the ratio that is
    returned."""
    load = np.array([0.0, 1e200, 0.0])
    return damage_ratio(load, load)


def damage_with_nan_slope(engine_name: str, work_folder: Path) -> float:
    """Case: a Wöhler slope that is NaN, which a range of 1 would hide, must be refused. Error: the damage that is
    returned."""
    return pseudo_damage(np.array([0.0, 1.0, 0.0]), np.nan)


def negative_intensity_drift_off(engine_name: str, work_folder: Path) -> float:
    """Case: drift-off time under noise of negative intensity must be refused. Error: the time that is returned."""
    return drift_off_time(1.0, -1.0, 0.05)


def two_point_damage_error(engine_name: str, work_folder: Path) -> float:
    """Case: a load with two samples, which is half a cycle. Error: difference of its damage from 0.5 range^5."""
    return abs(pseudo_damage(np.array([0.0, 2.0]), 5.0) - 0.5 * 2.0**5)


def two_points_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: damage of a load with two samples by the rainflow library."""
    from rainflow import extract_cycles

    return f"rainflow alone finds {len(list(extract_cycles([0.0, 2.0])))} cycles in it"


def difference_before_drift(engine_name: str, work_folder: Path) -> float:
    """Case: a noisy run compared with another implementation until drift-off. Error: largest difference of the states
    divided by the largest state."""
    scene = scene_on_true_forces(work_folder, true_run(), {"force_noise": {"deviation": HEAVY_FORCE_NOISE}})
    other_engine = "mujoco" if engine_name == "reference" else "reference"
    first, second_run = (simulate(scene, name) for name in (engine_name, other_engine))
    rows_before = slice(None, _first_drifted_row(first, true_run()))
    return largest_magnitude(first.states[rows_before] - second_run.states[rows_before]) / largest_magnitude(
        second_run.states[rows_before]
    )


def _first_drifted_row(disturbed_run: Result, true_result: Result) -> int | None:
    """First row at which the pitch of a run differs from the true pitch by more than DRIFTED_PITCH; None if it never
    does."""
    far = np.flatnonzero(np.abs(disturbed_run["pitch"] - true_result["pitch"]) > DRIFTED_PITCH)
    return int(far[0]) if len(far) else None


def before_drift_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: two step sizes of the reference compared over 30 s, beyond drift-off."""
    truth = simulate(road_scene(duration=30.0), "reference")
    write_measurement(truth, work_folder, 1e-3)
    scene = force_scene(work_folder, duration=30.0, effects={"force_noise": {"deviation": HEAVY_FORCE_NOISE}})
    coarse, fine = (simulate(scene, "reference", Settings("RK4", step, 30.0)) for step in (1e-3, 5e-4))
    gap = np.abs(coarse["pitch"] - fine["pitch"][::2])
    gap_before = gap[: _first_drifted_row(coarse, truth)].max()
    return f"two step sizes of the reference differ by {gap_before:.0e} rad before, {gap.max():.0e} after"


CASES = (
    HardCase(
        "drifted run scored by its vertical forces",
        "the vertical force is the same at every pitch",
        "rejected with the truth and without it",
        "wrong verdicts",
        0.0,
        "a word is right or wrong",
        tumbled_verdict_error,
        naive_result=tumbled_naive_result,
    ),
    HardCase(
        "spring below the smallest that holds",
        "it is a stabiliser, and the vehicle drifts all the same",
        "rejected",
        "wrong verdicts",
        0.0,
        "a word is right or wrong",
        soft_spring_verdict_error,
        naive_result=soft_spring_naive_result,
    ),
    HardCase(
        "spring on a grade",
        "keeping the pitch near zero is wrong there, and no figure of the run shows it",
        "rejected with the truth; without it never accepted",
        "wrong verdicts",
        0.0,
        "a word is right or wrong",
        graded_verdict_error,
        naive_result=graded_naive_result,
    ),
    HardCase(
        "load with a value that is not a number",
        "rainflow compares, and every comparison with it is false",
        "refused",
        "N^5",
        0.0,
        "no damage is right",
        damage_with_nan,
        REFUSED,
        damage_with_nan_naive_result,
    ),
    HardCase(
        "load without a sample",
        "no cycle, but no measurement either",
        "refused",
        "N^5",
        0.0,
        "no damage is right",
        damage_without_samples,
        REFUSED,
    ),
    HardCase(
        "load beyond all numbers",
        "inf / inf is not a number, and a table shows it as a ratio",
        "refused",
        "",
        0.0,
        "there is no answer",
        ratio_of_huge_loads,
        REFUSED,
        is_without_engine=True,
    ),
    HardCase(
        "Woehler exponent that is no number",
        "1 to any power is 1",
        "refused",
        "",
        0.0,
        "there is no answer",
        damage_with_nan_slope,
        REFUSED,
        is_without_engine=True,
    ),
    HardCase(
        "drift-off by noise of negative intensity",
        "a root is found where none has a meaning",
        "refused",
        "",
        0.0,
        "there is no answer",
        negative_intensity_drift_off,
        REFUSED,
        is_without_engine=True,
    ),
    HardCase(
        "true load that never varies",
        "its damage is 0, by which the ratio would divide",
        "refused",
        "",
        0.0,
        "no ratio is right",
        ratio_to_constant_load,
        REFUSED,
    ),
    HardCase(
        "load of a single rise",
        "two turning points make half a cycle",
        "half of range^5",
        "N^5",
        0.0,
        "exact in doubles",
        two_point_damage_error,
        naive_result=two_points_naive_result,
    ),
    HardCase(
        "engines compared up to the drift-off",
        "errors grow without bound, rounding among them: beyond the drift-off a difference says nothing of an engine",
        "another implementation, same noise file",
        "of the largest state",
        1e-9,
        "rounding of 1e-15 to 1e-13 that grows by less than 100",
        difference_before_drift,
        naive_result=before_drift_naive_result,
        answer_independence="native",
    ),
)
