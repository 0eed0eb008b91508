"""Effects of virtual transducers, each left out and put in by itself; what a price and a choice see of a recording."""

import json

import numpy as np
import pytest

from models.advice.choice.choose import EffectChooser
from models.advice.choice.systems import measured
from models.advice.choice.variants import Variants
from models.core.errors import InputError
from models.core.result import load_result
from models.core.scene_effects import absent_effects, named_effects, scene_without, with_effects
from models.core.systems import load
from models.measured.columns import SampleFile
from models.systems import run
from models.systems.measured.scene import build
from studies.command.asked import SCENES_FOLDER
from validation.absence.measured import FAULTS, write
from validation.absence.of_systems import bare_scene


def test_each_fault_of_transducers_comes_and_goes_alone():
    scene = load(SCENES_FOLDER / "recording.toml")
    assert "sensor_noise" in named_effects(scene) and {*FAULTS} - {"sensor_noise"} <= {*absent_effects(scene)}
    full = with_effects(scene, *(name for name in FAULTS if name != "sensor_noise"))
    for name in FAULTS:
        assert {*named_effects(full)} - {*named_effects(scene_without(full, name))} == {name}
    assert scene_without(full, *FAULTS).virtual.faults == type(full.virtual.faults)()  # nothing of any is left


@pytest.mark.parametrize("name", FAULTS)
def test_files_have_the_faults_that_they_have(name):
    with pytest.raises(InputError, match=r"virtual.faults.* needs a table \[virtual\], for files have the faults"):
        with_effects(bare_scene("measured"), name)


def short(**more):
    table = {
        "title": "t",
        "system": "measured",
        "vehicle": {"file": "r19_free"},
        "stabilise": {"method": "none"},
        "virtual": {"duration": 0.18, "format": "csv", "faults": FAULTS["sensor_noise"]},
    }
    return build(table | more, "s.toml")


def test_a_price_and_a_choice_see_what_a_fault_changes_in_the_answers():
    noisy = short()
    told = [
        measured.computed_quantities(own, "mujoco")
        for own in (noisy, scene_without(noisy, "sensor_noise"), with_effects(noisy, "offsets"))
    ]
    seats = [one.quantities["left seat F"].case_values[0] for one in told]
    assert len(seats[0]) == 181 and told[0].counts["steps"] == measured.step_count(noisy) == 180
    assert len({seat.tobytes() for seat in seats}) == 3


def test_a_recording_is_run_as_every_scene_is_and_its_result_says_where_its_samples_lie(tmp_path):
    scene = short()
    result = run(scene, "mujoco", folder=tmp_path)
    exam = result.detail
    seat = next(answer for answer in exam.outcome.answers if answer.name == "left seat F")
    assert np.array_equal(result["left seat F"], exam.outcome.samples(seat))
    result.save(tmp_path / "a.nc")
    saved = load_result(tmp_path / "a.nc").data
    assert np.array_equal(saved["left seat F"].values, result["left seat F"]) and saved["left seat F"].units == "N"
    assert json.loads(saved.scene_table) == scene.table() and "commit" in json.loads(saved.provenance)
    names = tuple(json.loads(saved.columns_of))
    columns = SampleFile(tmp_path / saved.attrs["columns"], names, len(result.times))
    assert np.array_equal(columns.read("left seat F"), result["left seat F"])
    assert result.counts()["force calls"] == 4 * result.counts()["steps"] == 720


def test_a_recording_is_run_for_a_part_and_in_longer_steps(tmp_path, monkeypatch):
    monkeypatch.setattr("validation.absence.measured.SAMPLE_COUNT", 201)
    write(tmp_path)
    of_files = build(bare_scene("measured").table() | {"stabilise": {"method": "none"}}, "s.toml", tmp_path)
    for own, steps in ((short(), 180), (of_files, 200)):
        whole = Variants(own, "mujoco")
        part = whole.window(20)
        assert measured.step_count(own) == steps and measured.step_count(part.scene) == 120  # at least 100 samples
        assert whole.quantities_of_run(step_factor=2).counts["steps"] == steps // 2
        paths = [one.quantities_of_run().quantities["body z"].case_values[0] for one in (whole, part)]
        assert len(paths[1]) == 121 and abs(paths[0][:115] - paths[1][:115]).max() < 1e-12 * abs(paths[0]).max()


def test_the_pitch_plane_is_told_what_has_a_price():
    scene = build(
        {
            "title": "t",
            "system": "measured",
            "vehicle": {"parameters": "itwm_drift"},
            "files": bare_scene("measured").table()["files"],
        },
        "s.toml",
    )
    with pytest.raises(InputError, match=r"vehicle.parameters.* for a vehicle in space: name vehicle.file"):
        measured.computed_quantities(scene, "mujoco")


@pytest.mark.full
def test_auto_leaves_out_what_the_question_does_not_see():
    """The noise of angles is read by nothing in a free run; steps stay whole samples of the recording."""
    faults = {"noise": {"angle": 1e-3}}
    scene = short(
        stabilise={"method": "none"},
        effects="auto",
        quantities=["rms front left F"],
        tolerance=0.02,
        virtual={"duration": 0.18, "format": "csv", "faults": faults},
    )
    choice = EffectChooser(scene, "mujoco", scene.quantities, scene.tolerance).choose()
    assert choice.left_out == ("sensor_noise",) and choice.within_tolerance


def test_a_stabiliser_leaves_for_none_as_the_other_one_costs_more():
    for name in ("kalman_filter", "prescribed_angles"):
        assert scene_without(with_effects(short(), name), name).stabilise.method == "none"
