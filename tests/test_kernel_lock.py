"""One process compiles a kernel; others that need it wait, and load it."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import models
from models.machine import alone
from models.machine.alone import KernelLock

pytest.importorskip("fcntl", reason="locks of files are those of Unix")

KERNEL = """
from models.machine.compiled import compiled

@compiled
def doubled(x):
    return 2.0 * x
"""
WAITING = """
from pathlib import Path
from numba.core import event
seen = []
event.register("numba:compile", type("Seen", (event.Listener,), {"on_start": seen.append, "on_end": lambda *_: None})())
from kernel import doubled
Path("asked").touch()
print(doubled(3.0), len([each for each in seen if each.is_start]))
"""
"""Says its answer, and how many kernels it compiled itself."""


def in_the_background(work):
    """A thread that does it, begun."""
    thread = threading.Thread(target=work)
    thread.start()
    return thread


def test_the_second_waits_for_the_first(tmp_path):
    first, second = (KernelLock(tmp_path / "new folder" / "kernel.lock") for _ in range(2))
    first.take()
    first.take()  # whoever has it does not wait for himself
    waiting = in_the_background(second.take)
    waiting.join(0.2)
    assert waiting.is_alive()
    first.give_back()
    waiting.join(10.0)
    assert not waiting.is_alive() and second._file is not None
    second.give_back()
    assert not list((tmp_path / "new folder").iterdir())


def test_nobody_waits_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr(alone, "LONGEST_WAIT", 0.1)
    first, second = (KernelLock(tmp_path / "kernel.lock") for _ in range(2))
    first.take()
    second.take()
    assert second._file is None  # it compiles, too
    second.give_back()
    assert (tmp_path / "kernel.lock").exists()
    first.give_back()


def test_where_nothing_can_be_written_there_is_no_lock(tmp_path):
    (tmp_path / "file").touch()
    lock = KernelLock(tmp_path / "file" / "kernel.lock")
    lock.take()
    assert lock._file is None


def environment(folder):
    """Of a process that finds the kernel and keeps its machine code in the folder."""
    path = os.pathsep.join([str(folder), str(Path(models.__file__).parents[1])])
    return {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder / "kept")}


def python(folder, script):
    """A process that runs the script in the folder."""
    return subprocess.Popen(
        [sys.executable, "-c", script], cwd=folder, env=environment(folder), stdout=subprocess.PIPE, text=True
    )


LOCKED = """
import time
import numba
from kernel import doubled
doubled._cache.load_overload((numba.float64,), doubled.targetctx)
print("locked", flush=True)
time.sleep({seconds})
print(doubled(3.0))
"""
"""Finds no machine code, and takes its time to compile it."""


def test_what_another_process_compiles_is_loaded(tmp_path):
    """The first has found no machine code and compiles slowly; the second asks meanwhile and compiles nothing."""
    (tmp_path / "kernel.py").write_text(KERNEL)
    first = python(tmp_path, LOCKED.format(seconds=1.0))
    assert first.stdout.readline() == "locked\n"
    second = python(tmp_path, WAITING)
    assert second.communicate(timeout=60)[0] == "6.0 0\n" and first.communicate()[0] == "6.0\n"
    assert not list(tmp_path.rglob("*.lock"))


def test_a_killed_process_holds_nobody_up(tmp_path):
    (tmp_path / "kernel.py").write_text(KERNEL)
    first = python(tmp_path, LOCKED.format(seconds=600.0))
    assert first.stdout.readline() == "locked\n"
    second = python(tmp_path, WAITING)
    begun = time.monotonic()
    while not (tmp_path / "asked").exists() and time.monotonic() < begun + 60.0:
        time.sleep(0.02)
    time.sleep(0.2)
    assert second.poll() is None  # it waits
    first.kill()
    first.wait()
    assert second.communicate(timeout=60)[0] == "6.0 1\n"


def test_a_file_system_without_locks_leaves_nothing_open(tmp_path, monkeypatch):
    def refused(file, operation):
        opened.append(file)
        raise OSError("no locks available")

    opened = []
    monkeypatch.setattr(alone.fcntl, "flock", refused)
    lock = KernelLock(tmp_path / "kernel.lock")
    lock.take()
    assert lock._file is None and opened[0].closed
