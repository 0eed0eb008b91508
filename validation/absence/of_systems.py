"""Every system: a scene that names nothing is made of no effect, and each effect adds what its file says and no more.

One fresh process runs a bare scene of each system while the files of its effects are not there and what only they
import cannot be imported; then, with all of it there, the scene with one effect after the other, each a positive
control; last the bare scene again, which must give the same path to the last bit.
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
from models.core.scene_effects import module_of, names_of, with_effects
from models.core.systems import SYSTEMS, modules_of
from validation.absence.probes import registered_callbacks
from validation.common.rows import Observed, Row, System, behaviour_row

SYSTEM: System = "effects"
BARE_SCENE_FILES = {system: file for system, file in modules_of("validation.absence").items() if system in SYSTEMS}
"""System -> the file beside this one, of its name, that has its bare scene and counts what a run of a scene is made
of; found by listing."""
Counts = dict[str, dict[str, int]]
"""By engine; "all" where every engine agrees."""


def file_of(system: str) -> Any:
    """The module that describes a system's bare scene. It has BARE_SCENE, ENGINES, and counts_and_path(scene, engine),
    which returns counts and path.

    If its scenes read files there is also write(folder), and BY_HAND for effects without usual values: what the bare
    scene has in place of its own tables without such an effect, and with it.
    """
    return import_module(BARE_SCENE_FILES[system])


def bare_scene(system: str, **instead: Any) -> Any:
    """The bare scene of a system. Keyword arguments replace tables of the scene."""
    table = {**file_of(system).BARE_SCENE, **instead}
    return import_module(SYSTEMS[system].scene).build(table, "bare", Path(_scene_folder(system).name))


@cache
def _scene_folder(system: str) -> tempfile.TemporaryDirectory[str]:
    """A temporary folder with the files that scenes of a system read; it lasts as long as this process."""
    folder = tempfile.TemporaryDirectory()
    getattr(file_of(system), "write", lambda folder_path: None)(Path(folder.name))
    return folder


def by_hand(system: str) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """For each effect without usual values: tables that replace those of the bare scene, once without and once with the
    effect."""
    return getattr(file_of(system), "BY_HAND", {})


def counts_and_paths(system: str, scene: Any, quick: bool = False) -> dict[str, tuple[dict[str, int], bytes]]:
    """Counts and path of a scene, by engine: all that do not refuse it, or only the first one if ``quick``. In Exudyn
    and MuJoCo the largest number of callbacks during the run is counted, too."""
    file, seen_by_engine = file_of(system), dict[str, tuple[dict[str, int], bytes]]()
    for engine in file.ENGINES[:1] if quick else file.ENGINES:
        with suppress(Refused), registered_callbacks(engine) as callbacks:
            counts, path = file.counts_and_path(scene, engine)
            seen_by_engine[engine] = {**counts, **({"callbacks": max(callbacks)} if callbacks else {})}, path
    return seen_by_engine


def addable_effects(system: str) -> tuple[str, ...]:
    """Effects that can be added to a bare scene, with their usual values or with tables written by hand."""
    modules = {name: module_of(system, name) for name in names_of(system)}
    return tuple(
        name
        for name, module in modules.items()
        if name in by_hand(system) or hasattr(module, "put_in") or "file" not in getattr(module, "EXAMPLE", ("file",))
    )


def scenes_with_and_without(system: str, effect: str) -> tuple[Any, Any]:
    """Two scenes that differ by one effect: the bare scene with only the effects that this effect needs, and the same
    with the effect."""
    if effect in by_hand(system):
        scene_without, scene_with = (bare_scene(system, **tables) for tables in by_hand(system)[effect])
        return scene_without, scene_with
    needs = module_of(system, effect).NEEDS
    return with_effects(bare_scene(system), *needs), with_effects(bare_scene(system), *needs, effect)


def declared_counts(system: str, effect: str, engines: Iterable[str]) -> Counts:
    """Counts that the effect's file declares, engine by engine."""
    counts = module_of(system, effect).COUNTS
    return {engine: {**counts.get("all", {}), **counts.get(engine, {})} for engine in engines}


def added_counts(system: str, effect: str, quick: bool = False) -> Counts:
    """Counts that an effect adds, by engine: the difference between the two scenes of ``scenes_with_and_without`` in
    engines that accept both."""
    counts_without, counts_with = (
        _counts_without_effect(system, effect, quick),
        counts_and_paths(system, scenes_with_and_without(system, effect)[1], quick),
    )
    return {
        engine: _count_increases(counts_without[engine], counts)
        for engine, (counts, _) in counts_with.items()
        if engine in counts_without
    }


def _counts_without_effect(system: str, effect: str, quick: bool) -> Counts:
    """Counts of the scene without an effect."""
    if effect in by_hand(system):
        return _counts_text(system, (), json.dumps(by_hand(system)[effect][0]), quick)
    return _counts_text(system, module_of(system, effect).NEEDS, "{}", quick)


@cache
def _counts_text(system: str, needs: tuple[str, ...], tables: str, quick: bool) -> Counts:
    """Counts, by engine, of a bare scene with some of its tables replaced (``tables``, JSON) and some effects added."""
    scene = with_effects(bare_scene(system, **json.loads(tables)), *needs)
    return {engine: counts for engine, (counts, _) in counts_and_paths(system, scene, quick).items()}


def _count_increases(counts_before: dict[str, int], counts_after: dict[str, int]) -> dict[str, int]:
    return {key: n - counts_before[key] for key, n in counts_after.items() if n != counts_before[key]}


