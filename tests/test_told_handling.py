"""What runs of a steered car say of their error and of what they take for granted."""

from pathlib import Path

import numpy as np
import pytest

from models.core.assumptions import assumption_sentences, broken_assumptions_of
from models.core.discretisation import WARNED_SHARE, error_estimates_of, error_lines
from models.core.errors import RunFailed
from models.core.systems import load
from models.systems.handling import run as module
from models.systems.handling.plan import describe
from models.systems.handling.run import principal_series, run
from models.systems.handling.scene import HandlingScene, build

SHIPPED = Path(__file__).parents[1] / "studies" / "scenes" / "handling.toml"


def scene(step: float = 1e-3, cells: int = 9, tyres: dict | None = None, **manoeuvre: object) -> HandlingScene:
    """A car in half a second of a manoeuvre."""
    own = {"speed": 20.0, "duration": 0.5, **manoeuvre}
    table = {"title": "t", "system": "handling", "run": {"step": step}, "tyres": {"cells": cells, **(tyres or {})}}
    return build({**table, "manoeuvres": {"own": own}}, "s.toml")


PLANTED = {
    "wheel loads": ({"speed": 25.0, "rough": True}, {}, "drive more slowly"),
    "small lean": (
        {"speed": 22.0, "steer": [[0.0, 0.0], [0.3, 0.15]], "duration": 0.6},
        {"friction": 1.3},
        "steer less",
    ),
    "one friction": ({"brake": [[0.0, 0.0], [0.1, 6000.0]]}, {}, 'system = "braking"'),
    "moving tyres": (
        {"speed": 0.3, "brake": [[0.0, 0.0], [0.02, 3000.0]], "duration": 0.15},
        {},
        "shorten its duration",
    ),
    "slow steering": ({"speed": 5.0, "steer": [[0.1, 0.0], [0.2, 0.3]]}, {}, "steer more slowly"),
    "steer angle": ({"speed": 4.0, "steer": [[0.0, 0.0], [0.4, 0.9]]}, {}, "at most 0.7 rad"),
}
"""By the name of the assumption: manoeuvre, tyres, and what the remedy must name."""


@pytest.mark.parametrize("name", PLANTED)
def test_what_is_broken_is_told_with_its_remedy(name):
    engine = ("mujoco", "exudyn")[list(PLANTED).index(name) % 2]
    manoeuvre, tyres, remedy = PLANTED[name]
    own = scene(2.5e-5 if name == "moving tyres" else 1e-3, tyres=tyres, **manoeuvre)
    if manoeuvre.get("rough"):
        own = own.model_copy(update={"road": own.road.model_copy(update={"iso8608": "E"})})
    told = {one.name: one for one in broken_assumptions_of(run(own, engine))}
    assert name in told and remedy in told[name].remedy
    assert 0.0 < told[name].share <= 1.0 and 0.0 <= told[name].first < own.manoeuvres["own"].duration


@pytest.mark.parametrize(
    ("manoeuvre", "tyres"),
    [
        ({"speed": 20.0, "brake": [[0.0, 0.0], [0.1, 1000.0]]}, {}),
        ({"speed": 15.0, "steer": [[0.0, 0.0], [0.3, 0.05]], "duration": 0.6}, {"friction": 1.3}),
        ({"speed": 5.0, "steer": [[0.1, 0.0], [0.4, 0.05]]}, {}),
    ],
)
def test_with_the_remedy_nothing_is_broken(manoeuvre, tyres):
    assert broken_assumptions_of(run(scene(tyres=tyres, **manoeuvre), "mujoco")) == []


def test_a_gentle_manoeuvre_breaks_nothing_and_show_lists_what_is_assumed():
    own = scene(steer=[[0.1, 0.0], [0.4, 0.02]])
    gentle = run(own, "mujoco")
    assert broken_assumptions_of(gentle) == [] and gentle.data.attrs["status"] == "complete"
    assert (
        all(line in describe(own) for line in assumption_sentences(gentle)) and len(assumption_sentences(gentle)) >= 10
    )


