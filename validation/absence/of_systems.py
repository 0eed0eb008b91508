"""Checks of every system: a scene without effects runs no code of any effect, and each effect adds to the model the
counts that its file declares, and no more.

A fresh process first runs a bare scene (without effects) of each system while the files of the effects, and modules
that only they import, cannot be imported. Then, with all files present, it runs the scene with each effect in turn, as
a positive control. Last it runs the bare scene again, which must give the same path to the last bit.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest import mock

from models.core.errors import Refused
from models.core.scene_effects import effect_names_of, effect_of, with_effects
from models.core.systems import SYSTEMS, modules_of
from validation.absence.probes import registered_callbacks
from validation.common.rows import Observed, Row, System, behaviour_row

SYSTEM: System = "effects"
BARE_SCENE_FILES = {system: file for system, file in modules_of("validation.absence").items() if system in SYSTEMS}
"""System -> module of this folder that has the system's bare scene (without effects) and counts the components of a
run."""
Counts = dict[str, dict[str, int]]
"""Counts of a model's components, by engine and kind of component; the engine "all" stands for every engine."""


def absence_module_of(system_name: str) -> Any:
    """The module of this folder that has a system's scene without effects. It contains BARE_SCENE, ENGINES, and
    counts_and_path(scene, engine), which returns counts and path.

    If its scenes read files there is also write(folder). For effects without usual values there is
    HAND_WRITTEN_TABLES: tables that replace those of the bare scene, once without and once with the effect.
    """
    return import_module(BARE_SCENE_FILES[system_name])


def bare_scene(system_name: str, **replaced_tables: Any) -> Any:
    """The scene of a system without effects. Keyword arguments replace tables of the scene."""
    table = {**absence_module_of(system_name).BARE_SCENE, **replaced_tables}
    return import_module(SYSTEMS[system_name].scene).build(table, "bare", Path(_scene_folder(system_name).name))


@cache
def _scene_folder(system_name: str) -> tempfile.TemporaryDirectory[str]:
    """A temporary folder with the files that a system's scenes read; it lasts as long as this process."""
    folder = tempfile.TemporaryDirectory()
    getattr(absence_module_of(system_name), "write", lambda folder_path: None)(Path(folder.name))
    return folder


def hand_written_tables(system_name: str) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """For each effect without default values, by its name: the scene tables to use without and with the effect."""
    return getattr(absence_module_of(system_name), "HAND_WRITTEN_TABLES", {})


def counts_and_paths(system_name: str, scene: Any, is_quick: bool = False) -> dict[str, tuple[dict[str, int], bytes]]:
    """Engine -> counts of the model's components and path of a run as bytes, for all engines that accept the scene; if
    ``is_quick``, for the first engine alone. In Exudyn and MuJoCo the largest number of callbacks during the run is a
    count, too."""
    file, seen_by_engine = absence_module_of(system_name), dict[str, tuple[dict[str, int], bytes]]()
    for engine in file.ENGINES[:1] if is_quick else file.ENGINES:
        with suppress(Refused), registered_callbacks(engine) as callbacks:
            counts, path = file.counts_and_path(scene, engine)
            seen_by_engine[engine] = {**counts, **({"callbacks": max(callbacks)} if callbacks else {})}, path
    return seen_by_engine


def addable_effects(system_name: str) -> tuple[str, ...]:
    """Names of the effects that can be added to a system's bare scene, with usual values or with hand-written
    tables."""
    modules = {name: effect_of(system_name, name) for name in effect_names_of(system_name)}
    return tuple(
        name
        for name, module in modules.items()
        if name in hand_written_tables(system_name)
        or hasattr(module, "put_in")
        or "file" not in getattr(module, "EXAMPLE", ("file",))
    )


def scenes_with_and_without(system_name: str, effect_name: str) -> tuple[Any, Any]:
    """Two scenes that differ by one effect: the bare scene with only the effects that this effect needs, and the same
    scene with this effect added."""
    if effect_name in hand_written_tables(system_name):
        scene_without, scene_with = (
            bare_scene(system_name, **tables) for tables in hand_written_tables(system_name)[effect_name]
        )
        return scene_without, scene_with
    needs = effect_of(system_name, effect_name).NEEDS
    return with_effects(bare_scene(system_name), *needs), with_effects(bare_scene(system_name), *needs, effect_name)


