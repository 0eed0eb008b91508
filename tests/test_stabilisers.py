"""The study that compares stabilisers, on a short scene: its table, its figures, and what it refuses."""

import csv

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.systems import load
from models.systems.pitch_plane.stabilised import StabiliserBench, StabiliserOptions
from studies.command.asked import SCENES_FOLDER
from studies.stabilisers import run

SHORT = ["run.duration=5.0", "options.stiffnesses=[300.0]", "options.cut_offs=[0.1]", "options.sweep=[50.0, 3e3]"]


def quiet(text, part):
    assert 0.0 <= part <= 1.0


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stabilisers")
    return run(load(SCENES_FOLDER / "stabilisers.toml", SHORT), ("reference", "mujoco"), folder, quiet), folder


def of(summary, method, road="road", engine="reference"):
    return next(
        row for row in summary[0]["rows"] if (row["method"], row["road"], row["engine"]) == (method, road, engine)
    )


def test_what_knows_the_pitch_is_accepted_on_both_roads_in_both_engines(summary):
    for place in (("road", "reference"), ("road", "mujoco"), ("grade", "reference")):
        for method in ("exact pitch prescribed", "Kalman filter"):
            row = of(summary, method, *place)
            assert (row["verdict"], row["without truth"]) == ("accepted", "accepted")


def test_a_filter_that_is_sure_of_a_wrong_model_is_unmasked_without_the_truth(summary):
    row = of(summary, "Kalman, sure of the model")
    assert row["without truth"] == "rejected" and "NIS" in row["reason without truth"]


def test_springs_and_high_pass_are_wrong_on_the_grade(summary):
    for method in ("spring 300 N m/rad", "300 beyond 0.05 rad", "high-pass 0.1 Hz"):
        row = of(summary, method, "grade")
        # 5 s end at 100 m, 20 m beyond the transition: the true pitch is about 0.1 rad, theirs is not
        assert row["verdict"] == "rejected" and row["pitch error max [rad]"] > 0.05
        assert abs(row["vertical damage f3"] - 1) < 0.05  # the vertical force sees nothing


def test_other_engines_run_what_is_accepted(summary):
    rows = summary[0]["rows"]
    accepted = {
        row["method"]
        for row in rows
        if row["road"] == "road" and row["engine"] == "reference" and row["verdict"] == "accepted"
    }
    assert {row["method"] for row in rows if row["engine"] == "mujoco"} == {"free"} | accepted
    for method in accepted - {"free"}:
        one, other = of(summary, method), of(summary, method, engine="mujoco")
        # the same equations at the same steps, before any drift: rounding, and 1e-6 by prescribed accelerations
        assert one["damage f3x"] == pytest.approx(other["damage f3x"], rel=1e-4)


def test_spring_and_high_pass_of_the_sweep_are_the_same(summary):
    for found in summary[0]["sweep"].values():
        table = np.array(found)
        np.testing.assert_allclose(table[:, 1], table[:, 2], rtol=1e-3)  # growing rounding, where the run tumbles


def test_the_files_that_a_user_gets_are_there(summary):
    found, folder = summary
    names = {str(path.relative_to(folder)) for path in folder.rglob("*.*")}
    assert {
        "table.txt",
        "score.csv",
        "decide.png",
        "stiffness.png",
        "road/wheel_forces.csv",
        "road/measured_pitch.csv",
        "grade/heave_and_pitch.csv",
    } <= names
    assert found["failed"] == {} and found["table"] == (folder / "table.txt").read_text().splitlines()
    with (folder / "score.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(found["rows"])
    assert max(len(line) for line in found["table"]) < 160


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("options.factors={J = 1.1}", "not a parameter"),
        ("options.stiffnesses=[0.0]", "above 0"),
        ("options.cut_offs=[-1.0]", "above 0"),
        ("options.limits.damage=0.1", "damage_error"),
        ("options.grade=0.7", "grade"),
        ("effects.road.grade=0.1", "drop this key"),
        ("effects.pitch_spring.stiffness=2e5", "drop it"),
        ("run.output_step=0.01", "drop this key"),
        ("options.sampling_rate=700.0", "sampling_rate"),
        ("engines.exudyn.step=5e-4", r"engines\.exudyn\.step.*drop this key"),
        ("run.duration=0.05", "100 steps or more"),
    ],
)
def test_what_the_study_cannot_follow_is_refused_before_it_writes(change, words, tmp_path):
    with pytest.raises(InputError, match=words):
        run(load(SCENES_FOLDER / "stabilisers.toml", [change]), ("exudyn",), tmp_path, quiet)
    assert list(tmp_path.iterdir()) == []


def test_a_linear_vehicle_needs_no_spring(tmp_path):
    """Linearised, nothing grows: no stiffness is needed, and noise alone ends the trust in a free run."""
    scene = load(SCENES_FOLDER / "stabilisers.toml", [*SHORT, "vehicle.geometry=linear"])
    bench = StabiliserBench(scene, "road", StabiliserOptions(), tmp_path)
    assert bench.holding == 0.0 and 0.0 < bench.trusted <= 5.0
