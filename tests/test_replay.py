"""The replay of recorded commands sees what changes, whatever the code under it is."""

import sys

import numpy as np
import pytest

from validation.replay import __main__ as replay
from validation.replay.answers import Answer, answer
from validation.replay.differences import difference
from validation.replay.jobs import Job, jobs
from validation.replay.kept import MOST, load, save, thinned

COMMAND = """#!{python}
import json, sys
from pathlib import Path
if sys.argv[1] == "list":
    print("scenes (twinrig run NAME)\\n  alone   A scene\\neffects")
    sys.exit(0)
if sys.argv[1] == "show":
    print("a plan, made in 3.2 s")
    sys.exit(0)
Path("out").mkdir()
Path("out/path.csv").write_text("time [s],x [m]\\n0,{x}\\n1,2.5\\n")
print(json.dumps({{"scene": "A scene", "seconds": 3.0, "answer": {{"largest x [m]": 2.5}}}}))
sys.exit({code})
"""


def stub(folder, x="0.1", code=0):
    """A command that answers as twinrig does."""
    path = folder / "twinrig"
    path.write_text(COMMAND.format(python=sys.executable, x=x, code=code))
    path.chmod(0o755)
    return path


@pytest.mark.parametrize(("change", "said"), [
    ({}, ""), ({"x": "0.10000000000000002"}, "x [m]: a number changed"), ({"code": 1}, "exit code 0 is 1"),
])  # fmt: skip
def test_a_later_version_is_held_to_what_was_recorded(tmp_path, capsys, change, said):
    words = [str(tmp_path / "kept"), "--command", str(stub(tmp_path)), "--only", "*-alone"]
    assert replay.main(["record", *words]) == 0
    stub(tmp_path, **change)
    capsys.readouterr()
    assert replay.main(["check", *words]) == (1 if said else 0)
    out = capsys.readouterr().out
    assert said in out and ("2 same" if not said else "1 same, 1 differ") in out


def test_a_recording_that_was_begun_goes_on(tmp_path, capsys):
    words = ["record", str(tmp_path / "kept"), "--command", str(stub(tmp_path)), "--only", "*-alone"]
    replay.main(words)
    (tmp_path / "kept" / "run-alone.npz").write_bytes(b"cut")
    capsys.readouterr()
    replay.main(words)
    assert "run-alone" in capsys.readouterr().out and load(tmp_path / "kept", "run-alone").code == 0


def test_channels_that_vanish_move_or_are_renamed():
    before = Answer(0, "", 1.0, {"a.nc: x": np.ones(3), "b.csv: y": np.ones(3)})
    moved = Answer(0, "", 1.0, {"c.nc: x": np.ones(3)})
    told = difference(before, moved, 0.0, {})
    assert told.wrong == ["b.csv: y is gone"] and not told.other
    named = Answer(0, "", 1.0, {"c.nc: x": np.ones(3), "c.nc: z": np.ones(3)})
    assert not difference(before, named, 0.0, {"b.csv: y": "c.nc: z"}).wrong


def test_a_bound_is_of_the_largest_number_and_large_arrays_are_told_to_the_bit():
    large = np.linspace(0.0, 10.0, 2 * MOST + 1)
    nudged = large.copy()
    nudged[1] += 1e-9  # none of those that are kept
    before, now = (Answer(0, "", 1.0, thinned({"a.nc: x": values})) for values in (large, nudged))
    assert difference(before, now, 0.0, {}).wrong and not difference(before, now, 1e-8, {}).wrong
    small = Answer(0, "", 1.0, {"a.nc: x": np.array([1.0, 1e3])})
    other = Answer(0, "", 1.0, {"a.nc: x": np.array([1.0 + 1e-8, 1e3])})
    assert difference(small, other, 1e-12, {}).wrong and not difference(small, other, 2e-11, {}).wrong


def test_numbers_that_are_none_stay_where_they_are(tmp_path):
    save(tmp_path, "a", Answer(0, "", 1.0, {"a.nc: x": np.array([1.0, np.nan])}))
    kept = load(tmp_path, "a")
    assert not difference(kept, kept, 0.0, {}).wrong
    assert difference(kept, Answer(0, "", 1.0, {"a.nc: x": np.array([np.nan, 1.0])}), 1.0, {}).wrong


def test_what_a_machine_decides_is_no_part_of_an_answer(tmp_path):
    shown = answer(Job("show", ("show", "alone")), str(stub(tmp_path)), tmp_path / "work")
    assert shown.message == "a plan, made in SECONDS\n"
    run = answer(Job("run", ("run",)), str(tmp_path / "twinrig"), tmp_path / "work")
    assert set(run.arrays) == {"path.csv: time [s]", "path.csv: x [m]", ": /scene", ": /answer/largest x [m]"}


def test_the_same_seed_draws_the_same_scenes_of_every_system(tmp_path):
    one, other = (jobs(str(stub(tmp_path))) for _ in range(2))
    assert one == other and len({job.name for job in one}) == len(one)
    varied = [job for job in one if job.name[-3:].isdigit()]
    systems = {line for job in varied for line in job.scene.splitlines() if line.startswith("system")}
    assert len(varied) == 300 and len(systems) >= 7
