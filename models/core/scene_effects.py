"""Modelling effects that scenes name: entries of the system's table of effects, and files of its folder of effects.

A system's ``effects`` is the package that holds them. What a key of the system's own tables names is an
``EffectEntry`` of its ``TABLE``; an effect with physics or code of its own has a file, which nothing registers. It has

- a docstring, whose first sentence is its line in every list;
- ``COST``, one sentence on what it takes;
- what ``Effect`` names, as far as there is any.

A scene names it in one of two ways. Either by a table [effects.NAME]: then the file has ``Parameters``, ``EXAMPLE``, a
table of usual values, and ``extend(built, parameters)``, which puts it into what its system builds. Or by the system's
own tables: then the file has ``PLACE``, the key that names it, ``named(scene)``, and two edits of the scene's
table, ``leave_out(table, scene)`` and, if there are usual values, ``put_in(table, scene)``; both raise InputError with
the remedy where it cannot be. Where an effect is a choice of method, to leave it out is the next cheaper one.
"""

import ast
import re
import traceback
from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from models.core.errors import InputError, RunFailed
from models.core.strict import read
from models.core.systems import SYSTEMS

Table = dict[str, Any]


@dataclass(frozen=True)
class EffectEntry:
    """Entry in a system's table of effects, for an effect that is named by a key of the system's own tables.

    says : what it is, a sentence; place : the key, as "port.teeth"; cost : what it takes, a sentence; counts : what it
    adds in every engine, in_engines : what more in some; needs, excludes, why, after, modules, channels : as of
    ``Effect``.
    usual_value : what the key is where the effect has usual values, None where there are none. An effect that is not
    the presence of that one key has functions of its own: ``is_present(scene)``, ``leave_out(table, scene)``,
    ``put_in(table, scene)``.
    """

    says: str
    place: str
    cost: str
    counts: Mapping[str, int] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    why: str = ""
    after: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    usual_value: Any = None
    is_present: Callable[[Any], bool] | None = None
    leave_out: Callable[[Table, Any], None] | None = None
    put_in: Callable[[Table, Any], None] | None = None
    in_engines: Mapping[str, Mapping[str, int]] = field(default_factory=dict)

    def named(self, scene: Any) -> bool:
        """Whether a scene names the effect of this entry."""
        if self.is_present is not None:
            return self.is_present(scene)
        value = scene
        for key in self.place.split("."):
            value = getattr(value, key, None)
        return value is not None and value is not False and value != 0.0

    def drop(self, scene_table: Table, scene: Any) -> None:
        """Remove the effect from the nested tables of a scene."""
        if self.leave_out is not None:
            return self.leave_out(scene_table, scene)
        *parent_keys, key = self.place.split(".")
        for name in parent_keys:
            scene_table = scene_table[name]
        del scene_table[key]

    def add(self, scene_table: Table, scene: Any) -> None:
        """Add the effect with its usual values to the nested tables of a scene."""
        if self.put_in is not None:
            return self.put_in(scene_table, scene)
        *parent_keys, key = self.place.split(".")
        for name in parent_keys:
            scene_table = scene_table.setdefault(name, {})
        scene_table[key] = deepcopy(self.usual_value)


class Effect:
    """A modelling effect as its file or table entry defines it; attributes missing there have these defaults.

    Attributes
    ----------
    NEEDS, EXCLUDES : names of other effects of its system; WHY : a phrase for both
    AFTER : effects that come first where both are named, beside those that it needs
    COUNTS : {"all" or an engine: {count: change}}, what it adds to a scene; the proof of absence finds no others
    MODULES : those that are imported for its sake alone
    CHANNELS : names of further results of a run
    BESIDE : tables of effects that it needs, if those with usual values do not serve
    """

    NEEDS: tuple[str, ...] = ()
    EXCLUDES: tuple[str, ...] = ()
    WHY = ""
    AFTER: tuple[str, ...] = ()
    COUNTS: Mapping[str, Mapping[str, int]] = {}
    MODULES: tuple[str, ...] = ()
    CHANNELS: tuple[str, ...] = ()
    BESIDE: Mapping[str, Table] = {}

    def __init__(self, attributes: Mapping[str, Any]) -> None:
        vars(self).update(attributes)


