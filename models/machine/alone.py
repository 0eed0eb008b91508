"""Lock by which one process compiles a kernel while others that need it wait, and then load its machine code.

A process that is killed gives its lock back. Nothing depends on the lock: where there is none, as on a system without
``fcntl``, or where it is waited for in vain, a kernel is compiled twice.
"""

import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, BinaryIO

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LONGEST_WAIT = 120.0
"""Longest time (s) that a process waits for another one that compiles the same kernel."""
TIME_BETWEEN_LOOKS = 0.02
"""Time (s) between two looks whether the other process has finished."""


class KernelLock:
    """Lock of one kernel among processes, by a file beside its machine code; taken when the machine code is missing."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: BinaryIO | None = None

    def take(self) -> None:
        """Take the lock, after waiting for at most LONGEST_WAIT; nothing happens if this process has it."""
        if self._file is not None or fcntl is None:
            return
        with suppress(OSError):  # a folder that cannot be written to, a file system without locks
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with ExitStack() as opened:
                file = opened.enter_context(self.path.open("wb"))
                if _is_locked_in_time(file):
                    self._file = file
                    opened.pop_all()  # it stays open, and locked

    def give_back(self) -> None:
        """Give the lock back, if this process has it, and remove its file."""
        if self._file is not None:
            with suppress(OSError):
                self.path.unlink()
            self._file.close()
            self._file = None


def _is_locked_in_time(file: BinaryIO) -> bool:
    """Whether the file could be locked within LONGEST_WAIT."""
    end_time = time.monotonic() + LONGEST_WAIT
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            if time.monotonic() > end_time:
                return False
            time.sleep(TIME_BETWEEN_LOOKS)


def load_after_others(function_cache: Any, lock: KernelLock) -> None:
    """Have a numba cache that lacks a signature take the lock, and look again, before it says so.

    The lock is given back by whoever compiles, also where that fails.
    """
    load = function_cache.load_overload

    def loaded(signature: Any, target: Any) -> Any:
        overload = load(signature, target)
        if overload is None:
            lock.take()
            overload = load(signature, target)
        return overload

    function_cache.load_overload = loaded
