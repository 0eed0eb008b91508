"""Scene files: TOML tables read strictly, before anything is imported that only a run would need."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import Field, field_validator

from models.core.errors import InputError, similar_file
from models.core.strict import Strict, read


class SceneFile(Strict):
    """Keys that the scenes of all systems share; ``options`` is checked by the study that owns it."""

    CHOOSING: ClassVar[str] = "choice"
    """The study that chooses among the effects of a scene of this system."""

    title: str = Field(description="what the scene shows")
    system: str
    study: str = Field(description="the study that runs the scene")
    options: dict[str, Any] = Field(default_factory=dict, description="options of the study")
    quantities: list[str] = Field(default_factory=list, description="what a choice of effects must hold")
    tolerance: float | None = Field(default=None, gt=0, lt=1, description="relative, of their standard deviations")
    error: bool = Field(default=True, exclude=True, description="whether the error of steps or cells is estimated")
    workers: int | None = Field(
        default=None, ge=1, le=256, exclude=True, description="processes for what repeats; no result depends on it"
    )
    cluster: str | None = Field(
        default=None, exclude=True, description="address of a Dask scheduler whose workers compute in their place"
    )
    file: str = Field(default="", exclude=True)
    folder: str = Field(default=".", exclude=True)

    @field_validator("quantities")
    @classmethod
    def _refuse_repeats(cls, quantity_names: list[str]) -> list[str]:
        for name in quantity_names:
            if quantity_names.count(name) > 1:
                raise ValueError(f"names {name!r} twice")
        return quantity_names

    def table(self) -> dict[str, Any]:
        """The scene as nested tables of plain values with the defaults included, from which it can be run again."""
        return self.model_dump(exclude_none=True)

    def check_choice(self) -> None:
        """Require quantities and a tolerance where the scene lets its effects be chosen automatically; refuse them
        elsewhere."""
        automatic_keys = {"quantities": self.quantities or None, "tolerance": self.tolerance}
        for key, value in automatic_keys.items():
            if self.study == self.CHOOSING and value is None:
                asks = "which quantities must stay right" if key == "quantities" else "how wrong they may be, as 0.02"
                raise InputError(self.file, key, None, f"is missing: a choice of effects asks {asks}")
            if self.study != self.CHOOSING and value is not None:
                allowed = f'is read by effects = "auto", of the study {self.CHOOSING!r}, only'
                raise InputError(self.file, key, value, allowed)

    def path(self, file_name: str, key_path: str = "") -> Path:
        """Path of a file that the scene names at ``key_path``: in the scene's folder, or else in the working folder."""
        return existing_file(file_name, Path(self.folder), self.file, key_path)


Model = TypeVar("Model", bound=SceneFile)


def checked(scene_class: type[Model], scene_table: Mapping[str, Any], scene_path: str, scene_folder: Path) -> Model:
    """The scene of one system, built from nested tables; raises InputError for anything that is not understood."""
    if "effects" in scene_table and "effects" not in scene_class.model_fields:
        allowed = (
            "has no place in a scene of this system, which only shows or compares what others compute: put it "
            "into a scene of theirs, such as contact, wheelset or ride"
        )
        raise InputError(scene_path, "effects", None, allowed)
    for key in ("file", "folder"):
        if key in scene_table:
            raise InputError(
                scene_path,
                key,
                scene_table[key],
                "unknown key",
                tuple(set(scene_class.model_fields) - {"file", "folder"}),
            )
    checked_scene = read(
        scene_class,
        {
            **_table_with_chosen_effects(scene_class, scene_table, scene_path),
            "file": scene_path,
            "folder": str(scene_folder),
        },
        scene_path,
    )
    checked_scene.check_choice()
    return checked_scene


AUTOMATIC_EFFECTS = "auto"
"""Value of the key ``effects`` by which a scene has its effects chosen automatically."""


def _table_with_chosen_effects(
    scene_class: type[SceneFile], scene_table: Mapping[str, Any], scene_path: str
) -> dict[str, Any]:
    """The table of a scene with ``effects = "auto"``, rewritten as the study that chooses the effects."""
    plain = dict(scene_table)
    if plain.get("effects") == AUTOMATIC_EFFECTS:
        del plain["effects"]
        if plain.setdefault("study", scene_class.CHOOSING) != scene_class.CHOOSING:
            raise InputError(
                scene_path, "study", plain["study"], f'with effects = "auto" the study is {scene_class.CHOOSING}'
            )
    return plain


def existing_file(file_name: str, scene_folder: Path, scene_path: str, key_path: str) -> Path:
    """Path of the file ``file_name`` within ``scene_folder``, or else in the folder in which the command runs.

    Raises InputError that names the place of the scene that wanted it.
    """
    path = scene_folder / file_name
    try:
        if path.is_file():
            return path
        if not path.exists() and Path(file_name).is_file():
            return Path(file_name)
        if path.is_dir():
            raise InputError(scene_path, key_path, file_name, "is a folder: name a file")
    except OSError:  # such as a name that is too long
        pass
    raise InputError(scene_path, key_path, file_name, f"no such file, looked for as {str(path)!r}{similar_file(path)}")


def changed_tables(toml_path: Path, changes: Iterable[str]) -> dict[str, Any]:
    """A TOML file as nested tables, with changes of the form KEY.KEY=VALUE applied on top."""
    table = parse_toml(toml_path)
    for change in changes:
        _set_nested_key(table, change)
    return table


