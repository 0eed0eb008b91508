"""Progress bar of a command that takes longer than a second: current task and remaining time, on a terminal only.

A thread draws it on stderr, so that results on stdout stay as they are. It knows three things: what a study tells, the
share of the march that an engine is at, and that numba compiles, which happens once after an installation.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, ClassVar

from models.core.waiting import PROGRESS_FUNCTIONS

BAR_DELAY, BAR_PERIOD = 1.0, 0.1
"""Time (s) until the bar is shown, and between two updates."""
SLOW_COMPILATION = 0.4
"""Time (s) of a compilation from which the bar shows it; loading a compiled kernel takes less."""
LEAST_SHARE_FOR_ESTIMATE = 0.01
"""Finished share of the work from which the bar shows the remaining time."""
COMPILE_SECONDS_OF_SYSTEM = {
    "pitch-plane": 5.0,
    "ride": 5.0,
    "wheelset": 15.0,
    "contact": 15.0,
    "hub-forces": 20.0,
    "handling": 30.0,
    "braking": 40.0,
}
"""Processor time (s) for the compilation of the kernels of a system's scenes; an upper bound, as some may exist."""
ReportProgress = Callable[[str, float], None]
"""Function that reports progress: the current task as text, and the finished share (0 to 1) of all work."""


class CompilationObserver:
    """Observer of an event of numba, which calls ``_start`` and ``_end_compilation``; here they do nothing."""

    EVENT: ClassVar[str] = "numba:compile"
    """Name of the event: by default it lasts as long as a kernel is compiled that could not be loaded."""

    def __init__(self) -> None:
        self.attached = False
        self._remove: Callable[[], None] = lambda: None

    def attach(self) -> None:
        """Register for numba's compilation events if numba is imported already; numba is not imported for this."""
        if self.attached or "numba.core.compiler_lock" not in sys.modules:  # which has imported the events
            return
        event: Any = sys.modules["numba.core.event"]
        listener = type("Listener", (event.Listener,), {"on_start": self._start, "on_end": self._end_compilation})()
        event.register(self.EVENT, listener)
        self.attached, self._remove = True, lambda: event.unregister(self.EVENT, listener)

    def detach(self) -> None:
        """Stop listening to numba's compilation events."""
        self._remove()

    def _start(self, *compiler_event: Any) -> None:
        pass

    def _end_compilation(self, *compiler_event: Any) -> None:
        pass


class CompilationTimer(CompilationObserver):
    """Timer of numba's compilations: their total time (s), and the start time of a running one."""

    EVENT = "numba:compiler_lock"
    """Name of the event, which lasts as long as a kernel is compiled or loaded."""

    def __init__(self) -> None:
        super().__init__()
        self.depth, self.total, self.since = 0, 0.0, 0.0

    def _start(self, *compiler_event: Any) -> None:
        if self.depth == 0:
            self.since = time.monotonic()
        self.depth += 1

    def _end_compilation(self, *compiler_event: Any) -> None:
        self.depth = max(0, self.depth - 1)
        if self.depth == 0:
            self.total += time.monotonic() - self.since

    def compilation_seconds(self) -> float:
        """Time (s) spent in all compilations so far, including a running one."""
        return self.total + (time.monotonic() - self.since if self.depth else 0.0)

    def is_compiling(self) -> bool:
        """Whether a compilation is running and has taken longer than SLOW_COMPILATION."""
        return self.depth > 0 and time.monotonic() - self.since > SLOW_COMPILATION


