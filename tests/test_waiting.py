"""Bars of what takes long: on a terminal alone, with what is done and the time left, compiling included."""

import os
import pty
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from models.core.waiting import PROGRESS_FUNCTIONS, report_simulation_progress
from models.engines.assembly import Settings
from models.engines.protocol import build
from models.systems.pitch_plane.scene import assembly_of_scene
from studies.command.waiting import COMPILE_SECONDS_OF_SYSTEM, ProgressState
from validation.common.scenes import road_scene

ROOT = Path(__file__).parents[1]
WORK = """
import os, sys, time
from models.core.waiting import report_simulation_progress
from studies.command.waiting import progress_bar
begun = time.monotonic()
def until(seen):
    while not os.path.exists(seen) and time.monotonic() - begun < {0}:
        time.sleep(0.05)
with progress_bar("road: exudyn", "handling") as tell:
    tell("road: exudyn", 0.0)
    with report_simulation_progress(lambda: min(0.9, (time.monotonic() - begun) / {0})):
        until("march")
    import numba
    from numba.core import event
    time.sleep(0.3)
    with event.trigger_event("numba:compiler_lock"):
        until("compiling")
print("done")
"""
"""Work that ends once its bar was seen, or after a time (s)."""
SEEN = {"march": r"road: exudyn [^ ]* +\d+ s left", "compiling": r"compiling kernels, once [^ ]* +\d+ s left"}
"""What is drawn, by the name of the file that says that it was seen."""


def on_terminal(*command, folder):
    """What a command writes to a pseudo-terminal as stderr, as text without control sequences, and to a pipe."""
    outer, inner = pty.openpty()
    plain = os.environ | {"TERM": "xterm", "COLUMNS": "120", "PYTHONPATH": str(ROOT)}
    child = subprocess.Popen(command, cwd=folder, env=plain, stdout=subprocess.PIPE, stderr=inner)
    os.close(inner)
    drawn = b""
    while part := _read(outer):
        drawn += part
        for name, pattern in SEEN.items():
            if re.search(pattern, _text(drawn)):
                (folder / name).touch()
    written = child.communicate()[0].decode()
    os.close(outer)
    assert child.returncode == 0, drawn
    return _text(drawn), written


def _read(terminal):
    try:
        return os.read(terminal, 65536)
    except OSError:  # the child has closed its end
        return b""


def _text(drawn):
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", drawn.decode(errors="ignore"))


def test_a_bar_tells_the_work_the_time_left_and_compiling(tmp_path):
    drawn, written = on_terminal(sys.executable, "-c", WORK.format(20.0), folder=tmp_path)
    assert all(re.search(pattern, drawn) for pattern in SEEN.values()), drawn[-500:]
    assert written == "done\n"


def test_nothing_is_drawn_of_short_work_and_into_pipes(tmp_path):
    short = "from studies.command.waiting import progress_bar\nwith progress_bar('road', ''): pass\nprint('done')"
    drawn, written = on_terminal(sys.executable, "-c", short, folder=tmp_path)
    assert drawn == "" and written == "done\n"
    plain = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", WORK.format(1.5)], env=plain, capture_output=True, text=True)
    assert done.stderr == "" and done.stdout == "done\n"


def test_a_command_that_takes_seconds_has_one_and_its_results_do_not(tmp_path):
    """One run in one engine, at some 15,000 steps a second on an idle core and without an error estimate."""
    arguments = [
        "run",
        "release",
        "--engine",
        "exudyn",
        "--no-error",
        "--json",
        "--out",
        "out",
        "--set",
        "run.duration=40",
    ]
    command = [sys.executable, "-m", "studies.command_line", *arguments]
    drawn, written = on_terminal(*command, folder=tmp_path)
    assert "exudyn" in drawn and re.search(r" s (left|so far)", drawn)
    assert written.startswith("{") and written.endswith("}\n")
    kept = b"".join(path.read_bytes() for path in (tmp_path / "out").iterdir() if path.suffix != ".nc")
    assert b" s left" not in kept


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_a_march_tells_how_far_it_is(engine, monkeypatch):
    """Asked at each look of a thread; here once at its end, when all of it is done."""
    ends = []

    class Told(list):
        def remove(self, share):
            ends.append(share())
            super().remove(share)

    monkeypatch.setattr("models.core.waiting.PROGRESS_FUNCTIONS", Told())
    scene = road_scene(duration=0.5)
    build(engine, assembly_of_scene(scene), Settings({"exudyn": "RK44", "mujoco": "RK4"}[engine], 1e-3, 0.5)).run()
    assert ends == [pytest.approx(1.0, abs=1e-9)]


def test_time_left_follows_the_share_and_leaves_out_compiling(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    shown = ProgressState("six runs", "pitch-plane", start_time=now[0])
    shown.tell("six runs", 0.25)
    now[0] += 10.0
    assert shown.state() == ("six runs", 0.25, "30 s left")
    shown.compilations._start()
    now[0] += 2.0
    text, share, left = shown.state()
    assert text == "compiling kernels, once" and left == f"{COMPILE_SECONDS_OF_SYSTEM['pitch-plane'] - 2.0:.0f} s left"
    assert share == pytest.approx(2.0 / COMPILE_SECONDS_OF_SYSTEM["pitch-plane"])
    now[0] += 2.0 * COMPILE_SECONDS_OF_SYSTEM["pitch-plane"]
    assert shown.state()[1:] == (None, f"{2.0 + 2.0 * COMPILE_SECONDS_OF_SYSTEM['pitch-plane']:.0f} s so far")
    shown.compilations._end_compilation()
    assert shown.state() == ("six runs", 0.25, "30 s left")
    with report_simulation_progress(lambda: 0.5):
        shown.state()
        now[0] += 8.0
        assert shown.state() == ("six runs", 0.5, "8 s left")
    assert not PROGRESS_FUNCTIONS
    with report_simulation_progress(lambda: 1 / 0):
        assert shown.state()[1] == 0.0