def _effect_of_entry(entry: EffectEntry) -> Effect:
    """An ``Effect`` made from an entry of a system's table, with the attribute names of an effect's file."""
    field_names = ("place", "cost", "needs", "excludes", "why", "after", "modules", "channels")
    known = {key.upper(): getattr(entry, key) for key in field_names}
    known |= {"COUNTS": {"all": entry.counts, **entry.in_engines}} if entry.counts else {}
    known |= {"__doc__": entry.says, "named": entry.named, "leave_out": entry.drop}
    return Effect(known if entry.usual_value is None and entry.put_in is None else known | {"put_in": entry.add})


def effect_names_of(system_name: str) -> tuple[str, ...]:
    """Names of all effects that scenes of a system may have, listed without importing the effects' files."""
    return tuple(sorted({*_effect_files(system_name), *_entries_of_system(system_name)}))


def _entries_of_system(system_name: str) -> Mapping[str, EffectEntry]:
    """Entries of a system's table of effects, by effect name; empty if all its effects are in files."""
    package = SYSTEMS[system_name].effects
    return getattr(import_module(package), "TABLE", {}) if package else {}


def _effect_files(system_name: str) -> dict[str, Path]:
    """Files of a system's effects, by effect name."""
    package = SYSTEMS[system_name].effects
    folders = import_module(package).__path__ if package else ()
    return {file.stem: file for folder in folders for file in Path(folder).glob("[!_]*.py")}


def effect_sentences(system_name: str) -> dict[str, str]:
    """First sentence on each effect of a system, by effect name, read without importing the effect's file."""
    says = {name: _first_sentence(file) for name, file in _effect_files(system_name).items()}
    says |= {name: entry.says.rstrip(".") for name, entry in _entries_of_system(system_name).items()}
    return dict(sorted(says.items()))


def _first_sentence(effect_file: Path) -> str:
    """First line of the docstring of an effect's file, without its full stop."""
    try:
        text = ast.get_docstring(ast.parse(effect_file.read_text())) or ""
    except SyntaxError as error:
        return f"(cannot be read: line {error.lineno}: {error.msg})"
    return text.partition("\n")[0].rstrip(".")


def effect_of(system_name: str, effect_name: str) -> Any:
    """The ``Effect`` of a name, from the system's table or from the effect's own file. Raises InputError for an unknown
    name, or a file that lacks something."""
    if entry := _entries_of_system(system_name).get(effect_name):
        return _effect_of_entry(entry)
    try:
        file = import_module(f"{SYSTEMS[system_name].effects}.{effect_name}")
    except (ImportError, SyntaxError) as error:
        allowed = f"is no effect of {system_name} that can be imported: {error}"
        raise InputError(f"{effect_name}.py", "", None, allowed) from None
    needed = ("PLACE", "leave_out") if hasattr(file, "named") else ("Parameters", "extend")
    missing = [key for key in ("COST", *needed) if not hasattr(file, key)]
    if missing:
        raise InputError(
            f"{effect_name}.py",
            "",
            None,
            f"has no {' and no '.join(missing)}: models/core/scene_effects.py says what the file of an effect holds",
        )
    return Effect(vars(file))


def named_effects(scene: Any) -> tuple[str, ...]:
    """Names of the effects that a scene names. Those that only a table can name are not imported for this."""
    named = [
        name
        for name, file in _effect_files(scene.system).items()
        if name in effect_tables_of(scene) or _names_effect(scene, file)
    ]
    named += [name for name, entry in _entries_of_system(scene.system).items() if entry.named(scene)]
    return tuple(sorted(named))


def _names_effect(scene: Any, effect_file: Path) -> bool:
    """Whether the scene's system tables contain the key that names the effect in this file."""
    return _is_in_own_tables(effect_file) and effect_of(scene.system, effect_file.stem).named(scene)


def absent_effects(scene: Any) -> tuple[str, ...]:
    """Effects of the scene's system that the scene does not name."""
    named = named_effects(scene)
    return tuple(name for name in effect_names_of(scene.system) if name not in named)


def effect_tables_of(scene: Any) -> Mapping[str, Any]:
    """The scene's tables [effects.NAME], by effect name."""
    tables = getattr(scene, "effects", None)
    return tables if isinstance(tables, Mapping) else {}


@cache
def _is_in_own_tables(effect_file: Path) -> bool:
    """Whether the system's own tables have a key for the effect, according to the text of the effect's file."""
    return re.search(r"^def named\(", effect_file.read_text(), re.MULTILINE) is not None


