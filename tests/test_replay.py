"""The replay of recorded commands sees what changes, whatever the code under it is."""

import sys

import numpy as np
import pytest

from validation.replay import __main__ as replay
from validation.replay.answers import CommandOutput, load_output, output_difference, output_of_job, save_output
from validation.replay.jobs import ReplayJob, replay_jobs

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


@pytest.mark.parametrize(
    ("change", "said"),
    [({}, ""), ({"x": "0.10000000000000002"}, "x [m]: other values"), ({"code": 1}, "exit codes [0, 0] are [0, 1]")],
)
def test_a_later_version_is_held_to_what_was_recorded(tmp_path, capsys, change, said):
    words = [str(tmp_path / "kept"), "--command", str(stub(tmp_path)), "--only", "*-alone"]
    assert replay.main(["record", *words]) == 0
    stub(tmp_path, **change)
    capsys.readouterr()
    assert replay.main(["check", *words]) == (1 if said else 0)
    out = capsys.readouterr().out
    assert said in out and ("1 same" if not said else "0 same, 1 differ") in out


def test_a_recording_that_was_begun_goes_on(tmp_path, capsys):
    words = ["record", str(tmp_path / "kept"), "--command", str(stub(tmp_path)), "--only", "*-alone"]
    replay.main(words)
    (tmp_path / "kept" / "shipped-alone.npz").write_bytes(b"cut")
    capsys.readouterr()
    replay.main(words)
    assert "shipped-alone" in capsys.readouterr().out and load_output(tmp_path / "kept", "shipped-alone").codes == [
        0,
        0,
    ]


def test_channels_that_vanish_move_or_are_renamed():
    before = CommandOutput([0], "", 1.0, {"a.nc: x": np.ones(3), "b.csv: y": np.ones(3)})
    moved = CommandOutput([0], "", 1.0, {"c.nc: x": np.ones(3)})
    told = output_difference(before, moved, 0.0, {})
    assert told.wrong == ["b.csv: y is gone"] and not told.tolerated
    named = CommandOutput([0], "", 1.0, {"c.nc: x": np.ones(3), "c.nc: z": np.ones(3)})
    assert not output_difference(before, named, 0.0, {"b.csv: y": "c.nc: z"}).wrong


@pytest.mark.parametrize(
    "now",
    [
        np.array([-0.0, 1.0, np.inf, np.nan]),
        np.array([0.0, 1.0, np.inf, np.nan], dtype=np.float32),
        np.array([0.0, 1.0, -np.inf, np.nan]),
        np.array([0.0, 1.0, np.inf, np.inf]),
        np.array([0.0, 1.0, np.inf]),
        np.array([0.0, 1.0 + 2e-16, np.inf, np.nan]),
    ],
)
def test_every_bit_counts(tmp_path, now):
    """Signs of zeros, kinds of numbers, and what no number is, after a way through the files, too."""
    array = np.array([0.0, 1.0, np.inf, np.nan])
    save_output(tmp_path, "a", CommandOutput([0], "", 1.0, {"a.nc: x": array}))
    kept = load_output(tmp_path, "a")
    assert not output_difference(kept, CommandOutput([0], "", 1.0, {"a.nc: x": array}), 0.0, {}).wrong
    assert output_difference(kept, CommandOutput([0], "", 1.0, {"a.nc: x": now}), 0.0, {}).wrong


def test_a_bound_is_of_the_largest_number_and_of_every_number():
    large = np.linspace(0.0, 1e3, 60_001)
    nudged = large.copy()
    nudged[12_345] += 1e-8
    before, now = (CommandOutput([0], "", 1.0, {"a.nc: x": values}) for values in (large, nudged))
    assert output_difference(before, now, 1e-12, {}).wrong and not output_difference(before, now, 2e-11, {}).wrong
    none = CommandOutput([0], "", 1.0, {"a.nc: x": np.where(large == 0.0, np.nan, large)})
    assert output_difference(before, none, 1.0, {}).wrong and output_difference(none, before, 1.0, {}).wrong


def test_what_a_machine_decides_is_no_part_of_an_answer(tmp_path):
    now = output_of_job(ReplayJob("both", (("show", "alone"), ("run",))), str(stub(tmp_path)), tmp_path / "work")
    assert now.message == "a plan, made in SECONDS\n" and now.codes == [0, 0]
    assert set(now.arrays) == {"out/path.csv: time [s]", "out/path.csv: x [m]", ": 1/scene", ": 1/answer/largest x [m]"}


def test_the_same_seed_draws_the_same_scenes_of_every_system(tmp_path):
    one, other = (replay_jobs(str(stub(tmp_path))) for _ in range(2))
    assert one == other and len({job.name for job in one}) == len(one)
    varied = [job for job in one if job.name[-3:].isdigit()]
    systems = {line for job in varied for line in job.scene.splitlines() if line.startswith("system")}
    assert len(varied) == 300 and len(systems) >= 7