def declared_counts(system_name: str, effect_name: str, engine_names: Iterable[str]) -> Counts:
    """Counts of components that an effect adds to a model in each engine, as its file declares them."""
    counts = effect_of(system_name, effect_name).COUNTS
    return {engine: {**counts.get("all", {}), **counts.get(engine, {})} for engine in engine_names}


def added_counts(system_name: str, effect_name: str, is_quick: bool = False) -> Counts:
    """Counts of components that an effect adds to the model in each engine, measured: counts of the scene with the
    effect minus counts of the scene without it, in engines that accept both."""
    counts_without, counts_with = (
        _counts_without_effect(system_name, effect_name, is_quick),
        counts_and_paths(system_name, scenes_with_and_without(system_name, effect_name)[1], is_quick),
    )
    return {
        engine: _count_increases(counts_without[engine], counts)
        for engine, (counts, _) in counts_with.items()
        if engine in counts_without
    }


def _counts_without_effect(system_name: str, effect_name: str, is_quick: bool) -> Counts:
    """Engine -> counts of components in the scene without an effect, but with the effects that it needs."""
    if effect_name in hand_written_tables(system_name):
        return _counts_with_tables(
            system_name, (), json.dumps(hand_written_tables(system_name)[effect_name][0]), is_quick
        )
    return _counts_with_tables(system_name, effect_of(system_name, effect_name).NEEDS, "{}", is_quick)


@cache
def _counts_with_tables(system_name: str, needed_effects: tuple[str, ...], tables_json: str, is_quick: bool) -> Counts:
    """Engine -> counts of components in a bare scene with some of its tables replaced and some effects added."""
    scene = with_effects(bare_scene(system_name, **json.loads(tables_json)), *needed_effects)
    return {engine: counts for engine, (counts, _) in counts_and_paths(system_name, scene, is_quick).items()}


def _count_increases(counts_before: dict[str, int], counts_after: dict[str, int]) -> dict[str, int]:
    return {key: n - counts_before[key] for key, n in counts_after.items() if n != counts_before[key]}


def absence_facts(system_names: tuple[str, ...] = tuple(BARE_SCENE_FILES)) -> dict[str, Any]:
    """Facts on the absence of effects, for the report; to be called in a fresh process. They are the modules that bare
    scenes and effects import, the counts that effects add, and whether removing the effects' files keeps the path."""
    modules_of = {
        system: sorted({module for effect_modules in _modules_of_effects(system).values() for module in effect_modules})
        for system in system_names
    }
    for system in system_names:
        if absence_module_of(system).ENGINES[0] == "reference":
            with _without_modules(system, modules_of[system]):
                counts_and_paths(system, bare_scene(system), is_quick=True)
    engines, bares = _loaded_modules(["exudyn", "mujoco"]), dict[str, Any]()
    for system in system_names:  # all of them before any effect, as two systems may have a module in common
        with _without_modules(system, modules_of[system]):
            bares[system] = counts_and_paths(system, bare_scene(system)), _loaded_modules(modules_of[system])
    return {"engines": engines, "systems": {system: _effect_facts(system, *bares[system]) for system in system_names}}


def _modules_of_effects(system_name: str) -> dict[str, tuple[str, ...]]:
    return {name: effect_of(system_name, name).MODULES for name in effect_names_of(system_name)}


def _effect_facts(
    system_name: str, first_counts_and_paths: dict[str, tuple[dict[str, int], bytes]], imported_modules: list[str]
) -> dict[str, Any]:
    modules = _modules_of_effects(system_name)
    adds, missing = dict[str, Counts](), []
    for name in addable_effects(system_name):
        adds[name] = added_counts(system_name, name)
        missing += [module for module in modules[name] if not _loaded_modules([module])]
    repeated = counts_and_paths(system_name, bare_scene(system_name))
    callbacks = {
        engine: counts["callbacks"] for engine, (counts, _) in first_counts_and_paths.items() if engine != "reference"
    }
    return {
        "imported": imported_modules,
        "missing": missing,
        "adds": adds,
        "callbacks": callbacks,
        "same": all(first_counts_and_paths[e][1] == repeated[e][1] for e in first_counts_and_paths),
    }


