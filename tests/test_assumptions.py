"""What a run takes for granted: how breaches are found, told and shown."""

import json
import subprocess
import sys

import numpy as np
import pytest

from models.core import told
from models.core.assumptions import Assumption, assumption_lines, broken_assumptions_of, with_assumptions
from models.core.result import load_result
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import build

ENGINES = ("reference", "exudyn", "mujoco")

LINEAR = {
    "title": "linear tyres on the study road",
    "system": "pitch-plane",
    "study": "single_run",
    "vehicle": {"parameters": "itwm_drift"},
    "run": {"duration": 2.0},
    "effects": {"road": {"source": "study", "speed": 20.0}},
}


def watched(values):
    """An assumption that the values stay from -1 to 2."""
    return Assumption("band", "the heave stays in its band", "slow down", lambda run: {"body": values}, "m", -1.0, 2.0)


@pytest.fixture(scope="module")
def lifted():
    """The study road without lift_off, in every engine."""
    return {engine: run(build(LINEAR, "s.toml"), engine) for engine in ENGINES}


def test_a_tyre_that_pulls_is_told_alike_by_all_engines(lifted):
    (names, one), *_ = told.worst_broken_assumptions(lifted)
    assert names == "reference, exudyn, mujoco" and one.name == "tyres press" and "lift_off" in one.remedy
    forces = np.concatenate([lifted["exudyn"]["f1"], lifted["exudyn"]["f2"]])
    assert one.worst == pytest.approx(forces.min(), rel=1e-6) and 0.0 < one.share < 0.5
    assert all(run.data.attrs["status"].endswith("assumptions broken") for run in lifted.values())


def test_the_remedy_lifts_it():
    pushed = run(build({**LINEAR, "effects": {**LINEAR["effects"], "lift_off": {}}}, "s.toml"), "mujoco")
    assert broken_assumptions_of(pushed) == [] and pushed.data.attrs["status"] == "complete"


def test_shares_times_and_worst_values_are_those_of_the_channel(lifted):
    reference = lifted["reference"]
    values = np.zeros(len(reference.times))
    values[10:20], values[50] = -3.0, 2.5
    (one,) = broken_assumptions_of(with_assumptions(reference, [watched(values)]))
    assert one.share == pytest.approx(11 / len(values)) and one.first == reference.times[10] and one.worst == -3.0
    assert "(allowed from -1 to 2 m); slow down" in one.line()


@pytest.mark.parametrize("value", [-1.0, 2.0])
def test_the_edges_are_allowed(lifted, value):
    kept = with_assumptions(lifted["mujoco"], [watched(np.full(len(lifted["mujoco"].times), value))])
    assert broken_assumptions_of(kept) == [] and json.loads(kept.data.attrs["assumptions"])["assumed"]


def test_show_lists_them():
    assert assumption_lines([watched(np.zeros(1))]) == ["  assumes    the heave stays in its band (from -1 to 2 m)"]


def test_a_command_prints_saves_and_ends_with_code_1_where_it_is_strict(tmp_path):
    (tmp_path / "s.toml").write_text(
        'title = "t"\nstudy = "single_run"\n[vehicle]\nparameters = "itwm_drift"\n[run]\nduration = 2.0\n'
        '[effects.road]\nsource = "study"\nspeed = 20.0\n'
    )
    asked = [sys.executable, "-m", "studies.command_line", "run", "s.toml", "--engine", "mujoco"]
    strict = subprocess.run([*asked, "--strict", "--out", "a"], cwd=tmp_path, capture_output=True, text=True)
    assert strict.returncode == 1 and "assumption broken: linear tyres stay on the road" in strict.stdout
    assert "error at most" in strict.stdout and broken_assumptions_of(load_result(tmp_path / "a" / "mujoco.nc"))
    quick = subprocess.run([*asked, "--no-error", "--json", "--out", "b"], cwd=tmp_path, capture_output=True, text=True)
    summary = json.loads(quick.stdout)
    assert quick.returncode == 0 and summary["errors"] == {"mujoco": {}}
    assert summary["assumptions"]["mujoco"]["broken"][0]["name"] == "tyres press"
