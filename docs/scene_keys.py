"""Reference page of scene keys, written from the models that read scenes.

``python -m docs.scene_keys`` writes ``docs/reference/scenes.md``. For every system the page has the keys of its scenes
and of the effects that have tables, each with its type, unit, default and meaning; then the keys of vehicle files, of
parameter sets and the options of studies. What stands there is what the models check, and nothing is written by hand.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from inspect import getdoc
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from docs.pages import ROOT
from models.core.scene_effects import effect_names_of, effect_of, effect_sentences
from models.core.scene_file import SceneFile
from models.core.strict import LARGEST_QUANTITY
from models.core.systems import SYSTEMS
from studies.command.asked import study_names

PAGE = ROOT / "docs" / "reference" / "scenes.md"
PAGE_HEAD = """# Scene keys

<!-- written by `python -m docs.scene_keys`; do not edit -->

A scene is a TOML file. Its key `system` says which of the sections below holds; without it the system is `pitch-plane`.
A key that is not here is refused, with the nearest name that is. Quantities are in SI units. A default of *needed*
means that the scene must have the key; *none* means that what the key describes is absent.
"""
TYPE_NAMES = {float: "number", int: "whole number", str: "text", bool: "true or false", Any: "any value"}
READER_FIELDS = ("file", "folder")
"""Fields of a scene that are no keys, but state where it was read."""
OTHER_TABLES = (
    ("Vehicle files", "models.vehicles.vehicle_tables", "VehicleTable"),
    ("Parameters of the pitch-plane vehicle", "models.vehicles.pitch_plane", "PitchPlaneParameters"),
    ("Parameters of a wheelset", "models.rail.wheelset", "Wheelset"),
    ("Parameters of a bicycle", "models.bicycle.whipple", "Whipple"),
    ("Parameters of a braked vehicle", "models.brake.plane_vehicle", "Truck"),
)


@dataclass(frozen=True)
class Key:
    """A key of a scene as a line of the reference: name, type, unit, default and meaning."""

    name: str
    kind: str
    unit: str
    default: str
    meaning: str

    def row(self) -> str:
        """The key as a row of a Markdown table."""
        cells = (f"`{self.name}`", self.kind, self.unit, self.default, self.meaning)
        return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def keys_of(table_class: type[BaseModel], prefix: str = "") -> Iterator[Key]:
    """Yield the keys of a table and of its inner tables; NAME stands for a name that the user chooses, [] for entries
    of a list."""
    for name, field in table_class.model_fields.items():
        if issubclass(table_class, SceneFile) and name in READER_FIELDS:
            continue
        place, inner = _inner_table(field.annotation)
        meaning = _meaning_in_line(field.description or (_first_paragraph(inner) if inner else "")) or MEANINGS.get(
            name, ""
        )
        yield Key(prefix + name, _type_and_limits(field), _unit(field), _default(field, inner), meaning)
        if inner is not None:
            yield from keys_of(inner, f"{prefix}{name}{place}.")


MEANINGS = {
    "system": "the system of the scene",
    "engines": "settings of single engines",
    "run": "how long, and how finely",
    "body": "name of the body",
    "name": "name of the entry",
    "kind": "what is read",
}
"""Meanings of keys without a description in their model."""


def _inner_table(annotation: Any) -> tuple[str, type[BaseModel] | None]:
    """Suffix of the keys of a field's inner table ("[]" for lists, ".NAME" for named tables), and the model of this
    table, None if the field holds none."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "", annotation
    if origin in (Union, UnionType, Annotated):
        return next((pair for pair in map(_inner_table, arguments) if pair[1]), ("", None))
    if origin in (dict, list, tuple, Mapping) and arguments:
        place, inner = _inner_table(arguments[-1] if origin is not list else arguments[0])
        return ("[]" if origin is list else ".NAME") + place, inner
    return "", None


def _type_and_limits(field: FieldInfo) -> str:
    """Text of a field's type, with the limits of a number."""
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    limits = [(sign, getattr(rule, kind, None)) for rule in field.metadata for kind, sign in signs.items()]
    said = [f"{sign} {limit:g}" for sign, limit in limits if limit is not None and abs(limit) < LARGEST_QUANTITY]
    return ", ".join([_type_in_words(field.annotation), *said])


def _type_in_words(annotation: Any) -> str:
    """Text of a type in plain words, such as "whole number"."""
    origin, arguments = get_origin(annotation), [each for each in get_args(annotation) if each is not type(None)]
    if annotation in TYPE_NAMES:
        return TYPE_NAMES[annotation]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "table"
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in arguments)
    if origin is Annotated:
        return _type_in_words(arguments[0])
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(map(_type_in_words, arguments)))
    if origin is list:
        return f"list of {_plural(_type_in_words(arguments[0]))}"
    if origin is tuple:
        return f"list of {_plural(_type_in_words(arguments[0]))}"
    return "table" if origin in (dict, Mapping) else getattr(annotation, "__name__", str(annotation))


def _plural(word: str) -> str:
    """Plural of the words for a type."""
    known = {"text": "texts", "any value": "values"}
    return known.get(word, word if word.startswith("`") else re.sub(r"^(list|\S+( number)?)", r"\1s", word))


