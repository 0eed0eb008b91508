"""The bar of a command that takes longer than a second: what is being done and the time left, on a terminal alone.

A thread draws it on stderr, so that results on stdout stay as they are. It knows three things: what a study tells, the
share of the march that an engine is at, and that numba compiles, which happens once after an installation.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from models.core.waiting import PROGRESS_FUNCTIONS

BAR_DELAY, BAR_PERIOD = 1.0, 0.1
"""s until a bar is shown, and between two looks."""
SLOW_COMPILATION = 0.4
"""s of one compilation from which on it is told: loading what was compiled before takes less."""
KNOWN_SHARE = 0.01
"""Share of a work from which on its time left is told."""
COMPILE_SECONDS = {
    "pitch-plane": 5.0,
    "ride": 5.0,
    "wheelset": 15.0,
    "contact": 15.0,
    "hub-forces": 20.0,
    "handling": 30.0,
    "braking": 40.0,
}
"""s of processor that the kernels of a system's scenes take to compile; an upper bound, as some may be there."""
COMPILER_LOCK_EVENT = "numba:compiler_lock"
"""Numba's event from the beginning to the end of each compilation."""
Tell = Callable[[str, float], None]
"""Told what is done now, and which part of all (0 to 1)."""


class Kernels:
    """Timer of numba's compilations: their total time, and since when one is running. Numba calls ``on_start`` and
    ``on_end``."""

    def __init__(self) -> None:
        self.depth, self.total, self.since, self.attached = 0, 0.0, 0.0, False
        self._remove: Callable[[], None] = lambda: None

    def attach(self) -> None:
        """Register for numba's compilation events if numba has been imported already; this call does not import it."""
        if self.attached or "numba.core.compiler_lock" not in sys.modules:  # which has imported the events
            return
        event: Any = sys.modules["numba.core.event"]
        listener = type("Listener", (event.Listener,), {"on_start": self._start, "on_end": self._end_compilation})()
        event.register(COMPILER_LOCK_EVENT, listener)
        self.attached, self._remove = True, lambda: event.unregister(COMPILER_LOCK_EVENT, listener)

    def detach(self) -> None:
        """Stop listening to numba's compilation events."""
        self._remove()

    def _start(self, *event: Any) -> None:
        if self.depth == 0:
            self.since = time.monotonic()
        self.depth += 1

    def _end_compilation(self, *event: Any) -> None:
        self.depth = max(0, self.depth - 1)
        if self.depth == 0:
            self.total += time.monotonic() - self.since

    def spent(self) -> float:
        """Time (s) spent in all compilations so far, the running one included."""
        return self.total + (time.monotonic() - self.since if self.depth else 0.0)

    def is_compiling(self) -> bool:
        """Whether a compilation has been running long enough for the progress bar to show it."""
        return self.depth > 0 and time.monotonic() - self.since > SLOW_COMPILATION


@dataclass
class Waiting:
    """State of a progress bar: text and share of the work, the march that runs, numba's compiling.

    system : of the scene, for the time that its kernels take.
    """

    text: str
    system: str = ""
    share: float = 0.0
    start_time: float = field(default_factory=time.monotonic)
    compilations: Kernels = field(default_factory=Kernels)
    _march: tuple[Any, float] = (None, 0.0)

    def tell(self, text: str, share: float) -> None:
        """Set the text of the bar to the task that begins, and its share to the finished part."""
        self.text, self.share = text, min(max(share, 0.0), 1.0)

    def state(self) -> tuple[str, float | None, str]:
        """Text, finished share and remaining time to show now; the share is None where it is unknown."""
        if self.compilations.is_compiling():
            spent, expected_seconds = self.compilations.spent(), COMPILE_SECONDS.get(self.system, 0.0)
            share = spent / expected_seconds if expected_seconds > spent else None
            return "compiling kernels, once", share, _time_left_text(expected_seconds - spent if share else None, spent)
        worked = time.monotonic() - self.start_time - self.compilations.spent()
        march = PROGRESS_FUNCTIONS[-1] if PROGRESS_FUNCTIONS else None
        if march is None:
            return self.text, self.share or None, _time_left_text(_remaining_seconds(self.share, worked), worked)
        if march is not self._march[0]:
            self._march = march, worked
        share, since = 0.0, worked - self._march[1]
        with suppress(Exception):  # an engine that is asked at a bad time
            share = min(max(float(march()), 0.0), 1.0)
        return self.text, share, _time_left_text(_remaining_seconds(share, since), worked)


def _remaining_seconds(share: float, seconds: float) -> float | None:
    """Remaining seconds of a task of which ``share`` took ``seconds``; None while the share is too small to tell."""
    return seconds * (1.0 - share) / share if share > KNOWN_SHARE else None


def _time_left_text(seconds: float | None, spent: float) -> str:
    """Text of the remaining time or, if it is unknown, of the elapsed time."""
    return f"{_duration_text(spent)} so far" if seconds is None else f"{_duration_text(seconds)} left"


def _duration_text(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60.0:.0f} min"


@contextmanager
def progress_bar(text: str, system: str = "") -> Iterator[Tell]:
    """Context that shows a progress bar on the terminal if the block takes longer than BAR_DELAY. It yields the
    function to which the block reports its progress.

    Nothing is written, and no thread runs, where stderr is no terminal.
    """
    if not sys.stderr.isatty():
        yield lambda text, share: None
        return
    waiting, is_over = Waiting(text, system), threading.Event()
    thread = threading.Thread(target=_draw, args=(waiting, is_over), daemon=True)
    thread.start()
    try:
        yield waiting.tell
    finally:
        is_over.set()
        thread.join()
        waiting.compilations.detach()


def _draw(waiting: Waiting, finished: threading.Event) -> None:
    """Draw the bar until the work is over, from BAR_DELAY on."""
    while not finished.wait(BAR_PERIOD):
        waiting.compilations.attach()
        waiting.state()  # which sees when a march begins
        if time.monotonic() - waiting.start_time > BAR_DELAY:
            break
    else:
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = TextColumn("{task.description}", markup=False), BarColumn(), TextColumn("{task.fields[left]}")
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as bar:
        task = bar.add_task(waiting.text, total=None, left="")
        while True:
            waiting.compilations.attach()
            text, share, left = waiting.state()
            total = None if share is None else 1.0
            bar.update(task, description=text, total=total, completed=share or 0.0, left=left)
            if finished.wait(BAR_PERIOD):
                return
