"""The price of accuracy of scenes of a wheelset, of handling and of braking: recommended, refused, held."""

from importlib import import_module
from pathlib import Path

import pytest

from models.advice.price.meshed import MeshedScene, duration_of_first_part
from models.advice.price.problem import Setting
from models.advice.price.recommendation import price, priced_scene, recommend
from models.advice.price.text import recommendation_lines
from models.core.errors import InputError, RunFailed
from models.core.systems import SYSTEMS, load
from studies.command.asked import SCENES_FOLDER

STOP = {
    "title": "a stop",
    "system": "braking",
    "pressure": {},
    "load_transfer": {},
    "controller": {"kind": "slip_bang_bang"},
    "road": {"stretches": [{"left": "wet"}]},
    "procedures": {"turned": {"kind": "j_turn", "speed": 4.0, "steer": 0.03}, "ahead": {"speed": 4.0}},
}
PATHS = {
    "title": "a path",
    "system": "wheelset",
    "speeds": {"values": [10.0]},
    "contact": {"law": "linear"},
    "run": {"duration": 0.05, "step": 5e-4, "speeds": [20.0]},
}


def scene_of(table):
    return import_module(SYSTEMS[table["system"]].scene).build(table, "own.toml", Path())


def own(table, quantity=None, engines=("reference",)):
    return priced_scene(scene_of(table), quantity, engines)


@pytest.mark.full
def test_a_stop_is_held_to_its_tolerance_with_as_few_steps_as_that_takes():
    found = recommend(own(STOP), 1e-5)
    best = found.winners["", "calls"]
    coarser = [one for one in found.tried if one.setting.value > best.tried.setting.value]
    assert coarser and all(one.error > 0.95e-5 for one in coarser)
    exact = found.scene.priced_run(found.scene.solve(Setting("reference", "exact wheel", 5.5e-3 / 500, 1), 30.0))
    # 500 substeps, none of the search's own: what is left is the error of the truth, 1/20 of the tolerance or less
    assert found.truth.error(exact) < 1e-6 and best.error <= 1e-5
    text = "\n".join(recommendation_lines(found))
    assert "substeps = " in text and "procedure turned; of another one by --quantity ahead.stopping_distance" in text


def test_a_path_with_linear_creep_is_held_by_steps_alone():
    scene = own(PATHS)
    found = recommend(scene, 1e-9)
    assert found.winners["", "calls"].error <= 1e-9 and scene.work_count_name == "force calls"
    assert "DOP853" in found.search_truth.origin  # another family has said the same


def test_more_cells_come_nearer_and_are_counted():
    scene = own({**PATHS, "contact": {"law": "fastsim"}}, "fy")
    ladder = next(one for one in scene.setting_ladders() if one.default)
    coarse, fine, exact = (
        scene.priced_run(scene.solve(ladder.setting(ladder.values.index(1.0 / n)), 0.05)) for n in (5, 11, 45)
    )
    gaps = [abs(one.values - exact.values).max() for one in (coarse, fine)]
    assert gaps[1] < 0.6 * gaps[0]  # of second order but for the kinks between slip and stick: 0.2 at best
    assert fine.counts["contact cells"] == 121 * fine.counts["force calls"]
    assert ladder.work(1.0 / 11.0, 1.0 / 22.0) == pytest.approx(4.0)


def test_steps_divide_what_is_searched():
    scene = own(PATHS)
    assert isinstance(scene, MeshedScene) and duration_of_first_part(3.0, 0.25) == 0.25
    assert all(
        abs(scene.searched_duration / step - round(scene.searched_duration / step)) < 1e-9
        for step in scene.steps.values()
    )


@pytest.mark.parametrize(
    ("table", "quantity", "message"),
    [
        (STOP, "sideways.yaw", "names no procedure of this scene"),
        (STOP, "ahead.load", "is no quantity of this scene"),
        (PATHS, "f1,f2", "is no quantity of this scene"),
        ({**STOP, "controller": {}, "port": {"callable": "mine:Own"}}, None, "cannot be priced"),
    ],
)
def test_what_cannot_be_asked_is_one_message(table, quantity, message):
    with pytest.raises(InputError, match=message):
        price(scene_of(table), 1e-3, quantity, ("reference",))


@pytest.mark.full
def test_a_tolerance_above_the_quantity_itself_is_doubted():
    told, quiet = (
        "\n".join(recommendation_lines(recommend(own(STOP, "turned.yaw"), tolerance))) for tolerance in (1e3, 1e-3)
    )
    assert "DOUBT: yaw is at most" in told and "DOUBT" not in quiet


def test_a_vehicle_that_does_not_stop_has_no_price():
    with pytest.raises(RunFailed, match="does not stand after"):
        recommend(own({**STOP, "run": {"duration": 0.2}}), 1e-2)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("ride", "covariances, which have no step"),
        ("hub_forces", r"study = .choice."),
        ("recording", "samples of its files"),
    ],
)
def test_systems_without_a_price_of_steps_say_why(name, why):
    with pytest.raises(InputError, match=why):
        price(load(SCENES_FOLDER / f"{name}.toml"), 1.0, None, ("reference",))