@pytest.mark.parametrize(("step", "cells"), [(1e-3, 7), (2.5e-3, 12)])
def test_the_error_that_is_told_is_that_of_steps_and_cells(step, cells):
    """Within 3 of the difference from half of the steps, of a sixteenth of the error, and eight times the cells."""
    own = scene(step, cells, steer=[[0.05, 0.0], [0.4, 0.05]], brake=[[0.1, 0.0], [0.3, 900.0]], duration=0.4)
    told = run(own, "mujoco", error=True)
    fine = run(scene(step / 2, 8 * cells, **own.manoeuvres["own"].model_dump()), "mujoco")
    mine, truth = (principal_series(each.detail).channels for each in (told, fine))
    worst = max(error_estimates_of(told), key=lambda name: error_estimates_of(told)[name].share)
    true = float(np.sqrt(np.mean((mine[worst] - truth[worst][::2]) ** 2)))
    assert true / 3.0 < error_estimates_of(told)[worst].error < 10.0 * true
    assert error_estimates_of(told)[worst].unit in ("N", "m/s", "rad/s")


@pytest.mark.parametrize("steps", [1, 2, 5, 7])
@pytest.mark.parametrize("engine", ["mujoco", "exudyn", "reference"])
def test_a_manoeuvre_of_few_steps_tells_the_error_of_its_start(steps, engine):
    """Twice the step outlasts one step, and is too long for five: a part from the middle would miss the steering."""
    steered = {"duration": round(steps * 1e-3, 9), "steer": [[0.0, 0.0], [0.002, 0.02]]}
    told = error_estimates_of(run(scene(**steered), engine, error=True))["fy"].error
    drives = [principal_series(run(scene(step, **steered), engine).detail).channels["fy"] for step in (1e-3, 2.5e-4)]
    assert told > float(np.sqrt(np.mean((drives[0] - drives[1][::4]) ** 2))) / 3.0


def test_an_estimate_without_the_net_would_be_caught(monkeypatch):
    """Planted fault: steps alone tell a thousandth of what the net errs by."""
    own = scene(1e-3, 7, steer=[[0.05, 0.0], [0.4, 0.05]], duration=0.4)
    whole = error_estimates_of(run(own, "mujoco", error=True))["fy"]
    monkeypatch.setattr(module, "summed_error", lambda step, net: step)
    assert error_estimates_of(run(own, "mujoco", error=True))["fy"].error < 0.01 * whole.error


def test_few_cells_are_a_warning_with_those_to_use():
    own = scene(1e-3, 5, steer=[[0.05, 0.0], [0.4, 0.05]], duration=0.4)
    told = run(own, "mujoco", error=True)
    worst = max(error_estimates_of(told).values(), key=lambda one: one.share)
    assert worst.warned and error_lines(told)[0].endswith(f"use at least {worst.step:g} tyres.cells")
    cured = run(scene(1e-3, round(worst.step), **own.manoeuvres["own"].model_dump()), "mujoco", error=True)
    assert max(one.share for one in error_estimates_of(cured).values()) < WARNED_SHARE


def test_no_error_costs_no_run(monkeypatch):
    calls = []
    march = module.drive_run
    monkeypatch.setattr(module, "drive_run", lambda *told: calls.append(told) or march(*told))
    assert error_estimates_of(run(scene(), "mujoco")) == {} and len(calls) == 1


def test_a_part_from_the_middle_goes_on_as_the_run_did():
    """The driver's knots are moved along: repeated in the same step it is the run itself."""
    drive = run(scene(steer=[[0.05, 0.0], [0.4, 0.05]], brake=[[0.1, 0.0], [0.3, 900.0]]), "mujoco").detail
    rerun = module.ManoeuvreRerun("mujoco", drive, 20.0)
    half = rerun(0.5, 0.2)
    rows = np.searchsorted(drive.run.times, half.times[::2] - 1e-9)
    assert np.abs(half.channels["fy"][::2] - drive["fy"][rows]).max() < 1e-3  # N: the error of the steps
    with pytest.raises(RunFailed, match="longer steps are left out"):
        rerun(4.0, 0.4)


@pytest.mark.full
def test_the_shipped_scene_breaks_but_what_its_title_says():
    own = load(SHIPPED)
    for name in own.manoeuvres:
        broken = [one.name for one in broken_assumptions_of(run(own, "mujoco", name))]
        assert broken == (["one friction"] if name == "brake_in_curve" else [])
    assert "until all wheels slide, at one friction" in own.title
