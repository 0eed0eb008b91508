"""The study of a tyre: its figures, its CSV read again, and rear tyres and files in scenes of braking."""

import json

import pytest

from models.core.errors import InputError
from models.systems.braking.of_scene import braked_vehicle, tyre_table_of
from models.systems.braking.scene import build
from models.tyre.tyre_file import tyre_table

SCENE = {"title": "t", "system": "braking", "procedures": {"straight": {}}}


def test_the_study_draws_a_tyre_and_writes_it_as_a_table_that_a_scene_takes(tmp_path):
    from studies.tyre import run

    scene = build({**SCENE, "study": "tyre", "road": {"stretches": [{"left": "ice"}]}}, "s.toml", tmp_path)
    answer = run(scene, (), tmp_path, lambda what, share: None)["answer"]["ice"]
    json.dumps(answer)
    assert answer["peak along"] == pytest.approx(0.172, abs=1e-4)
    assert answer["slope [1/%]"] == pytest.approx(0.172 * 31.1 * 1.77 / 100, rel=0.01)  # B C D
    assert answer["slope [1/deg]"] == pytest.approx(0.162 * 28.4 * 1.48 * 0.0174533, rel=0.01)
    assert (tmp_path / "tyre.png").stat().st_size > 10_000
    again = tyre_table(tmp_path / "ice.csv").friction([0.0], [0.055], 2e4)[0][0, 0]
    assert again == tyre_table_of(scene, "ice").friction([0.0], [0.055], 1e4)[0][0, 0]
    mine = build(
        {
            **SCENE,
            "road": {"stretches": [{"left": "mine"}]},
            "tyres": {"files": {"mine": "ice.csv"}, "scale": {"mine": 0.5}},
        },
        "s.toml",
        tmp_path,
    )
    assert tyre_table_of(mine, "mine").mu_x.max() == pytest.approx(0.086, abs=1e-4)


def test_rear_wheels_have_tyres_of_their_own_where_asked(tmp_path):
    scene = build({**SCENE, "tyres": {"own_rear": True}}, "s.toml", tmp_path)
    vehicle = braked_vehicle(scene, scene.procedures["straight"])
    assert vehicle.kind.tolist() == [0, 0, 1, 1] and vehicle.road.kinds == 2
    assert vehicle.tables.mu_x.max(axis=(1, 2, 3)) == pytest.approx([0.172, 0.173], abs=1e-4)


@pytest.mark.parametrize(
    ("tyres", "said"),
    [
        ({"files": {"ice": "no.csv"}}, r"s.toml: tyres.files.ice = 'no.csv': no such file"),
        ({"files": {"ice": "a.txt"}}, r"a.txt = '.txt': is no file of a tyre \(allowed: .csv, .tir\)"),
        ({"scale": {"ice": 3.0}}, r"tyres.scale.ice = 3.0: must be above 0"),
    ],
)
def test_tyres_that_cannot_be_are_told(tmp_path, tyres, said):
    (tmp_path / "a.txt").write_text("x\n")
    with pytest.raises(InputError, match=said):
        tyre_table_of(build({**SCENE, "tyres": tyres}, "s.toml", tmp_path), "ice")
