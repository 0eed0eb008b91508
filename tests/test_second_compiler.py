"""A second process compiles the kernels of a scene's last engine, where they are missing and somebody waits."""

import json
import subprocess
import sys

import pytest
from test_waiting import ROOT, on_terminal

from studies.command import second_compiler
from studies.command.second_compiler import SecondCompiler, load_scene, run_for_kernels, second_process_compiles

COUNTED = """
import time
from pathlib import Path
from studies.command import second_compiler
second_compiler.__name__ = "seen"
import numba
from numba.core import event
changes = ["run.duration=1"]
scene = second_compiler.load_scene("release", changes)
with second_compiler.second_process_compiles("release", changes, scene, ("exudyn", "mujoco")):
    with event.trigger_event("numba:compiler_lock"), event.trigger_event("{event}"):
        pass
    begun = time.monotonic()
    while "{event}" == "numba:compile" and not Path("told.json").exists() and time.monotonic() < begun + 60.0:
        time.sleep(0.01)
"""
"""Compiles or loads a kernel, in no time; the second process is this file."""
SEEN = 'import sys\nfrom pathlib import Path\nPath("new").write_text(sys.argv[1])\nPath("new").rename("told.json")\n'


@pytest.mark.parametrize("event", ["numba:compile", "numba:llvm_lock"])
def test_the_second_process_begins_once_kernels_are_missing(event, tmp_path):
    (tmp_path / "seen.py").write_text(SEEN)
    script = f"import os\nos.environ['PYTHONPATH'] += ':{tmp_path}'\n{COUNTED.format(event=event)}"
    on_terminal(sys.executable, "-c", script, folder=tmp_path)
    assert (tmp_path / "told.json").exists() == (event == "numba:compile")
    if event == "numba:compile":
        *asked, folder = json.loads((tmp_path / "told.json").read_text())
        assert asked == ["release", ["run.duration=1"], "mujoco", True] and not ROOT.joinpath(folder).exists()


def test_no_process_begins_where_nobody_waits(monkeypatch):
    monkeypatch.setattr(second_compiler, "SecondCompiler", None)
    scene = load_scene("release", [])
    with second_process_compiles("release", [], scene, ("exudyn", "mujoco")):
        pass
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with second_process_compiles("release", [], scene, ("exudyn",)):
        pass
    with second_process_compiles("ensemble", [], load_scene("ensemble", []), ("exudyn", "mujoco")):  # which has workers
        pass


def test_its_end_ends_the_process():
    compiler = SecondCompiler([sys.executable, "-c", "import time; time.sleep(600)"])
    compiler.end()
    compiler._start()
    assert compiler.process.poll() is None
    compiler.end()
    assert compiler.process.poll() is not None


def test_what_it_runs_is_the_scene_in_that_engine(empty_folder, tmp_path_factory):
    away = tmp_path_factory.mktemp("away")
    run_for_kernels("release", ["run.duration=0.1"], "mujoco", False, str(away))
    assert not list(empty_folder.iterdir()) and (away / "mujoco.nc").exists() and not (away / "exudyn.nc").exists()


LATE = """
import sys
from pathlib import Path
from models.contact.fastsim_many import fill_contact_forces
from models.multibody.forces import set_forces
from studies.command.second_compiler import LATE_KERNELS, load_scene, study_module_of
kernel = {"wheelset": fill_contact_forces, "handling": set_forces}[sys.argv[1]]
LATE_KERNELS[sys.argv[1]]()
signatures = list(kernel.signatures)
Path("out").mkdir()
scene = load_scene(sys.argv[1], sys.argv[2:])
study_module_of(scene).run(scene, ("exudyn",), Path("out"), lambda text, share: None)
print(len(signatures), kernel.signatures == signatures)
"""


@pytest.mark.parametrize(
    "scene",
    [
        ["wheelset", "run.duration=0.1"],
        [
            "handling",
            "manoeuvres.step_steer.duration=0.1",
            "manoeuvres.lane_change.duration=0.1",
            "manoeuvres.brake_in_curve.duration=0.1",
        ],
    ],
    ids=lambda words: words[0],
)
def test_a_kernel_compiled_early_is_the_one_that_the_scene_needs(scene, tmp_path):
    """A signature of its own would be compiled for nothing."""
    done = subprocess.run([sys.executable, "-c", LATE, *scene], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1:] == ["1 True"], done.stderr
