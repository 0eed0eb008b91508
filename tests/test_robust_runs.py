"""Runs of many parts outlive what kills them: workers, the process itself; and say so where they cannot.

The job is light and so is what this module imports: every worker that starts imports it, too.
"""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import RunFailed
from models.ensemble import runner
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.workers import process_pool
from studies.command.sweep import SweepJob


class Suicide:
    """A job whose worker dies at block 0, as one that is out of memory does, until ``times`` have died."""

    def __init__(self, folder, times):
        self.folder, self.times = folder, times

    def __call__(self, paths):
        died = len(list(self.folder.iterdir()))
        if paths[0] == 0 and died < self.times:
            (self.folder / str(died)).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return {"x": np.arange(paths[0], paths[-1] + 1)}

    def facts(self):
        return {}


def test_a_worker_that_dies_is_replaced_and_its_block_computed_again(tmp_path):
    with process_pool(2) as executor:
        assert np.array_equal(
            run_paths(Suicide(tmp_path, 1), 9, executor=executor, path_blocks=PathBlocks(3))["x"], np.arange(9)
        )


def test_a_block_that_kills_every_worker_is_the_only_failure(tmp_path):
    with process_pool(2) as executor, pytest.raises(RunFailed) as caught:
        run_paths(Suicide(tmp_path, 99), 9, executor=executor, path_blocks=PathBlocks(3))
    assert str(caught.value) == "ensemble: block 0 (paths 0 to 2): its worker died: killed, or out of memory"
    assert len(list(tmp_path.iterdir())) == runner.MOST_WORKER_LOSSES


QUICK_STUDY = '''"""A study of a contact that takes no time, for sweeps that are killed."""

import time

SYSTEM = "contact"


def run(scene, engines, folder, progress):
    time.sleep(0.05)
    load = scene.contact.load
    (folder / "force.txt").write_text(f"{load}")
    answer = {"third": load / 3.0, "root": load**0.5}
    return {"scene": scene.title, "folder": str(folder), "failed": {}, "answer": answer}
'''
"""It gives numbers whose last bits would show any way round the records."""

SWEEP = """
import sys, types
from models.ensemble import store
from studies import command_line
from studies.command import sweep
store._code_checksum = sweep.checksum_of_sources = lambda *root: "the sources may be edited while a test runs"
study = types.ModuleType("studies.contact")
exec(open({study!r}).read(), study.__dict__)
sys.modules["studies.contact"] = study
sys.argv = ["twinrig", *sys.argv[1:]]
if __name__ == "__main__":
    command_line.main()
"""
"""The command with that study in place of a real one, in the parent and, as they import this file, in its workers."""

POINTS = 8
FINAL = ("sweep.csv", "sweep.json", "sweep.png")


def sweep_command(folder, *arguments):
    """A process that sweeps the load of a contact over POINTS values in ``folder``."""
    study, script = folder / "quick_study.py", folder / "twinrig_quick.py"
    study.write_text(QUICK_STUDY)
    script.write_text(SWEEP.format(study=str(study)))
    return subprocess.Popen(
        [
            sys.executable,
            str(script),
            "run",
            "contact_ellipse",
            "--sweep",
            f"contact.load=1e4:1.1e5:{POINTS}",
            *arguments,
        ],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def finished(folder):
    """Records that are there, with their times of writing."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "points").glob("block*.npz")}


def swept(folder, out, *arguments):
    """Final files of a sweep that nothing kills."""
    child = sweep_command(folder, *arguments)
    said = child.communicate(timeout=100)[0]
    assert child.returncode == 0, said
    return {name: (out / name).read_bytes() for name in FINAL}


def kill_and_resume(folder, moment, expected):
    """Kill a sweep some time after its start or after so many points, resume it until it ends: the same bytes."""
    out = folder / f"killed-{moment}"
    child = sweep_command(folder, "--out", str(out))
    end = time.monotonic() + moment if isinstance(moment, float) else float("inf")
    while child.poll() is None and time.monotonic() < end:
        if isinstance(moment, int) and len(finished(out)) >= moment:
            break
        time.sleep(0.002)
    child.kill()
    child.communicate()
    kept = finished(out)
    if not out.exists():
        out.mkdir()
    assert swept(folder, out, "--resume", str(out)) == expected
    again = finished(out)
    assert len(again) == POINTS and all(again[name] == when for name, when in kept.items())
    assert not list(out.rglob("*.part*"))
    assert sorted(path.name for path in (out / "runs").iterdir()) == [f"{i:04d}" for i in range(POINTS)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Folder of the quick study, the final files of a sweep that nothing kills, and the seconds that it took."""
    folder, start = tmp_path_factory.mktemp("sweeps"), time.monotonic()
    expected = swept(folder, folder / "whole", "--out", str(folder / "whole"))
    return folder, expected, time.monotonic() - start


def test_a_sweep_killed_half_way_goes_on_to_the_same_bytes(whole):
    kill_and_resume(whole[0], 3, whole[1])


@pytest.mark.full
def test_a_sweep_that_a_scheduler_ends_says_what_is_kept_and_leaves_nothing_half_done(whole):
    out = whole[0] / "ended"
    child = sweep_command(whole[0], "--out", str(out))
    while child.poll() is None and len(finished(out)) < 2:
        time.sleep(0.002)
    child.terminate()
    said = child.communicate(timeout=100)[0]
    assert child.returncode == 130 and said.endswith(f"interrupted; finished results are kept in {out}\n")
    assert swept(whole[0], out, "--resume", str(out)) == whole[1]


@pytest.mark.full
def test_a_sweep_killed_at_twenty_random_moments_goes_on_to_the_same_bytes(whole):
    for moment in np.random.default_rng(9).uniform(0.05, 1.0, 20) * whole[2]:
        kill_and_resume(whole[0], float(moment), whole[1])


def test_a_sweep_knows_its_scene_its_files_its_values_and_its_engine(tmp_path):
    """What differs here is refused where it is resumed, as for every ensemble."""
    scene = tmp_path / "mine.toml"
    scene.write_text('title = "mine"\nsystem = "contact"\ncases = { file = "cases.csv" }\n')
    (tmp_path / "cases.csv").write_text("1\n")

    def facts(**changes):
        whole = {"scene_name": str(scene), "key_changes": (), "swept_key": "k", "swept_values": (1, 2), "engine": None}
        return SweepJob(**whole | {"output_folder": tmp_path} | changes).facts()

    first = facts()
    assert facts(output_folder=Path("elsewhere")) == first
    changed = {"key_changes": ("contact.load=1",)}
    for change in ({"swept_values": (1, 3)}, {"swept_key": "j"}, {"engine": "exudyn"}, changed):
        assert facts(**change) != first
    (tmp_path / "cases.csv").write_text("2\n")
    assert facts() != first


class Counted:
    """A job that notes how many of its blocks are under way."""

    def __init__(self):
        self.now, self.most = 0, 0

    def __call__(self, paths):
        self.now += 1
        self.most = max(self.most, self.now)
        time.sleep(0.01)
        self.now -= 1
        return {"x": np.arange(paths[0], paths[-1] + 1)}

    def facts(self):
        return {}


@pytest.mark.parametrize("ahead", [1, 2])
def test_no_more_blocks_are_under_way_than_were_asked_for(ahead):
    """What is timed must have the machine to itself."""
    job = Counted()
    with ThreadPoolExecutor(4) as pool:
        run_paths(job, 6, executor=pool, path_blocks=PathBlocks(1, ahead))
    assert job.most == ahead