def parse_toml(toml_path: Path) -> dict[str, Any]:
    """A TOML file as nested tables; raises InputError where it cannot be read."""
    try:
        return tomllib.loads(toml_path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise InputError(toml_path, "", None, f"no such file{similar_file(toml_path)}") from None
    except OSError as error:
        raise InputError(toml_path, "", None, f"cannot be read as a file: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(toml_path, f"byte {error.start}", None, "the file must be text in UTF-8") from None
    except (ValueError, RecursionError) as error:  # tomllib's own, too long numbers, too deep nesting
        raise _not_toml(toml_path, error) from None


def _not_toml(toml_path: Path, parse_error: Exception) -> InputError:
    """InputError with the line at which reading a TOML file stopped."""
    if not isinstance(parse_error, tomllib.TOMLDecodeError):
        reason = "nested too deeply" if isinstance(parse_error, RecursionError) else "a number has too many digits"
        return InputError(toml_path, "", None, f"not valid TOML: {reason}")
    complaint, line, column = _ERROR_PLACE_PATTERN.fullmatch(str(parse_error)).groups()  # type: ignore[union-attr]
    if line is None:
        return InputError(toml_path, "", None, f"not valid TOML: {complaint}")
    text = toml_path.read_bytes().decode("utf-8-sig").splitlines()[int(line) - 1].strip()
    return InputError(toml_path, f"line {line}, column {column}", text, f"not valid TOML: {complaint}")


_ERROR_PLACE_PATTERN = re.compile(r"(.*?)(?: \(at line (\d+), column (\d+)\))?", re.DOTALL)
"""Pattern that splits a message of ``tomllib`` into complaint, line and column."""


def _set_nested_key(nested_table: dict[str, Any], assignment: str) -> None:
    """Set one nested key from text KEY.KEY=VALUE; the value is parsed as TOML, and taken as text if that fails."""
    key, equals, text = (text_part.strip() for text_part in assignment.partition("="))
    if not equals or not all(key.split(".")):
        raise InputError("--set", "", assignment, "must read KEY=VALUE, for example run.step=5e-4")
    container, last_key = _table_of_key(nested_table, key, text, "--set")
    container[last_key] = _parsed_value(text)


def set_key(nested_table: dict[str, Any], dotted_key: str, new_value: Any) -> None:
    """Set one nested key, such as "run.step" or "manoeuvres.0.speed", to a plain value; None removes the key.

    Raises InputError for a key that leads nowhere, and for one to be taken out that is not there.
    """
    if not all(dotted_key.split(".")):
        raise InputError("set", "", dotted_key, "must name a key, for example run.step")
    container, last_key = _table_of_key(nested_table, dotted_key, new_value, "set")
    if new_value is not None:
        container[last_key] = new_value
    elif isinstance(container, list) or last_key in container:
        del container[last_key]
    else:
        raise InputError("set", dotted_key, None, "is not in the scene and cannot be taken out", tuple(container))


def _table_of_key(nested_table: dict[str, Any], dotted_key: str, new_value: Any, scene_path: str) -> tuple[Any, Any]:
    """The table or list that holds a nested key, created if missing, and the key or index within it.

    new_value, scene_path : what a message shows as offending, and where it was written.
    """
    *parents, last_key = dotted_key.split(".")
    container: Any = nested_table
    for i, parent in enumerate(parents):
        container = (
            container.setdefault(parent, {})
            if isinstance(container, dict)
            else container[_list_index(container, parent, (scene_path, dotted_key, new_value))]
        )
        if not isinstance(container, dict | list):
            raise InputError(
                scene_path, dotted_key, new_value, f"{'.'.join(parents[: i + 1])} is a value, not a table of keys"
            )
    return container, last_key if isinstance(container, dict) else _list_index(
        container, last_key, (scene_path, dotted_key, new_value)
    )


def _list_index(list_items: list[Any], index_text: str, change: tuple[str, str, Any]) -> int:
    """Index in a list from its text, counted from 0 as in messages. change : file, key and value of the change, for
    the message."""
    if not (index_text.isdecimal() and int(index_text) < len(list_items)):
        raise InputError(*change, f"a list of {len(list_items)} has no entry {index_text!r}: they count from 0")
    return int(index_text)


def _parsed_value(value_text: str) -> Any:
    """Value parsed from text as in a scene file; text may stand without quotes."""
    for written in (
        (value_text,)
        if '"' in value_text or "'" in value_text
        else (value_text, BARE_POINT.sub(_with_digits, value_text))
    ):
        try:
            parsed = tomllib.loads(f"x = {written}")
        except (ValueError, RecursionError):
            continue
        return parsed["x"] if len(parsed) == 1 else value_text
    return value_text


BARE_POINT = re.compile(r"(?<![\w.])(?=\.?\d)(\d*)\.(\d*)(?=[eE][-+]?\d|(?![\w.]))")
"""Pattern of a number that may lack digits before or behind its decimal point, such as 20. or .5, which TOML does not
accept."""


def _with_digits(number_match: re.Match) -> str:
    """The number as text, with at least one digit on both sides of the decimal point."""
    return f"{number_match[1] or '0'}.{number_match[2] or '0'}"
