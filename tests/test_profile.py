"""Where the time of a run goes: which part a stack of calls belongs to, and the table that is printed."""

import json
import re
import time

import pytest

from models.machine.compiled import ROOT
from studies.command import profile


def stack(*calls):
    """A frame as Python has it, from (function, file), the outermost first."""
    from types import SimpleNamespace as Plain

    frame = Plain(f_code=Plain(co_name="main", co_filename="x.py"), f_globals={"__name__": "__main__"}, f_back=None)
    for name, file in calls:
        code = Plain(co_name=name, co_filename=file)
        frame = Plain(f_code=code, f_globals={"__name__": "x"}, f_back=frame)
    return frame


@pytest.mark.parametrize(
    ("calls", "part"),
    [
        ([("run", "studies/single_run.py")], "everything else"),
        ([("run", "models/engines/exudyn.py"), ("_SolveDynamic", "exudyn/solver.py")], "marching in exudyn"),
        ([("run", "models/engines/exudyn.py"), ("force", "models/engines/exudyn.py")], "forces asked for by exudyn"),
        ([("__init__", "models/engines/free_vehicle_mujoco.py")], "building in mujoco"),
        ([("run", "models/systems/braking/march.py")], profile.OUTSIDE_ENGINES_KIND),
        ([("run", "models/systems/braking/march.py"), ("_moved", "models/engines/exudyn.py")], "marching in exudyn"),
        ([("run", "models/engines/exudyn.py"), ("compile", "numba/core/dispatcher.py")], profile.KERNELS_KIND),
        ([("compile", "numba/core/dispatcher.py"), ("<module>", "llvmlite/ir.py")], profile.IMPORTS_KIND),
        ([("_figure", "studies/single_run.py"), ("draw", "matplotlib/axes/_axes.py")], profile.FIGURES_KIND),
        ([("save", "models/core/result.py"), ("sort", "numpy/x.py")], profile.SAVING_KIND),
    ],
)
def test_the_innermost_call_that_tells_decides(calls, part):
    assert profile.kind_of_work(stack(*calls)) == part


def test_all_the_time_of_the_work_is_told_and_no_more():
    begun = time.perf_counter()
    summary = profile.Profiler().run_profiled(lambda progress: time.sleep(0.3) or {"table": ["first"]}, None)
    taken, run_profiled = time.perf_counter() - begun, summary["profile"]
    run_profiled.pop(profile.PYTHON_START_KIND)
    assert 0.25 < sum(run_profiled.values()) <= taken and summary["table"][0] == "first"


def test_a_run_tells_it_when_it_is_asked_to(twinrig, empty_folder, capsys):
    asked = ("run", "release", "--set", "run.duration=0.05", "--engine", "reference", "--json")
    assert twinrig(*asked, "--profile") == 0
    run_profiled = json.loads(capsys.readouterr().out)
    assert {profile.PYTHON_START_KIND, profile.FIGURES_KIND} <= run_profiled["profile"].keys() and min(
        run_profiled["profile"].values()
    ) > 0.0
    assert twinrig(*asked) == 0
    assert "profile" not in json.loads(capsys.readouterr().out)


def test_functions_that_march_have_not_been_renamed():
    """Their names stand in a list, where a renamed one would only send its time to another line of the profile."""
    sources = "".join(path.read_text() for path in (ROOT / "models" / "engines").glob("*.py"))
    assert [name for name in profile.MARCH_FUNCTIONS if not re.search(rf"\b{name}\(", sources)] == []
