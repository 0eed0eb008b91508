"""Engines and integrators from outside the tree: right ones agree with the reference, wrong ones are told."""

import re
import sys
import types
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import InputError, Refused, RunFailed
from models.engines import outside
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES, RECOMMENDED
from models.engines.outside import register
from models.engines.protocol import build
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation import conformity
from validation.common import checks, wrong_engines
from validation.common.scenes import force_scene, road_scene


def of_the_page():
    """The class that the page on own engines shows."""
    shown: dict = {}
    page = (Path(__file__).parents[1] / "docs" / "how-to" / "own_engine.md").read_text()
    exec(re.search(r"```python\n(.*?)```", page, flags=re.DOTALL).group(1), shown)
    return shown["Scipy"]


Scipy = of_the_page()


class Euler:
    order = 1

    def integrate(self, f, times, start, tolerance):
        states = [start]
        for t, end in pairwise(times):
            states.append(states[-1] + (end - t) * f(t, states[-1]))
        return states


class Boast(Euler):
    """The fault to be seen: of order 1, and says 2."""

    order = 2


class Engine:
    """An engine of its own, here with the reference inside."""

    order = 4

    def __init__(self, assembly, settings):
        self.inside = checks.engine("reference")(assembly, checks.reference_settings(settings))

    def run(self):
        return self.inside.run()

    def acceleration(self, time, state):
        return self.inside.acceleration(time, state[:4], state[4:])


class Tilted(Engine):
    """The fault to be seen: accelerations that are a little off."""

    def acceleration(self, time, state):
        return self.inside.acceleration(time, state[:4], state[4:]) * (1 + 1e-9)


def answering(answer):
    """Class of an integrator with that answer to (times, start)."""
    return type("Bad", (), {"order": 4, "integrate": lambda self, f, times, start, tolerance: answer(times, start)})


class Sparse(Engine):
    """The fault to be seen: a state at every second step."""

    def run(self):
        found = self.inside.run()
        return types.SimpleNamespace(times=found.times[::2], states=found.states[::2])


class Far(Engine):
    """The fault to be seen: everything 1 % too far."""

    def run(self):
        found = self.inside.run()
        first = found.states[0]
        return types.SimpleNamespace(times=found.times, states=first + 1.01 * (found.states - first))


class Deaf:
    order = 4

    def run(self):
        return None


@pytest.fixture
def own(monkeypatch):
    """Function that gives classes names, as if they stood in a file ``mine.py``."""
    before = [dict(table) for table in (CATALOGUE, RECOMMENDED, OUTSIDE_CLASSES)]
    module = types.ModuleType("mine_of_the_tests")
    monkeypatch.setitem(sys.modules, module.__name__, module)

    def enter(found):
        module.Own = found
        register("mine_of_the_tests:Own")
        return "mine_of_the_tests:Own"

    yield enter
    for table, kept in zip((CATALOGUE, RECOMMENDED, OUTSIDE_CLASSES), before, strict=True):
        table.clear()
        table.update(kept)


SHORT = 0.1


def test_a_scipy_solver_of_a_dozen_lines_agrees_with_the_reference(own, tmp_path):
    """On a road, and on forces that are held or linear: each jump of a held sample begins a stretch of its own.

    Between its own steps, 0.01 s at most, scipy interpolates to 1.3e-8; a jump read half a step late costs 1e-5.
    """
    name = own(Scipy)
    write_measurement(simulate(road_scene(duration=SHORT), "reference"), tmp_path, 5e-3)
    scenes = [
        road_scene(duration=SHORT),
        force_scene(tmp_path, duration=SHORT),
        force_scene(tmp_path, duration=SHORT, interpolation="held"),
    ]
    for scene in scenes:
        assembly = assembly_of_scene(scene)
        found = build(name, assembly, Settings(name, 1e-3, SHORT, 1e-11)).run()
        tight = build("reference", assembly, Settings("DOP853", 1e-3, SHORT, 1e-13)).run()
        assert np.abs(found.states - tight.states).max() < 1e-7 and found.counts["force calls"] > 100


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda times, start: None, "gave NoneType instead of numbers"),
        (lambda times, start: "x", "instead of numbers"),
        (lambda times, start: np.zeros((3, 8)), r"gave the shape \(3, 8\)"),
        (lambda times, start: np.full((len(times), 8), np.nan), "infinite or not a number"),
        (lambda times, start: np.full((len(times), 8), 1e9), "no vehicle any more"),
        (lambda times, start: 1 / 0, "integrate raised ZeroDivisionError"),
    ],
)
def test_a_wrong_answer_is_a_failed_run_that_says_so(own, answer, said):
    name = own(answering(answer))
    with pytest.raises(RunFailed, match=said):
        simulate(road_scene(duration=0.01), name, Settings(name, 1e-3, 0.01))


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (Deaf, r"has no acceleration\(\)"),
        (type("Empty", (), {"order": 3}), r"no run and no acceleration\(\)"),
        (type("Unordered", (Euler,), {"order": None}), "must say its order"),
        (type("Zeroth", (Euler,), {"order": 0}), "must say its order"),
        (len, "is no class"),
    ],
)
def test_what_is_no_engine_is_refused(own, found, said):
    with pytest.raises(InputError, match=said):
        own(found)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nowhere_at_all:X", "no module 'nowhere_at_all'"),
        ("json:Nope", "has no Nope"),
        (":", "must read module:Class"),
        ("a b:C", "must read module:Class"),
        ("broken:X", "cannot be imported: ZeroDivisionError"),
        ("leaving:X", "cannot be imported: SystemExit"),
    ],
)
def test_a_name_that_leads_nowhere_is_refused_by_the_command(name, said, twinrig, empty_folder, capsys):
    (empty_folder / "broken.py").write_text("1 / 0\n")
    (empty_folder / "leaving.py").write_text("import sys\nsys.exit(3)\n")
    assert twinrig("run", "study_road", "--engine", name) == 2 == twinrig("validate", "--engine", name)
    assert said in capsys.readouterr().err and not (empty_folder / "results").exists()