def read_tables(effect_tables: Mapping[str, Any], system_name: str, scene_path: str) -> Table:
    """Checked parameters of all tables [effects.NAME]; InputError for an effect that is unknown or has another key."""
    return {name: _checked_table(name, values, system_name, scene_path) for name, values in effect_tables.items()}


def with_effect_tables(scene: Any) -> Any:
    """The scene with its tables [effects.NAME] read and checked; refuses unknown effects and effects that exclude each
    other."""
    extended_scene = scene.model_copy(update={"effects": read_tables(scene.effects, scene.system, scene.file)})
    if extended_scene.effects:
        check_effects(extended_scene)
    return extended_scene


def extended_by_effects(system_object: Any, scene: Any) -> Any:
    """The object that a system built from a scene, extended by the effects in the tables [effects.NAME]."""
    for name, table in effect_tables_of(scene).items():
        system_object = _extended_by_effect(name, effect_of(scene.system, name), system_object, table)
    return system_object


def _extended_by_effect(effect_name: str, effect: Any, system_object: Any, effect_table: Any) -> Any:
    """The system's object, extended by one effect; InputError if the effect's ``extend`` fails or returns nothing."""
    try:
        result = effect.extend(system_object, effect_table)
    except (InputError, RunFailed):
        raise
    except Exception as error:
        lines = [
            frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == effect.__file__
        ]
        allowed = f"line {lines[-1]} stops with {type(error).__name__}: {error}"
        raise InputError(f"{effect_name}.py", "extend", None, allowed) from error
    if result is None:
        allowed = "returns nothing: it must give back what it gets, changed"
        raise InputError(f"{effect_name}.py", "extend", None, allowed)
    return result


def _checked_table(effect_name: str, table_values: Any, system_name: str, scene_path: str) -> Any:
    """Checked parameters of one table [effects.NAME]; raises InputError for an unknown effect."""
    if effect_name not in effect_names_of(system_name):
        raise InputError(scene_path, f"effects.{effect_name}", None, "no such effect", effect_names_of(system_name))
    module = effect_of(system_name, effect_name)
    if not hasattr(module, "Parameters"):
        raise InputError(scene_path, f"effects.{effect_name}", None, f"has another place in a scene: {module.PLACE}")
    return read(module.Parameters, table_values, scene_path, f"effects.{effect_name}")


def check_effects(scene: Any) -> None:
    """Raise InputError, with the remedy, if a scene's effects exclude each other or lack an effect that they need."""
    check_combination(named_effects(scene), scene)


def check_combination(present_effects: Iterable[str], scene: Any) -> None:
    """Raise InputError if these effects (names) of a scene exclude each other or lack one that they need."""
    present_effects = tuple(present_effects)
    for name in present_effects:
        module = effect_of(scene.system, name)
        why = f", {module.WHY}" if module.WHY else ""
        for other_effect in module.NEEDS:
            if other_effect not in present_effects:
                raise InputError(
                    scene.file,
                    _key_of_effect(module, name),
                    None,
                    f"needs the effect {other_effect!r}{why}: name it too"
                    f"{_drop_phrase(scene, other_effect, present_effects)}{_table_of_effect(scene, other_effect)}",
                )
        for other_effect in module.EXCLUDES:
            if other_effect in present_effects:
                raise InputError(
                    scene.file,
                    _key_of_effect(module, name),
                    None,
                    f"cannot stand beside {other_effect!r}{why}: drop one of them"
                    f"{_table_of_effect(scene, other_effect)}",
                )


def _drop_phrase(scene: Any, effect_name: str, present_effects: tuple[str, ...]) -> str:
    """Phrase that names the effects that cannot stand beside the effect ``effect_name``; empty if there are none."""
    clash = [other for other in effect_of(scene.system, effect_name).EXCLUDES if other in present_effects]
    return f" in place of {' and '.join(map(repr, clash))}, beside which it cannot stand" if clash else ""


def _key_of_effect(effect_module: Any, effect_name: str) -> str:
    """Key in the scene that names an effect, such as "effects.road"."""
    return str(effect_module.PLACE) if hasattr(effect_module, "named") else f"effects.{effect_name}"


