"""From the grade of a gyro to damage: what the study's table must say, on a short run."""

from itertools import pairwise

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.strict import read
from models.core.systems import load
from models.drift.angle_damage import damage_at_angle_errors
from models.drift.score import SECTION_FORCE_CHANNELS, section_forces
from models.fatigue.damage import pseudo_damage
from models.sensors.inertial_unit import DEGREES_PER_HOUR, DEGREES_PER_ROOT_HOUR
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import build
from studies import inertial_unit as study
from studies.command.asked import SCENES_FOLDER

SHORT = ["run.duration=10.0", "options.samples=100", "options.durations=[1.0, 5.0]", "options.sampling_rate=10"]


def scene(*changes):
    return load(SCENES_FOLDER / "inertial_unit.toml", [*SHORT, *changes])


def options(own):
    return read(study.Options, own.options, own.file, "options")


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grades")
    return study.run(scene(), ("reference", "mujoco"), folder, lambda text, part: None), folder


def test_angles_follow_their_law(summary):
    found, _ = summary
    assert len(found["rows"]) == 10 and found["failed"] == {}
    for row in found["rows"]:
        # rms of 100 units: 99.9 % within 3.3 / sqrt(200), 23 %; all grades share their paths
        assert row["angle measured"] == pytest.approx(row["angle by law"], rel=0.23)


def test_a_worse_grade_and_a_longer_drive_do_more_harm(summary):
    sure = {(row["grade"], row["minutes"]): row["damage error"]["reference"][1] for row in summary[0]["rows"]}
    grades = sorted({grade for grade, _ in sure})
    assert all(sure[a, 5.0] < sure[b, 5.0] for a, b in pairwise(grades))
    assert all(sure[grade, 1.0] < sure[grade, 5.0] for grade in grades)


def test_engines_agree_on_the_damage(summary):
    for row in summary[0]["rows"]:
        both = row["damage error"]
        # states agree to 1e-9; a rainflow cycle that pairs otherwise at a tie costs less than this
        assert both["mujoco"] == pytest.approx(both["reference"], rel=1e-5)


def test_the_coarsest_grade_keeps_what_is_allowed(summary):
    found, folder = summary
    own = options(scene())
    for minutes, grade in found["cheapest"].items():
        rows = [row for row in found["rows"] if row["minutes"] == float(minutes)]
        at = {row["grade"]: row["damage error"]["reference"][1] for row in rows}
        assert at[grade] <= own.allowed_damage_error
        assert all(error > own.allowed_damage_error for other, error in at.items() if other > grade)
    impossible = own.model_copy(update={"allowed_damage_error": 1e-9})
    assert set(study.coarsest_sufficient_grade(found["rows"], impossible).values()) == {None}
    names = {path.name for path in folder.iterdir()}
    assert {"table.txt", "grades.png", "damage_of_an_angle.png", "mujoco.nc", "reference.nc"} == names


def test_a_drive_of_many_minutes_by_one_run_is_as_good_as_the_whole_drive():
    """24 runs end to end with an error that creeps to 0.03 rad: rainflow of all of it, against the average."""
    result = simulate(scene(), "reference")
    f3, f4, pitch = (np.tile(result[name], 24) for name in ("f3", "f4", "pitch"))
    error = np.linspace(0.0, 0.03, len(pitch))
    wrong, true = section_forces(f3, f4, pitch + error), section_forces(f3, f4, pitch)
    found = study.damage_errors(study.log_damage_over_pitch_error(result, 0.1), error[None, ::100])[0]
    ratio = np.array([pseudo_damage(wrong[name]) / pseudo_damage(true[name]) for name in SECTION_FORCE_CHANNELS])
    # f3x and f4x do 10 % and 115 % more damage; what is left falls as one over the number of runs
    assert 1 + found == pytest.approx(ratio, rel=0.01)
    assert ratio.max() > 2


def test_the_curve_between_its_nodes_is_a_count_of_damage():
    result = simulate(scene(), "reference")
    curve, true = study.log_damage_over_pitch_error(result, 0.3), np.array(damage_at_angle_errors(result, 0.0))
    for angle in (-0.21, -0.004, 3e-4, 0.017, 0.12):
        # a spline of 41 nodes over a count that is smooth but for cycles that change their partner
        assert np.exp(curve(angle)) == pytest.approx(np.array(damage_at_angle_errors(result, angle)) / true, rel=0.01)
    assert np.array_equal(curve(0.0), np.zeros(4))


def test_the_study_adds_what_the_effects_add():
    """Angle of one unit by the effects' own readings on a run, against the study's path."""
    own = options(scene("options.durations=[0.1, 0.2]", "options.seed=9"))
    walk, grade = 0.5, 10.0
    effects = {
        "gyro": {"sampling_rate": 10.0, "deviation": walk * DEGREES_PER_ROOT_HOUR * 10**0.5, "seed": 9, "path": 3},
        "gyro_bias": {"turn_on": 0.0, "instability": grade, "correlation_time": 3600.0, "seed": 9, "path": 3},
    }
    run = simulate(build({"title": "test", "run": {"duration": 10.0, "step": 1e-3}, "effects": effects}), "reference")
    error = (run["gyro"] - run["pitch_rate"])[:10_000:100].sum() / 10.0
    length = round(60 * own.durations[-1])
    paths = study.unit_angle_error_paths(own.samples, own.sampling_rate, length, own.correlation_time, own.seed)
    ours = walk * DEGREES_PER_ROOT_HOUR * paths[0][3, 10] + grade * DEGREES_PER_HOUR * paths[1][3, 10]
    assert ours == pytest.approx(error, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["options.random_walks=[0.1]"], "one value for each"),
        (["options.grades=[1.0, 0.1, 2.0, 3.0, 4.0]"], "must rise"),
        (["options.durations=[5.0, 1.0]"], "must rise"),
        (["options.durations=[-5.0]"], "must be 0.1 or more"),
        (["options.samples=2"], "samples"),
        (["options.sampling_rate=33.3"], "whole number"),
        (["options.grades=[]"], "at least 1 value"),
    ],
)
def test_lists_that_make_no_table_are_refused(changes, words, tmp_path):
    with pytest.raises(InputError, match=words):
        study.run(scene(*changes), ("reference",), tmp_path, lambda text, part: None)
    assert list(tmp_path.iterdir()) == []


def test_a_scene_without_a_road_or_without_motion_is_refused(tmp_path):
    own = {"durations": [1.0], "samples": 10, "sampling_rate": 1}
    table = {"title": "test", "study": "inertial_unit", "run": {"duration": 2.0, "step": 1e-3}, "options": own}
    with pytest.raises(InputError, match="needs a run on a road"):
        study.run(build(table), ("reference",), tmp_path, lambda text, part: None)
    with pytest.raises(InputError, match="no damage"):
        flat = build({**table, "effects": {"road": {"source": "study", "speed": 1e-9}}})
        study.run(flat, ("reference",), tmp_path, lambda text, part: None)
