"""Weave measured in recordings that are made here: the eigenvalue, the suspects that made them, and bad folders."""

import numpy as np
import pytest
from scipy.linalg import expm

from models.bicycle.suspects import forecast_deviations, ranked_suspects
from models.bicycle.weave import decaying_sinusoid, read_observations
from models.bicycle.whipple import SteeringControl, load_bicycle
from models.core.errors import InputError
from studies.bicycle_measured import EXPERIMENT_FEEDBACK, observation_lines, observed_and_predicted

BICYCLE = load_bicycle("steer_by_wire")
TRUE = EXPERIMENT_FEEDBACK.model_copy(update={"friction": 0.2, "speed_gain": 1.07, "speed_bias": -0.13})
SPEEDS = (2.5, 3.0, 3.5, 4.5)
SUSPECTS = ("friction", "torque_gain", "encoder_gain", "speed_gain", "speed_bias")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings of pure weave by TRUE, four windows a speed, with noise of 1 %."""
    place, rng = tmp_path_factory.mktemp("recordings"), np.random.default_rng(7)
    rows = ["file [km/h],speed [m/s],first sample,last sample"]
    for speed in SPEEDS:
        matrix = BICYCLE.state_matrix(speed, TRUE)
        values, vectors = np.linalg.eig(matrix)
        start = vectors[:, np.argmax(values.imag)].real
        states = np.array([expm(matrix * t) @ start for t in np.arange(100) / 100.0])
        blocks = []
        for window in range(4):
            noise = 0.01 * np.abs(states[:, 2]).max() * rng.standard_normal(100)
            sensor = 1.07 * speed - 0.13 + 0.005 * rng.standard_normal(100)
            blocks.append(np.column_stack([sensor, states[:, 2] + noise, states[:, 3]]))
            rows.append(f"{3.6 * speed:g},{speed},{100 * window},{100 * window + 99}")
        np.savetxt(
            place / f"test_{3.6 * speed:g}kph.csv",
            np.vstack(blocks),
            delimiter=",",
            header="speed,lean_rate,fork_rate",
            comments="",
        )
    (place / "windows.csv").write_text("\n".join(rows))
    return place


def test_a_decaying_sinusoid_is_read_exactly():
    t = np.arange(101) / 100.0
    value = decaying_sinusoid(0.3 * np.exp(-2.5 * t) * np.cos(8.0 * t + 0.4) + 0.02)
    assert value == pytest.approx(-2.5 + 8.0j, abs=1e-6)


def test_the_suspects_that_made_the_recordings_are_called_for(folder):
    seen = read_observations(folder)
    choice = ranked_suspects(BICYCLE, EXPERIMENT_FEEDBACK, seen, SUSPECTS)
    assert {*choice.best_subset.names} == {"friction", "speed_gain", "speed_bias"}
    assert choice.undetermined_parameters == ("encoder_gain",)
    told = dict(zip(choice.best_subset.names, choice.best_subset.values, strict=True))
    for name in told:
        assert told[name] == pytest.approx(getattr(TRUE, name), abs=0.03)
    assert choice.removal_tests["friction"][1] < 1e-3 < 0.05 < choice.removal_tests["torque_gain"][1]


def test_without_a_cause_none_is_called_for(folder):
    choice = ranked_suspects(BICYCLE, TRUE, read_observations(folder), ("friction", "torque_gain"))
    assert choice.best_subset.names == () and choice.weights[0] > 0.3


def test_speeds_that_took_no_part_are_predicted(folder):
    answer = observed_and_predicted(folder, (2.5, 3.0, 4.5))
    assert [*answer.predictions] == [3.5]
    assert "within 2" in observation_lines(answer, BICYCLE)[-1] and "NOT" not in observation_lines(answer, BICYCLE)[-1]


def test_a_wrong_bicycle_is_noticed(folder):
    seen, wrong = read_observations(folder), BICYCLE.changed(trail=1.5 * BICYCLE.trail)
    choice = ranked_suspects(wrong, TRUE, seen[:3], ())
    assert np.abs(forecast_deviations(wrong, TRUE, choice, seen[3])).max() > 5.0


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("9,2.5,0", "must be: file, speed"),
        ("9,-2.5,0,99", "needs a speed above 0"),
        ("9,2.5,0,9", "at least 20 samples"),
        ("9,2.5,0,4000", "the recording has 400 samples"),
        ("77,2.5,0,99", "0 recordings end in _77kph.csv"),
    ],
)
def test_a_window_that_cannot_be_is_refused(folder, tmp_path, row, said):
    for path in folder.glob("*.csv"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "windows.csv").write_text(f"file,speed,first,last\n{row}\n")
    with pytest.raises(InputError) as refused:
        read_observations(tmp_path)
    assert said in str(refused.value) and "windows.csv" in str(refused.value)


def test_a_folder_without_windows_and_an_unknown_speed_are_refused(folder, tmp_path):
    with pytest.raises(InputError, match=r"windows\.csv: no such file"):
        read_observations(tmp_path)
    with pytest.raises(InputError, match="no windows at this speed"):
        observed_and_predicted(folder, (9.0,))
    with pytest.raises(InputError, match="no such suspect"):
        ranked_suspects(BICYCLE, SteeringControl(), read_observations(folder), ("fricton",))