def _table_of_effect(scene: Any, effect_name: str) -> str:
    """Phrase on the scene key that names an effect, if this is not the effect's own name; else empty."""
    key = _key_of_effect(effect_of(scene.system, effect_name), effect_name).removeprefix("effects.")
    return "" if key == effect_name else f"; {effect_name!r} is named by {key}"


def table_without_defaults(scene: Any) -> Table:
    """The scene's file as nested, editable tables, without default values."""
    table: Table = deepcopy(scene.model_dump(exclude_unset=True))
    return {key: value for key, value in table.items() if key not in ("file", "folder")}


def scene_without(scene: Any, *left_out: str) -> Any:
    """The scene without the given effects; InputError if an effect cannot be left out or another one needs it."""
    table = table_without_defaults(scene)
    for name in sorted(left_out, key=lambda name: _dependency_depth(name, scene.system), reverse=True):
        if name in effect_tables_of(scene):
            del table["effects"][name]
        else:
            effect_of(scene.system, name).leave_out(table, scene)
    smaller = _confirmed_scene(rebuilt_scene(table, scene), left_out, False)
    needy = [name for name in named_effects(scene) if set(left_out) & {*effect_of(scene.system, name).NEEDS}]
    gone = [name for name in needy if name not in (*left_out, *named_effects(smaller))]
    if gone:
        need = "it needs" if len(gone) == 1 else "they need"
        raise InputError(
            scene.file,
            "",
            None,
            f"{' and '.join(left_out)} cannot be left out alone: leave out {' and '.join(gone)}, too, for {need} it",
        )
    return smaller


def _dependency_depth(effect_name: str, system_name: str) -> int:
    """Length of the longest chain of needed effects from ``effect_name`` on; the longest chains are removed first."""
    return 1 + max(
        (_dependency_depth(other, system_name) for other in effect_of(system_name, effect_name).NEEDS), default=0
    )


def with_effects(scene: Any, *added_effects: str) -> Any:
    """The scene with the given effects added at their usual values; InputError if an effect cannot be added, or takes
    no part with these values."""
    table = table_without_defaults(scene)
    for name in added_effects:
        _add_effect(table, name, scene)
    return _confirmed_scene(rebuilt_scene(table, scene), added_effects, True)


def _confirmed_scene(scene: Any, effect_names: Iterable[str], must_be_named: bool) -> Any:
    """The scene, after a check that it names all these effects (``must_be_named``), or none of them."""
    named = named_effects(scene)
    for name in effect_names:
        if (name in named) is not must_be_named:
            refusal = (
                "cannot be in this scene: nothing of it takes part" if must_be_named else "is still there: leave it in"
            )
            raise InputError(
                scene.file, _key_of_effect(effect_of(scene.system, name), name), None, f"{name!r} {refusal}"
            )
    return scene


def _add_effect(scene_table: Table, effect_name: str, scene: Any) -> None:
    """Add an effect with its usual values to the nested tables of a scene; raises InputError if it has none."""
    module = effect_of(scene.system, effect_name)
    if "file" in getattr(module, "EXAMPLE", ()):
        raise InputError(scene.file, f"effects.{effect_name}.file", None, "has no usual value: name a file of yours")
    if hasattr(module, "EXAMPLE"):
        scene_table.setdefault("effects", {})[effect_name] = deepcopy(module.EXAMPLE)
    elif hasattr(module, "put_in"):
        module.put_in(scene_table, scene)
    else:
        raise InputError(
            scene.file, _key_of_effect(module, effect_name), None, "there are no usual values: name it in the scene"
        )


def rebuilt_scene(scene_table: Table, scene: Any) -> Any:
    """The scene made from an edited table, after all checks."""
    changed_scene = import_module(SYSTEMS[scene.system].scene).build(scene_table, scene.file, Path(scene.folder))
    check_effects(changed_scene)
    return changed_scene


def effect_lines(scene: Any, line_width: int = 10) -> list[str]:
    """Lines of ``twinrig show``: one per effect of the scene with its cost, and one that lists all absent effects."""
    cost_by_effect = {name: effect_of(scene.system, name).COST for name in named_effects(scene)}
    effect_lines_of_scene = [f"  {'effect':<{line_width}} {name}: {cost}" for name, cost in cost_by_effect.items()]
    return [
        *effect_lines_of_scene,
        f"  {'absent':<{line_width}} {', '.join(absent_effects(scene)) or 'nothing'} (not computed)",
    ]
