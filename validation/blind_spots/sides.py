"""Python functions that more than one side of a comparison calls, measured by a trace of short runs.

Shared modules hold thousands of functions of Python. Of these the audit asks about the ones that at least two engines
(the reference is one of them) call in runs of one scene and that give numbers there. Each run has a process of its own
that has read the scene before the trace begins. So functions that read scenes, convert their units and check them are
left out: they work once, for all sides, and a wrong one gives another scene to every side alike. Tests of scenes, of
vehicle files and of the units of measured files notice those. So are functions that judge what a run assumed.
"""

import tomllib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from models.core.systems import DEFAULT_SYSTEM, SYSTEMS, scene_of_table
from validation.blind_spots.rewriting import ROOT

SCENE_FOLDERS = tuple(ROOT / "validation" / name / "scenes" for name in ("replay", "blind_spots"))
"""Folders of scenes that are short to run and have as many tables as go together; file names are unique."""
JUDGE_SUFFIX = ".assumptions"
"""Suffix of modules that check assumptions of a run and give no number of its result."""
Run = tuple[str, str]
"""File name of a scene, and name of the engine that runs it."""


def scene_files() -> dict[str, Path]:
    """File name of a scene -> its path, for all scenes of ``SCENE_FOLDERS``."""
    return {path.name: path for folder in SCENE_FOLDERS for path in sorted(folder.glob("*.toml"))}


def runs_to_trace() -> list[Run]:
    """Runs to trace: each scene in every engine of its system, if the system has at least two engines."""
    engines = {name: engines_of(path) for name, path in scene_files().items()}
    return [(name, engine) for name, several in engines.items() if len(several) > 1 for engine in several]


def engines_of(scene_path: Path) -> tuple[str, ...]:
    """Names of the engines that can run a scene file, the engines on request included."""
    system = SYSTEMS[tomllib.loads(scene_path.read_text(encoding="utf-8")).get("system", DEFAULT_SYSTEM)]
    return (*system.engines, *system.on_request)


def prepared_scene(scene_path: str) -> Any:
    """Reads and checks a scene of ``scene_files``."""
    path = scene_files()[scene_path]
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    table.pop("engines_asked", None)  # the key of a recorded job
    return scene_of_table(table, scene_path, path.parent)


def engines_of_functions(run_traces: Iterable[Mapping[str, Any]]) -> dict[str, tuple[str, ...]]:
    """Function -> sorted engines that share it. Functions that no scene runs in two engines are left out.

    run_traces : for each run, "run" (a ``Run``) and "numbers", the names of the functions that gave numbers in it.
    """
    engines = defaultdict[tuple[str, str], set[str]](set)
    for each in run_traces:
        scene, engine = each["run"]
        for function in each["numbers"]:
            engines[function, scene].add(engine)
    shared = defaultdict[str, set[str]](set)
    for (function, _), several in engines.items():
        shared[function] |= several if len(several) > 1 else set()
    return {
        function: tuple(sorted(several))
        for function, several in shared.items()
        if several and not function.partition(":")[0].endswith(JUDGE_SUFFIX)
    }