@dataclass
class ProgressState:
    """State of the progress bar: current task, finished share, the running time integration, and numba's compilations.

    system_name : of the scene, for the time that its kernels take.
    """

    task_text: str
    system_name: str = ""
    finished_share: float = 0.0
    start_time: float = field(default_factory=time.monotonic)
    compilations: CompilationTimer = field(default_factory=CompilationTimer)
    _march: tuple[Any, float] = (None, 0.0)

    def tell(self, task_text: str, finished_share: float) -> None:
        """Set the bar's text to the task that begins, and its finished share (0 to 1)."""
        self.task_text, self.finished_share = task_text, min(max(finished_share, 0.0), 1.0)

    def state(self) -> tuple[str, float | None, str]:
        """Current task, finished share and text of the remaining time for the bar; the share is None if it is
        unknown."""
        if self.compilations.is_compiling():
            compilation_seconds, expected_seconds = (
                self.compilations.compilation_seconds(),
                COMPILE_SECONDS_OF_SYSTEM.get(self.system_name, 0.0),
            )
            share = compilation_seconds / expected_seconds if expected_seconds > compilation_seconds else None
            return (
                "compiling kernels, once",
                share,
                _time_left_text(expected_seconds - compilation_seconds if share else None, compilation_seconds),
            )
        worked = time.monotonic() - self.start_time - self.compilations.compilation_seconds()
        march = PROGRESS_FUNCTIONS[-1] if PROGRESS_FUNCTIONS else None
        if march is None:
            return (
                self.task_text,
                self.finished_share or None,
                _time_left_text(_remaining_seconds(self.finished_share, worked), worked),
            )
        if march is not self._march[0]:
            self._march = march, worked
        share, since = 0.0, worked - self._march[1]
        with suppress(Exception):  # an engine that is asked at a bad time
            share = min(max(float(march()), 0.0), 1.0)
        return self.task_text, share, _time_left_text(_remaining_seconds(share, since), worked)


def _remaining_seconds(finished_share: float, elapsed_seconds: float) -> float | None:
    """Remaining time (s) of a task of which ``finished_share`` took ``elapsed_seconds``; None while the share is too
    small."""
    return (
        elapsed_seconds * (1.0 - finished_share) / finished_share if finished_share > LEAST_SHARE_FOR_ESTIMATE else None
    )


def _time_left_text(remaining_seconds: float | None, elapsed_seconds: float) -> str:
    """Text of the remaining time or, if it is unknown, of the elapsed time."""
    return (
        f"{_duration_text(elapsed_seconds)} so far"
        if remaining_seconds is None
        else f"{_duration_text(remaining_seconds)} left"
    )


def _duration_text(duration_seconds: float) -> str:
    return f"{duration_seconds:.0f} s" if duration_seconds < 100.0 else f"{duration_seconds / 60.0:.0f} min"


@contextmanager
def progress_bar(task_text: str, system_name: str = "") -> Iterator[ReportProgress]:
    """Context that shows a progress bar on the terminal if its block takes longer than BAR_DELAY; it yields the
    function that reports progress.

    Nothing is written, and no thread runs, where stderr is no terminal.
    """
    if not sys.stderr.isatty():
        yield lambda text, share: None
        return
    waiting, is_over = ProgressState(task_text, system_name), threading.Event()
    thread = threading.Thread(target=_draw_bar, args=(waiting, is_over), daemon=True)
    thread.start()
    try:
        yield waiting.tell
    finally:
        is_over.set()
        thread.join()
        waiting.compilations.detach()


def _draw_bar(progress_state: ProgressState, finished_event: threading.Event) -> None:
    """Draw the progress bar from BAR_DELAY on until ``finished_event`` is set."""
    while not finished_event.wait(BAR_PERIOD):
        progress_state.compilations.attach()
        progress_state.state()  # which sees when a march begins
        if time.monotonic() - progress_state.start_time > BAR_DELAY:
            break
    else:
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = TextColumn("{task.description}", markup=False), BarColumn(), TextColumn("{task.fields[left]}")
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as bar:
        task = bar.add_task(progress_state.task_text, total=None, left="")
        while True:
            progress_state.compilations.attach()
            text, share, left = progress_state.state()
            total = None if share is None else 1.0
            bar.update(task, description=text, total=total, completed=share or 0.0, left=left)
            if finished_event.wait(BAR_PERIOD):
                return
