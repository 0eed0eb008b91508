"""Result folders: no two runs ever share one, and none of an earlier run is touched."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.result_folders import COMMAND_FILE, drop_if_empty, new_folder, resumed_folder
from models.core.whole_files import PARTIAL_NAME
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import build
from studies import command_line
from studies.single_run import largest_state_difference


def test_many_runs_at_once_get_a_folder_each(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        for _ in range(20):
            folders = list(pool.map(lambda _: new_folder(None, "x"), range(8)))
            assert len(set(folders)) == 8


def test_one_named_folder_goes_to_one_run_alone(tmp_path):
    def take(folder):
        try:
            return new_folder(folder, "x")
        except InputError:
            return None

    with ThreadPoolExecutor(8) as pool:
        for i in range(20):
            taken = list(pool.map(take, [tmp_path / f"same{i}"] * 8))
            assert sum(folder is not None for folder in taken) == 1


def test_a_resumed_folder_keeps_no_part_of_a_killed_process_and_those_of_living_ones(tmp_path):
    (tmp_path / "points").mkdir()
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        files = [
            folder / PARTIAL_NAME.format("sweep.png", child.pid, ".png") for folder in (tmp_path, tmp_path / "points")
        ]
        files.append(tmp_path / "notes.part.png")
        for file in files:
            file.touch()
        files.append(tmp_path / PARTIAL_NAME.format("0003", child.pid, ""))
        (files[-1] / "within").mkdir(parents=True)
        assert resumed_folder(tmp_path, "points") == tmp_path and all(file.exists() for file in files)
        child.communicate(b"\n")
    resumed_folder(tmp_path, "points")
    assert [file.exists() for file in files] == [False, False, True, False]


def test_a_used_folder_is_refused_before_the_scene_is_checked(tmp_path, monkeypatch):
    """Checks compile kernels, and nobody should wait for them to be told that a folder is in use."""
    monkeypatch.setattr(command_line, "checked_study", lambda *_: pytest.fail("the scene was checked first"))
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match="holds files already"):
        command_line.run_scene("wheelset", out=tmp_path)


def test_a_run_that_saved_nothing_leaves_nothing(tmp_path):
    folder = new_folder(tmp_path / "empty", "x")
    assert [path.name for path in folder.iterdir()] == [COMMAND_FILE]
    drop_if_empty(folder)
    assert not folder.exists()


def test_rows_at_other_times_are_compared_at_their_own():
    """Exudyn's adaptive rows lie off the grid; read row by row they would differ by 1e-3."""
    table = {
        "title": "test",
        "run": {"duration": 1.0, "step": 1e-3},
        "effects": {"road": {"source": "study", "speed": 20.0}},
        "engines": {"exudyn": {"integrator": "DOPRI5", "tolerance": 1e-9}},
    }
    scene = build(table, "", Path())
    grid, adaptive = simulate(scene, "reference"), simulate(scene, "exudyn")
    assert not np.allclose(adaptive.times, grid.times[: len(adaptive.times)], rtol=0, atol=1e-6)
    # RK4 at 1 ms is right to some 1e-5 here; the spline between its rows adds less
    assert largest_state_difference(grid, adaptive) < 1e-4
