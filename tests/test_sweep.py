"""Sweeps of a key: values as written, numbers by name, points as single runs, resumed to the same bytes."""

import pytest

from models.core.errors import InputError
from models.core.scene_file import changed_tables
from models.ensemble.store import named_files
from studies.command.summary_numbers import summary_scalars
from studies.command.sweep import parse_range

CONTACT = """
title = "A contact"
system = "contact"
study = "contact"
ellipse = { a = 5e-3, b = 4e-3 }
contact = { load = 1e5, friction = 0.3 }
creepage = { xi_x = 1e-3 }
method = { name = "linear" }
"""


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("k=1:3:3", (1, 2, 3)),
        ("k=1:2:3", (1.0, 1.5, 2.0)),
        ("k=2e-4:1e-4:2", (2e-4, 1e-4)),
        ("k=1.0:3:3", (1.0, 2.0, 3.0)),
        ("k=1,2.5", (1, 2.5)),
        ("a.b = exact, linear", ("exact", "linear")),
        ('k="x,y","z"', ("x,y", "z")),
        ("k=[1,2],[3,4]", ([1, 2], [3, 4])),
        ("k=true,false", (True, False)),
        ("k=Straße,\U0001f600", ("Straße", "\U0001f600")),
    ],
    ids=str,
)
def test_values_are_read_as_a_scene_would(text, values):
    key, found = parse_range(text)
    assert key == text.partition("=")[0].strip() and found == values
    assert [type(one) for one in found] == [type(one) for one in values]


@pytest.mark.parametrize(
    "text",
    [
        "k",
        "=1:2:3",
        "k=",
        "k=1:2:x",
        "k=a:2:3",
        "k=1:2:1",
        "k=1:inf:3",
        "k=1:2:99999",
        "k=1",
        "k=1,1",
        "k=1:1:3",
        "k=nan,1",
        "k=inf,1",
        "k=2026-01-01,2",
        "k={a=1},{a=2}",
    ],
)
def test_what_is_no_sweep_is_refused(text):
    with pytest.raises(InputError, match="--sweep"):
        parse_range(text)


def test_numbers_of_a_summary_have_names_and_units():
    summary = {
        "scene": "s",
        "seconds": 3.0,
        "answer": {"pitch": {"unit": "rad", "max": 0.5, "rms": float("nan")}},
        "rows": [{"method": "free", "x": 1, "seconds": 2.0}, {"method": "held", "x": 2, "good": True}],
        "pair": [3.0, 4.0],
        "curve": [3.0, -4.0] * 5,
        "branch": [{"v": float(i)} for i in range(10)],
    }
    assert summary_scalars(summary) == {
        "pitch, max [rad]": 0.5,
        "free, x": 1,
        "held, x": 2,
        "pair, 1": 3.0,
        "pair, 2": 4.0,
        "curve, largest": 4.0,
        "curve, rms": pytest.approx(12.5**0.5),
        "branch, v, largest": 9.0,
        "branch, v, rms": pytest.approx(28.5**0.5),
    }


def test_a_key_counts_the_entries_of_lists_from_nought(tmp_path):
    scene = tmp_path / "mine.toml"
    scene.write_text('title = "mine"\nroad = [{ left = "ice" }, { left = "snow", at = [1, 2] }]\n')
    found = changed_tables(scene, ["road.1.left=dry", "road.1.at.0=5"])
    assert found["road"] == [{"left": "ice"}, {"left": "dry", "at": [5, 2]}]
    for key in ("road.2.left", "road.-1.left", "road.left", "road.1.at.2", "title.0"):
        with pytest.raises(InputError, match="--set"):
            changed_tables(scene, [f"{key}=1"])


def test_files_are_found_however_deep_they_are_named(tmp_path):
    """A sweep that goes on after one of these was edited would mix results of both."""
    names = ("mine.csv", "parts/tyre.tir", "mine.py")
    (tmp_path / "parts").mkdir()
    for name in names:
        (tmp_path / name).write_text("1")
    (tmp_path / "parts" / "car.toml").write_text('tyres = { file = "tyre.tir", of = "car.toml" }')
    scene = {"a": [{"file": "mine.csv"}, "parts/car.toml"], "port": {"callable": "mine.py:Mine"}, "x": "none", "y": 3}
    first = named_files(scene, tmp_path)
    assert set(first) == {"mine.csv", "parts/car.toml", "tyre.tir", "mine.py:Mine"}
    for name in names:
        (tmp_path / name).write_text("2")
        now = named_files(scene, tmp_path)
        assert sum(now[key] != first[key] for key in first) == 1
        first = now
    assert set(named_files(("json:JSONDecoder",), tmp_path)) == {"json:JSONDecoder"}
