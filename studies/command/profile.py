"""Profile of a run's computing time: a thread samples the call stack of the main thread every few milliseconds.

Nothing is built into the models for it, so a run without it costs what it did. Forces that are compiled into a march
belong to that march; those that an engine asks Python for have a line of their own.
"""

import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import PurePath
from types import FrameType
from typing import Any

SAMPLING_PERIOD = 0.004
"""Time (s) between two samples of the call stack."""
PYTHON_START_KIND, IMPORTS_KIND, KERNELS_KIND = "start of Python", "imports", "compiling and loading kernels"
FIGURES_KIND, SAVING_KIND, OTHER_KIND = "figures", "saving", "everything else"
OUTSIDE_ENGINES_KIND = "marching beside the engines"
"""Label of time spent in a controller, in wheels with their own steps, or in equations that belong to no engine."""
WORK_KIND_OF_LIBRARY = {
    "numba": KERNELS_KIND,
    "llvmlite": KERNELS_KIND,
    "matplotlib": FIGURES_KIND,
    "mpl_toolkits": FIGURES_KIND,
    "PIL": FIGURES_KIND,
    "drawing": FIGURES_KIND,
    "pictures": FIGURES_KIND,
    "h5netcdf": SAVING_KIND,
    "h5py": SAVING_KIND,
    "backends": SAVING_KIND,
}
"""Kind of work that a call within a library or a source folder belongs to."""
ENGINE_NAMES = ("exudyn", "mujoco", "reference")
MARCH_FUNCTIONS = frozenset(
    (
        *("march", "march_adaptively", "solve", "run", "rollout", "SolveDynamic"),
        *("_states_and_contacts", "_march_fixed", "_march_adaptively"),
    )
)
"""Names of the functions in which an engine integrates in time; in all others it is built or evaluates one state."""
FORCE_FUNCTIONS = frozenset(("force", "forces", "law"))
"""Names of the functions that an engine calls for forces."""


class Profiler:
    """Profiler of the main thread: seconds spent in each kind of work, from its creation until the end of
    ``run_profiled``."""

    def __init__(self) -> None:
        self.seconds = defaultdict[str, float](float, {PYTHON_START_KIND: time.process_time()})
        self._main, self._over = threading.main_thread().ident, threading.Event()
        self._thread = threading.Thread(target=self._sample_stack, daemon=True)
        self._thread.start()

    def _sample_stack(self) -> None:
        """Repeatedly add the time since the last sample to the kind of work of the current call stack; a call that
        holds the interpreter's lock ends before the sample."""
        last_time = time.perf_counter()
        while not self._over.wait(SAMPLING_PERIOD):
            current_time = time.perf_counter()
            frame = sys._current_frames().get(self._main or 0)
            self.seconds[OTHER_KIND if frame is None else kind_of_work(frame)] += current_time - last_time
            last_time = current_time

    def run_profiled(self, run_study: Callable[[Any], dict[str, Any]], report_progress: Any) -> dict[str, Any]:
        """Run a study, stop the profiler, and return the study's summary with the profile's lines."""
        summary = run_study(report_progress)
        self._over.set()
        self._thread.join()
        spent: dict[str, float] = dict(sorted(self.seconds.items(), key=lambda part_and_seconds: -part_and_seconds[1]))
        return summary | {"profile": spent, "table": [*summary.get("table", []), *profile_lines(spent)]}


def kind_of_work(innermost_frame: FrameType) -> str:
    """Kind of work of a call stack, by its innermost call that can be classified."""
    engine, forces = "", False
    for name, path in _calls_of_stack(innermost_frame):
        if name == "<module>" or path.parts[:1] == ("<frozen importlib._bootstrap>",):
            return IMPORTS_KIND
        for folder in (*path.parts[-4:-1], path.stem):
            if folder in WORK_KIND_OF_LIBRARY:
                return WORK_KIND_OF_LIBRARY[folder]
        if path.stem.endswith(("_figure", "_figures")) or name == "_figure":
            return FIGURES_KIND
        if (name, path.stem) == ("save", "result") or path.stem == "whole_files":
            return SAVING_KIND
        forces = forces or name in FORCE_FUNCTIONS
        within = _engine_of_source(path)
        engine = engine or within
        if name in MARCH_FUNCTIONS and (within or path.stem == "march"):
            work_part = f"marching in {engine}" if engine else OUTSIDE_ENGINES_KIND
            return f"forces asked for by {engine}" if engine and forces else work_part
    return f"building in {engine}" if engine else OTHER_KIND


def _calls_of_stack(innermost_frame: FrameType | None) -> Iterator[tuple[str, PurePath]]:
    """Yield name and file of each function of a call stack, the innermost first, down to the script itself."""
    while innermost_frame is not None and innermost_frame.f_globals.get("__name__") != "__main__":
        yield innermost_frame.f_code.co_name, PurePath(innermost_frame.f_code.co_filename)
        innermost_frame = innermost_frame.f_back


def _engine_of_source(source_path: PurePath) -> str:
    """Name of the engine that a source file belongs to, in its own package or in ``models/engines``; else ""."""
    if source_path.parent.name in ENGINE_NAMES:
        return source_path.parent.name
    named = (engine for engine in ENGINE_NAMES if engine in source_path.stem)
    return next(named, "") if source_path.parent.name == "engines" else ""


def profile_lines(seconds_by_kind: dict[str, float]) -> list[str]:
    """Lines for the screen: seconds and share of each kind of work, in the order of ``seconds_by_kind``."""
    total_seconds = sum(seconds_by_kind.values())
    rows = [
        f"    {work_part:<30} {seconds:8.2f} s {seconds / total_seconds:6.1%}"
        for work_part, seconds in seconds_by_kind.items()
    ]
    return [f"  where {total_seconds:.1f} s went, by a look every {1000 * SAMPLING_PERIOD:.0f} ms", *rows]