def probed_facts(systems: tuple[str, ...] = tuple(BARE_SCENE_FILES)) -> dict[str, Any]:
    """Facts for the report, to be gathered in a fresh process: modules that bare scenes and effects import, counts that
    effects add, and whether an effect's removal keeps the path."""
    modules_of = {
        system: sorted({module for effect_modules in _modules_of_effects(system).values() for module in effect_modules})
        for system in systems
    }
    for system in systems:
        if file_of(system).ENGINES[0] == "reference":
            with _without_modules(system, modules_of[system]):
                counts_and_paths(system, bare_scene(system), quick=True)
    engines, bares = _loaded_modules(["exudyn", "mujoco"]), dict[str, Any]()
    for system in systems:  # all of them before any effect, as two systems may have a module in common
        with _without_modules(system, modules_of[system]):
            bares[system] = counts_and_paths(system, bare_scene(system)), _loaded_modules(modules_of[system])
    return {"engines": engines, "systems": {system: _probed_in_process(system, *bares[system]) for system in systems}}


def _modules_of_effects(system: str) -> dict[str, tuple[str, ...]]:
    return {name: module_of(system, name).MODULES for name in names_of(system)}


def _probed_in_process(
    system: str, first: dict[str, tuple[dict[str, int], bytes]], imported: list[str]
) -> dict[str, Any]:
    modules = _modules_of_effects(system)
    adds, missing = dict[str, Counts](), []
    for name in addable_effects(system):
        adds[name] = added_counts(system, name)
        missing += [module for module in modules[name] if not _loaded_modules([module])]
    repeated = counts_and_paths(system, bare_scene(system))
    callbacks = {engine: counts["callbacks"] for engine, (counts, _) in first.items() if engine != "reference"}
    return {
        "imported": imported,
        "missing": missing,
        "adds": adds,
        "callbacks": callbacks,
        "same": all(first[e][1] == repeated[e][1] for e in first),
    }


@contextmanager
def _without_modules(system: str, modules: list[str]) -> Iterator[None]:
    """Context in which the files of a system's effects, and modules that only they import, cannot be imported."""
    assert not _loaded_modules(modules), "the process is not fresh"
    blocked: dict[str, Any] = dict.fromkeys(modules)
    sys.modules.update(blocked)
    package = import_module(SYSTEMS[system].effects)
    with mock.patch.object(package, "__path__", []), mock.patch.object(package, "TABLE", {}, create=True):
        assert not names_of(system)
        yield
    for name in modules:
        del sys.modules[name]


def _loaded_modules(modules: list[str]) -> list[str]:
    loaded_modules = [name for name, module in sys.modules.items() if module is not None]
    return [
        name for name in modules if any(loaded == name or loaded.startswith(f"{name}.") for loaded in loaded_modules)
    ]


@cache
def measured_counts() -> dict[str, Any]:
    """The facts of ``probed_facts``, computed in a process of their own."""
    code = "import json; from validation.absence.of_systems import probed_facts; print(json.dumps(probed_facts()))"
    completed_process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return dict(json.loads(completed_process.stdout.splitlines()[-1]))


def rows(quick: bool) -> list[Row]:
    """Report rows: absence of every effect of every system, and a positive control of each; quick: every third effect,
    in one engine."""
    if quick:
        return [
            row
            for system in BARE_SCENE_FILES
            for row in _added_count_rows(
                system, {name: added_counts(system, name, quick) for name in addable_effects(system)[::3]}
            )
        ]
    seen_there = measured_counts()
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
        *(row for system, probe in seen_there["systems"].items() for row in _absent_modules(system, probe)),
    ]


def _absent_modules(system: str, seen_there: dict[str, Any]) -> list[Row]:
    why = "in a fresh process in which none of them could have been imported, nor any effect's file read"
    return [
        Observed(
            f"absent.{system}.modules",
            SYSTEM,
            f"{system}: modules of effects that a bare scene imports, and those that no effect imports",
            len(seen_there["imported"]) + len(seen_there["missing"]),
            "",
        ).at_most(0, why, "none"),
        behaviour_row(
            f"absent.{system}.bits",
            SYSTEM,
            f"{system}: a bare scene takes the same path without the files of effects and after all effects ran",
            "the same" if seen_there["same"] else "not the same",
            "the same",
            "to the last bit, in every implementation",
        ),
        *(
            Observed(
                f"absent.{system}.callbacks.{engine}",
                SYSTEM,
                f"{system}: callbacks that a bare scene has in {engine} beyond the one whose forces no engine has",
                count - 1,
                "",
            ).at_most(
                0,
                "counted over all items of "
                "the system that marches, or in the engine's globals; no effect adds any but what its file says",
                "none",
            )
            for engine, count in seen_there["callbacks"].items()
        ),
    ]


def _added_count_rows(system: str, added_counts: dict[str, Counts]) -> list[Row]:
    """A row for each effect on the counts that it adds."""
    return [
        behaviour_row(
            f"absent.{system}.adds.{name}",
            SYSTEM,
            f"{system}: counts that the effect {name} adds to a bare scene",
            _text(counts),
            _text(declared_counts(system, name, counts)),
            "positive control: what its file says, and no more",
        )
        for name, counts in added_counts.items()
    ]


def _text(counts_by_engine: Counts) -> str:
    """Text of the counts by engine; a single text where all engines have the same counts."""
    count_texts = {
        engine: ", ".join(f"{n:+d} {key}" for key, n in sorted(counted.items()))
        for engine, counted in counts_by_engine.items()
    }
    if len({*count_texts.values()}) == 1:
        return next(iter(count_texts.values())) or "nothing"
    return "; ".join(f"{engine} {text or 'nothing'}" for engine, text in count_texts.items())
