"""Handling by integrators that pick their own steps: the same motion, standstill, scenes, and what is refused."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.engines import free_vehicle_adaptive
from models.engines.assembly import Settings
from models.multibody.numbers import Controls, Handling
from models.systems.handling.plan import describe
from models.systems.handling.run import drive_run, drive_run_adaptive, run
from models.systems.handling.scene import build
from models.vehicles.vehicle_file import load_vehicle

R19 = load_vehicle("r19_free")
STEERED = Handling(R19, controls=Controls(steer=((0.0, 0.0), (0.05, 0.03))))
TABLE = {
    "title": "t",
    "system": "handling",
    "run": {"step": 0.01},
    "manoeuvres": {"turn": {"speed": 20.0, "duration": 0.1, "steer": [[0.0, 0.0], [0.05, 0.03]]}},
}


def end(tolerance: float) -> np.ndarray:
    """State of a step of steering after 0.1 s, by DOPRI5."""
    settings = Settings("DOPRI5", 0.01, 0.1, tolerance)
    return drive_run_adaptive("exudyn", STEERED, 20.0, settings).run.states[-1]


def test_it_is_the_motion_of_short_fixed_steps_and_reads_the_controls_at_their_time() -> None:
    truth = drive_run("exudyn", STEERED, 20.0, 0.1, 5e-4).run.states[-1]
    assert np.abs(end(1e-9) - truth).max() < 2e-6
    options = free_vehicle_adaptive._options
    with patch.object(free_vehicle_adaptive, "_options", lambda begin, own: options(0.0, own)):
        assert np.abs(end(1e-9) - truth).max() > 1e-3  # every row would begin at the start of the manoeuvre
    with patch.object(
        free_vehicle_adaptive, "_options", lambda begin, own: options(begin, replace(own, tolerance=1.0))
    ):
        assert np.abs(end(1e-9) - truth).max() > 2e-6  # without tolerance


def test_a_car_at_walking_pace_needs_no_shorter_step_to_be_named() -> None:
    with pytest.raises(RunFailed, match="damps its wheel faster"):
        drive_run("exudyn", Handling(R19), 0.1, 0.02, 2e-3)
    slow = drive_run_adaptive("exudyn", Handling(R19), 0.1, Settings("DOPRI5", 2e-3, 0.02, 1e-6))
    assert np.abs(slow.run.rates[-1] - slow.run.rates[0]).max() < 1e-3 and slow.run.counts["steps"] > 10


def test_a_scene_names_the_integrator_of_an_engine_and_the_result_says_why_it_has_no_error() -> None:
    scene = build({**TABLE, "engines": {"exudyn": {"integrator": "DOPRI5", "tolerance": 1e-7}}}, "t.toml", Path())
    assert "DOPRI5 in its place, which picks its own steps to 1e-07" in describe(scene)
    result = run(scene, "exudyn", error=True)
    assert len(result.times) == 11 and "Runge-Kutta 4 tells it" in result.data.attrs["error"]
    assert np.abs(np.array(result["positions"])[-1] - end(1e-7)[: len(end(1e-7)) // 2]).max() < 1e-12


@pytest.mark.parametrize(
    ("engines", "message"),
    [
        ({"mujoco": {"integrator": "RK4"}}, r"engines\.mujoco .* no engine with integrators that pick"),
        ({"exudyn": {"integrator": "RK44"}}, r"engines\.exudyn\.integrator .* no integrator of this engine that picks"),
        ({"exudyn": {"integrator": "DOPRI5", "tolerance": 0.1}}, r"engines\.exudyn\.tolerance"),
        ({"exudyn": {}}, r"engines\.exudyn\.integrator"),
    ],
)
def test_what_picks_no_steps_of_its_own_is_refused(engines: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build({**TABLE, "engines": engines}, "t.toml", Path())


def test_a_scene_without_it_imports_nothing_of_it() -> None:
    code = "import sys, models.systems.handling.run; sys.exit(any('adaptive' in name for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