def test_wrong_integrators_are_told_in_a_run_and_right_ones_say_how_near_they_are(own, twinrig, capsys):
    assert wrong_engines.integrators_that_pass() == []
    assert wrong_engines.integrators_that_pass((wrong_engines.FaultlessIntegrator,)) == ["FaultlessIntegrator"]
    assert twinrig("run", "study_road", "--engine", own(Scipy), "--set", "run.duration=0.2") == 0
    assert "of the largest motion from the reference" in capsys.readouterr().out


def test_the_comparison_with_the_reference_can_see(monkeypatch):
    """The fault to be seen: an allowance that explains everything."""
    monkeypatch.setattr(outside, "_expected_error", lambda *given: 1e9)
    monkeypatch.setattr(outside, "LARGEST_BOUND", 1e9)
    assert len(wrong_engines.integrators_that_pass()) == len(wrong_engines.WRONG_ENGINES)


def test_an_engine_of_its_own_runs_and_what_it_cannot_do_is_refused(own, tmp_path):
    name = own(Engine)
    run = simulate(road_scene(duration=SHORT), "reference")
    write_measurement(run, tmp_path, 5e-3)
    assert np.array_equal(simulate(road_scene(duration=SHORT), name).states, run.states)
    guided = force_scene(tmp_path, duration=SHORT, effects={"prescribed_pitch": {"file": "pitch.csv"}})
    with pytest.raises(Refused, match="does not solve for a prescribed pitch"):
        simulate(guided, name)


def judged(name, folder, monkeypatch):
    """Rows of the conformity of a class without hard cases."""
    monkeypatch.setattr(conformity, "HARD_CASE_FAMILIES", ())
    rows = {row.id.removeprefix("conformity."): row.status for row in conformity._conformity_rows(name, folder)}
    assert rows.pop("others") == "not run"  # the table says what it does not judge
    return rows


RUNS = {"path.study road", "path.wheel forces, linear", "path.wheel forces, held", "momentum", "order"}
"""Rows that a run decides, but for the equilibrium, in which nothing moves."""


@pytest.mark.parametrize(
    ("found", "failed"),
    [
        (Sparse, RUNS | {"equilibrium"}),
        (Far, RUNS),
        (Scipy, set()),
        (Engine, set()),
        (Boast, {"order", "momentum"}),
        (Tilted, {f"audit.{v}.{g}" for v in ("itwm_drift", "asymmetric_twin") for g in ("exact", "linear")}),
    ],
)
def test_the_suite_passes_what_is_right_and_names_what_is_wrong(own, tmp_path, monkeypatch, found, failed):
    rows = judged(own(found), tmp_path, monkeypatch)
    assert {id for id, status in rows.items() if status != "passed"} == failed and len(rows) == 11


def test_a_class_that_answers_nothing_fails_row_by_row(own, tmp_path, monkeypatch):
    rows = judged(own(answering(lambda times, start: None)), tmp_path, monkeypatch)
    assert {status for id, status in rows.items() if id.startswith(("path", "order", "equil", "mom"))} == {"failed"}


@pytest.mark.full
def test_a_method_that_keeps_a_tolerance_is_not_blamed_for_rounding_or_for_steps(own, tmp_path, monkeypatch):
    kept = {
        "samples belong to the recorder": "not run",
        "measured road between its points": "not run",
        "static equilibrium": "passed",
        "+z is down": "passed",
    }
    for family in conformity.HARD_CASE_FAMILIES:
        module = import_module(f"validation.hard_cases.{family}")
        monkeypatch.setattr(module, "CASES", tuple(case for case in module.CASES if case.name in kept))
    rows = list(conformity._hard_cases(own(Scipy), tmp_path))
    assert {row.quantity.split(": ")[1]: row.status for row in rows} == kept