@contextmanager
def _without_modules(system_name: str, module_names: list[str]) -> Iterator[None]:
    """Context in which the files of a system's effects, and modules that only they import, cannot be imported."""
    assert not _loaded_modules(module_names), "the process is not fresh"
    blocked: dict[str, Any] = dict.fromkeys(module_names)
    sys.modules.update(blocked)
    package = import_module(SYSTEMS[system_name].effects)
    with mock.patch.object(package, "__path__", []), mock.patch.object(package, "TABLE", {}, create=True):
        assert not effect_names_of(system_name)
        yield
    for name in module_names:
        del sys.modules[name]


def _loaded_modules(module_names: list[str]) -> list[str]:
    loaded_modules = [name for name, module in sys.modules.items() if module is not None]
    return [
        name
        for name in module_names
        if any(loaded == name or loaded.startswith(f"{name}.") for loaded in loaded_modules)
    ]


@cache
def absence_facts_of_fresh_process() -> dict[str, Any]:
    """The result of ``absence_facts``, computed in a fresh process."""
    code = "import json; from validation.absence.of_systems import absence_facts; print(json.dumps(absence_facts()))"
    completed_process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return dict(json.loads(completed_process.stdout.splitlines()[-1]))


def rows(is_quick: bool) -> list[Row]:
    """Report rows: no effect leaves a trace in a scene that does not name it, and a positive control of each effect.
    If ``is_quick``, the positive control of every third effect, in one engine."""
    if is_quick:
        return [
            row
            for system in BARE_SCENE_FILES
            for row in _added_count_rows(
                system, {name: added_counts(system, name, is_quick) for name in addable_effects(system)[::3]}
            )
        ]
    seen_there = absence_facts_of_fresh_process()
    present = [
        row for system, probe in seen_there["systems"].items() for row in _added_count_rows(system, probe["adds"])
    ]
    engines = Observed(
        "absent.references.engines",
        SYSTEM,
        "engines that bare scenes of braking, contact, wheelset and ride import beside the reference that they run in",
        len(seen_there["engines"]),
        "",
    ).at_most(0, "a fresh process", "none")
    return [
        *present,
        engines,
        *(row for system, probe in seen_there["systems"].items() for row in _absence_rows(system, probe)),
    ]


def _absence_rows(system_name: str, absence_facts: dict[str, Any]) -> list[Row]:
    why = "in a fresh process in which none of them could have been imported, nor any effect's file read"
    return [
        Observed(
            f"absent.{system_name}.modules",
            SYSTEM,
            f"{system_name}: modules of effects that a bare scene imports, and those that no effect imports",
            len(absence_facts["imported"]) + len(absence_facts["missing"]),
            "",
        ).at_most(0, why, "none"),
        behaviour_row(
            f"absent.{system_name}.bits",
            SYSTEM,
            f"{system_name}: a bare scene takes the same path without the files of effects and after all effects ran",
            "the same" if absence_facts["same"] else "not the same",
            "the same",
            "to the last bit, in every implementation",
        ),
        *(
            Observed(
                f"absent.{system_name}.callbacks.{engine}",
                SYSTEM,
                f"{system_name}: callbacks that a bare scene has in {engine} beyond the one whose forces no engine has",
                count - 1,
                "",
            ).at_most(
                0,
                "counted over all items of "
                "the system that marches, or in the engine's globals; no effect adds any but what its file says",
                "none",
            )
            for engine, count in absence_facts["callbacks"].items()
        ),
    ]


def _added_count_rows(system_name: str, added_counts: dict[str, Counts]) -> list[Row]:
    """Report rows, one for each effect: the counts that it adds to a model against the counts that its file
    declares."""
    return [
        behaviour_row(
            f"absent.{system_name}.adds.{name}",
            SYSTEM,
            f"{system_name}: counts that the effect {name} adds to a bare scene",
            _counts_text(counts),
            _counts_text(declared_counts(system_name, name, counts)),
            "positive control: what its file says, and no more",
        )
        for name, counts in added_counts.items()
    ]


def _counts_text(counts_by_engine: Counts) -> str:
    """Text of the counts of each engine, such as "exudyn +1 callbacks"; without engines where all counts agree."""
    count_texts = {
        engine: ", ".join(f"{n:+d} {key}" for key, n in sorted(counted.items()))
        for engine, counted in counts_by_engine.items()
    }
    if len({*count_texts.values()}) == 1:
        return next(iter(count_texts.values())) or "nothing"
    return "; ".join(f"{engine} {text or 'nothing'}" for engine, text in count_texts.items())
