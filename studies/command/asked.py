"""The scene, its study and the engines that the user requests on the command line."""

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

from models.core.errors import InputError
from models.core.finding import Finding, finding_lines
from models.core.systems import DEFAULT_SYSTEM, SYSTEMS, load, systems_in_folder
from models.measured.file_kinds import is_measurement

STUDIES_FOLDER = Path(__file__).parents[1]
SCENES_FOLDER = STUDIES_FOLDER / "scenes"
KNOWN_SYSTEMS = SYSTEMS | systems_in_folder(STUDIES_FOLDER, STUDIES_FOLDER.name)
"""Systems that a scene can have: those of the models, and folders of studies with a module ``scene``."""
ANY_SYSTEM = "any"
"""Value of a study's SYSTEM if it runs scenes of all systems."""


@cache
def study_names() -> tuple[str, ...]:
    """Names of all studies: files of the studies' folder that define ``run(scene, engines, output_folder,
    report_progress)``; they are read, not imported."""
    files = sorted(STUDIES_FOLDER.glob("*.py"))
    return tuple(file.stem for file in files if re.search(r"^def run\(\s*scene", file.read_text(), re.MULTILINE))


def load_scene(scene_name: str, key_changes: list[str] | None) -> Any:
    """Load a scene, with changes KEY=VALUE, by the name of a shipped scene or from a file whose name ends in .toml."""
    return load(scene_path(scene_name), key_changes or (), KNOWN_SYSTEMS)


def scene_path(scene_name: str) -> Path:
    """Path of a scene's file, by the name of a shipped scene or of a file; raises InputError if there is none."""
    names = tuple(sorted(path.stem for path in SCENES_FOLDER.glob("*.toml")))
    if scene_name in names:
        return SCENES_FOLDER / f"{scene_name}.toml"
    if not scene_name.endswith(".toml") and not os.path.lexists(scene_name):
        raise InputError("", "scene", scene_name, "no such scene, and no such file", names)
    if is_measurement(Path(scene_name)):
        raise InputError(
            scene_name,
            "",
            None,
            f"this is no scene: `twinrig show {scene_name}` says what is in a measurement and prints a scene for it",
        )
    return Path(scene_name)


def checked_study(scene: Any, engines: tuple[str, ...]) -> Any:
    """The module of a scene's study, after all checks that are possible before a run; raises InputError."""
    module = study_module_of(scene)
    plan_module_of(scene).check(scene, engines)
    if hasattr(module, "check"):
        module.check(scene, engines)
    return module


def check_for_any_engine(scene: Any, engines: tuple[str, ...]) -> None:
    """Raise InputError if no engine can run the scene. If only some engines refuse it, nothing is raised."""
    try:
        checked_study(scene, engines)
    except InputError:
        if not any(_is_runnable(scene, engine) for engine in engines):
            raise


def _is_runnable(scene: Any, engine: str) -> bool:
    """Whether an engine passes all checks of a scene before its run."""
    try:
        checked_study(scene, (engine,))
    except InputError:
        return False
    return True


def runs_without_extras(scene: Any, engines: tuple[str, ...], study_module: Any) -> bool:
    """Whether a study runs without workers, unit conversion and code of the user."""
    code = getattr(plan_module_of(scene), "user_code", lambda scene: "")(scene)
    shared = hasattr(study_module, "BLOCKS_FOLDER") or scene.system == "measured"
    return not (code or shared or any(":" in engine for engine in engines))


def plan_module_of(scene: Any) -> Any:
    """The module that describes and checks the scenes of the scene's system."""
    return import_module(KNOWN_SYSTEMS[scene.system].plan)


def input_findings_of(scene: Any) -> tuple[Finding, ...]:
    """Findings of doubtful input of a scene, before any run; raises InputError for impossible input."""
    look = getattr(plan_module_of(scene), "findings", None)
    unended = (
        () if scene.system == "measured" else _unfinished_file_notes(scene)
    )  # whose files are remarked on as recordings
    return (*(look(scene) if look else ()), *unended)


def doubt_lines(scene: Any) -> list[str]:
    """Lines for the screen on doubtful values of a scene's vehicle and channels, which may be why it is refused."""
    from models.core.strict import Query

    checks = (*get_args(Query), "exchanged", "shift")
    with suppress(InputError):
        return finding_lines(finding for finding in input_findings_of(scene) if finding.check in checks)
    return []


def _unfinished_file_notes(scene: Any) -> Iterator[Finding]:
    """Yield a note for each CSV file of a scene whose last line has no line end."""
    from models.core.tables import has_line_end

    for name in dict.fromkeys(_csv_files_of_table(scene.table())):
        try:
            path = scene.path(name)
        except InputError:  # a file that is written, not read
            continue
        if not has_line_end(path):
            yield Finding(
                "file",
                "note",
                name,
                f"{name}: the last line has no line end; if the file was cut off, its last number may lack digits.",
            )


def _csv_files_of_table(scene_table: Any) -> Iterator[str]:
    """Yield the names of CSV files anywhere in nested tables."""
    if isinstance(scene_table, dict | list):
        for value in scene_table.values() if isinstance(scene_table, dict) else scene_table:
            yield from _csv_files_of_table(value)
    elif isinstance(scene_table, str) and scene_table.lower().endswith(".csv"):
        yield scene_table


def requested_engines(engine_option: str | None, system_name: str, option_name: str = "--engine") -> tuple[str, ...]:
    """The engines for a value of ``--engine`` and a system; none for a system without engines. option_name : of the
    option, for messages."""
    engines = KNOWN_SYSTEMS[system_name].engines
    if engine_option not in (None, "all") and not engines:
        raise InputError(
            option_name, "", engine_option, f"has no meaning for {system_name}, which no engine computes: leave it out"
        )
    if engine_option is None or engine_option == "all":
        return engines
    if ":" in engine_option:
        return _register_user_engine(engine_option, system_name, option_name)
    named = (*engines, *KNOWN_SYSTEMS[system_name].on_request)
    if engine_option not in named:
        raise InputError(option_name, "", engine_option, "no such engine", (*named, "all"))
    return (engine_option,)


def _register_user_engine(class_path: str, system_name: str, option_name: str) -> tuple[str, ...]:
    """Register an engine or integrator of the user, ``module:Class``; returns its name."""
    if system_name != DEFAULT_SYSTEM:
        raise InputError(
            option_name, "", class_path, f"can run scenes of {DEFAULT_SYSTEM} only, and this one is of {system_name}"
        )
    from models.engines.outside import register

    register(class_path)
    return (class_path,)


def study_module_of(scene: Any) -> Any:
    """The module of a scene's study; raises InputError for an unknown study, another system, and options that the study
    does not have."""
    from models.core.strict import read

    if scene.study not in study_names():
        raise InputError(scene.file, "study", scene.study, "no such study", study_names())
    module = import_module(f"studies.{scene.study}")
    systems = getattr(module, "SYSTEM", DEFAULT_SYSTEM)
    if systems not in (ANY_SYSTEM, scene.system):
        allowed = f"is a study of system {systems!r}; this scene's system is {scene.system!r}"
        raise InputError(scene.file, "study", scene.study, allowed)
    if hasattr(module, "Options"):
        read(module.Options, scene.options, scene.file, "options")
    elif scene.options:
        option_name, value = next(iter(scene.options.items()))
        raise InputError(scene.file, f"options.{option_name}", value, f"the study {scene.study!r} takes no options")
    return module
