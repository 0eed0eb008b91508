"""Measured pressures in a scene: what a run writes repeats it, and what is wrong with a file is told by its place."""

from pathlib import Path

import numpy as np
import pytest

from models.brake.controller import SAMPLING_PERIOD, Sample
from models.core.errors import InputError
from models.systems.braking.measured_pressures import read_pressures
from models.systems.braking.of_scene import measured_pressures_of
from models.systems.braking.plan import check, describe
from models.systems.braking.run import run as drive
from models.systems.braking.scene import build
from models.systems.braking.stop_report import StopHistory
from studies.braking import measurement_end_line, run

HEAD = "time [s], pressure_fl [bar], pressure_fr [kPa], pressure_rl [bar], pressure_rr [bar]"
SPEEDS = ", speed_fl [km/h], speed_fr [m/s], speed_rl [m/s], speed_rr [m/s]"
DRY = {
    "title": "t",
    "system": "braking",
    "road": {"stretches": [{"left": "dry"}]},
    "load_transfer": {},
    "options": {"adhesion": False},
    "procedures": {"stop": {"speed": 8.0}},
}
MEASURED = {"measured": {"file": "{procedure}_pressures.csv"}}


def scene(folder=Path(), **tables):
    return build({**DRY, **tables}, "s.toml", folder)


def test_the_pressures_that_a_run_writes_repeat_it(tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir(), second.mkdir()
    silent = lambda text, part: None  # noqa: E731
    led = run(scene(brakes={"supply": 2.0}, pressure={}), (), first, silent)["answer"]["stop"]
    again = run(scene(first, **MEASURED), (), second, silent)["answer"]["stop"]
    # each sample has its mean pressure, linear between its ends: 1e-4 of it off while pressure rises
    assert again["stopping distance [m]"] == pytest.approx(led["stopping distance [m]"], rel=1e-4)
    assert 0.0 < max(again["rim less measured, rms [m/s]"]) < 5e-3
    assert (second / "stop.png").stat().st_size > 10_000


def test_pressures_of_a_file_are_held_after_its_end_and_it_is_said(tmp_path):
    (tmp_path / "stop_pressures.csv").write_text(HEAD + "\n0, 1, 100, 1, 1\n0.1, 1, 100, 1, 1\n")
    own = scene(tmp_path, **MEASURED, run={"duration": 0.3})
    path = drive(own).detail
    assert path.pressures[1:] == pytest.approx(1.0, rel=1e-12)
    told = measurement_end_line(measured_pressures_of(own, "stop", 4), StopHistory(path))
    assert told == ["    measured pressures end at 0.100 s: from then on the last ones stay"]
    assert "measured pressures {procedure}" in describe(own)


@pytest.mark.parametrize(
    ("tables", "place", "said"),
    [
        ({"controller": {"kind": "slip_pi"}}, "controller", "measured"),
        ({"port": {"callable": "a:B"}}, "port", "measured"),
        ({"pressure": {}}, "pressure", "measured"),
        ({"measured": {"file": "no.csv"}}, "measured.file", "no such file"),
    ],
)
def test_measured_pressures_leave_nothing_else_to_do(tmp_path, tables, place, said):
    (tmp_path / "stop_pressures.csv").write_text(HEAD + "\n0, 1, 100, 1, 1\n1, 1, 100, 1, 1\n")
    with pytest.raises(InputError, match=said) as error:
        check(scene(tmp_path, **{**MEASURED, **tables}), ())
    assert error.value.file == "s.toml" and error.value.place == place


def test_measured_pressures(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text(HEAD + "\n0, 0, 0, 1, 1\n0.011, 2, 200, 1, 1\n")
    found = read_pressures(file, 4)
    said = found.sample(Sample(1, round(SAMPLING_PERIOD * 1e9), np.zeros(4), True, 6.0, 1.0)).pressures
    np.testing.assert_allclose(said, [1.5, 1.5, 1.0, 1.0], rtol=1e-9)
    assert found.speeds is None


def test_measured_speeds_differ_from_rims_by_their_rms(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text(HEAD + SPEEDS + "\n0, 0, 0, 1, 1, 36, 10, 10, 10\n1, 2, 200, 1, 1, 18, 5, 5, 5\n")
    found = read_pressures(file, 4)
    rims = np.array([[10.0, 10, 10, 10], [7.5, 8.5, 7.5, 5.5], [0, 0, 0, 0]])  # the last row is after the file's end
    assert found.wheel_speed_error(np.array([0.0, 0.5, 2.0]), rims) == pytest.approx(
        [0.0, 0.5**0.5, 0.0, 2.0**0.5], abs=1e-12
    )


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (HEAD + "\n0.5, 0, 0, 1, 1\n1, 2, 2, 1, 1\n", "time.*begin at 0"),
        (HEAD + "\n0, 0, 0, 1, 1\n1, -2, 2, 1, 1\n", "pressure_fl at 1 s.*above the air"),
        (HEAD + "\n0, 0, 0, 1, 1\n0, 2, 2, 1, 1\n", "line 3, column 'time'"),
        (HEAD + "\n0, 0, 0, 1, 1\n1, 2, x, 1, 1\n", r"line 3, column 'pressure_fr \[kPa\]'"),
        (HEAD + "\n0, 0, 0, 1, 1\n", "2 rows"),
        (HEAD.replace("fr", "xx") + "\n0, 0, 0, 1, 1\n1, 2, 2, 1, 1\n", "pressure_fr"),
        (HEAD.replace("kPa", "psi") + "\n0, 0, 0, 1, 1\n1, 2, 2, 1, 1\n", "pressure_fr', unit = 'psi'"),
        (HEAD + ", speed_fl [m/s]\n0, 0, 0, 1, 1, 9\n1, 2, 2, 1, 1, 9\n", "'speed_fr' is missing"),
        (HEAD + SPEEDS + "\n0, 0, 0, 1, 1, 1, 1, 1, 1\n1, 2, 2, 1, 1, 1, 1, 1, 400\n", "speed_rr at 1 s.*150 m/s"),
    ],
)
def test_measured_pressures_that_cannot_be_used(tmp_path, text, word):
    file = tmp_path / "run.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=word):
        read_pressures(file, 4)