def _unit(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    return str(extra.get("unit") or "") if isinstance(extra, dict) else ""


def _default(field: FieldInfo, table_class: type[BaseModel] | None) -> str:
    """Text on the default of a key, which holds if a scene leaves it out."""
    if field.is_required():
        return "*needed*"
    value = field.get_default(call_default_factory=True)
    if value is None:
        return "*none*"
    if isinstance(value, BaseModel):
        return "as below" if table_class is not None else "usual"
    if value in ([], {}, (), ""):
        return "empty"
    return f"`{_toml_text(value)}`"


def _toml_text(scene_value: Any) -> str:
    """Text of a value in the notation of scene files (TOML)."""
    if isinstance(scene_value, bool):
        return str(scene_value).lower()
    if isinstance(scene_value, BaseModel):
        return _toml_text(scene_value.model_dump(exclude_none=True))
    if isinstance(scene_value, dict):
        return "{ " + ", ".join(f"{key} = {_toml_text(each)}" for key, each in scene_value.items()) + " }"
    if isinstance(scene_value, list | tuple):
        return "[" + ", ".join(map(_toml_text, scene_value)) + "]"
    return f'"{scene_value}"' if isinstance(scene_value, str) else f"{scene_value:.6g}"


def _first_paragraph(table_class: type[BaseModel]) -> str:
    """First paragraph of the docstring of a scene table's class, without its full stop."""
    return (getdoc(table_class) or "").partition("\n\n")[0].replace("\n", " ").rstrip(".")


def _meaning_in_line(meaning: str) -> str:
    """Meaning of a key in one line, without a leading name of its table."""
    return re.sub(r"^(One of )?\[[^\]]*\]+(, \[[^\]]*\]+)*[:.,]? *", "", " ".join(meaning.split()))


def scene_class(system: str) -> type[SceneFile]:
    """The pydantic model of the scenes of a system."""
    module = import_module(SYSTEMS[system].scene)
    models = [each for each in vars(module).values() if isinstance(each, type) and issubclass(each, SceneFile)]
    return next(each for each in models if each.__module__ == module.__name__)


def keys_table(table_class: type[BaseModel], prefix: str = "") -> list[str]:
    """Lines of a Markdown table of all keys of a scene table's class."""
    head = ["| key | type | unit | default | meaning |", "|---|---|---|---|---|"]
    return [*head, *(key.row() for key in keys_of(table_class, prefix))]


def system_section(system: str) -> list[str]:
    """Lines of the section on a system: its description, scene keys and effects."""
    says = (getdoc(import_module(SYSTEMS[system].package)) or "").partition("\n\n")[0].replace("\n", " ")
    lines = ["", f"## {system}", "", says, "", *keys_table(scene_class(system))]
    if SYSTEMS[system].effects:
        lines += ["", f"### Effects of {system}", "", "| effect | named by | what it adds | what it takes |"]
        lines += [
            "|---|---|---|---|",
            *(_effect_row(system, name, says) for name, says in effect_sentences(system).items()),
        ]
    for name in effect_names_of(system):
        model = getattr(effect_of(system, name), "Parameters", None)
        if model is not None and model.model_fields:
            lines += ["", f"`[effects.{name}]` of {system}", "", *keys_table(model)]
    return lines


def _effect_row(system: str, name: str, sentence: str) -> str:
    module = effect_of(system, name)
    place = module.PLACE if hasattr(module, "named") else f"[effects.{name}]"
    cells = (f"`{name}`", f"`{place}`", sentence, str(module.COST).rstrip("."))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def study_options_section() -> list[str]:
    """Lines of the section on the options of studies, which a scene sets in its table [options]."""
    lines = ["", "## Options of studies", "", "A scene sets the options of its study in the table `[options]`."]
    for name in study_names():
        model = getattr(import_module(f"studies.{name}"), "Options", None)
        if isinstance(model, type) and issubclass(model, BaseModel):
            lines += ["", f"### Study `{name}`", "", *keys_table(model)]
    return lines


def other_table_sections() -> list[str]:
    """Lines of the sections on files that scenes name: vehicles and parameter sets."""
    lines = []
    for title, module, name in OTHER_TABLES:
        model = getattr(import_module(module), name)
        lines += ["", f"## {title}", "", f"{_first_paragraph(model)}.", "", *keys_table(model)]
    return lines


def controllers_section() -> list[str]:
    """Lines of the section on the parameters of brake controllers, which a scene sets in [controller.parameters]."""
    from models.brake.controllers import CONTROLLERS
    from models.brake.controllers.per_wheel import AntiLockController

    lines = [
        "",
        "## Parameters of controllers",
        "",
        "A scene of braking sets them in `[controller.parameters]`. All have:",
    ]
    lines += ["", *_parameter_lines(AntiLockController, ("wheels",))]
    for kind, controller in CONTROLLERS.items():
        if is_dataclass(controller) and isinstance(controller, type):
            inherited = tuple(each.name for each in fields(AntiLockController))
            lines += ["", f"### Controller `{kind}`", "", *_parameter_lines(controller, inherited)]
    return lines


def _parameter_lines(kind: type, excluded_fields: tuple[str, ...]) -> list[str]:
    """Lines on the fields of a controller's class and their defaults; without the fields ``excluded_fields``."""
    shown_fields = [each for each in fields(kind) if each.name not in excluded_fields]
    rows = [f"| `{each.name}` | `{_toml_text(each.default)}` |" for each in shown_fields]
    head = ["", "| parameter | default |", "|---|---|"] if rows else []
    return [" ".join((getdoc(kind) or "").split()), *head, *rows]


def page() -> str:
    """Text of the reference page of scene keys."""
    lines = [line for system in SYSTEMS for line in system_section(system)]
    return (
        PAGE_HEAD
        + "\n".join([*lines, *other_table_sections(), *controllers_section(), *study_options_section()])
        + "\n"
    )


def main(path: Path = PAGE) -> None:
    """Write the reference page of scene keys."""
    path.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
