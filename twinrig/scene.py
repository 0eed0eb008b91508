"""A scene for users of the library: its table and the checked scene; changes give a new, checked scene."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.core.errors import InputError

CHANGED_SUFFIX = " with changes"
"""Suffix of the file name, in messages and results, of a scene that was changed."""


@dataclass(frozen=True, repr=False)
class Scene:
    """A checked scene of any system.

    table : nested dictionaries as the user wrote them; file : name for messages; folder : where files that the scene
    names lie; checked : the scene of its system, with defaults, in the system's own type.
    """

    table: Mapping[str, Any]
    file: str
    folder: Path
    checked: Any

    @property
    def title(self) -> str:
        """Title of the scene."""
        return str(self.checked.title)

    @property
    def system(self) -> str:
        """Name of the scene's system."""
        return str(self.checked.system)

    def with_(self, changes: Mapping[str, Any]) -> "Scene":
        """The scene with changed values, as ``{"run.step": 5e-4}``: keys are dotted, entries of lists are numbered from
        0.

        A value may be a table; None takes a key out. Raises InputError for what the scene does not understand.
        """
        return of_table(self.table, self.file, self.folder, changes)

    def plan(self) -> str:
        """Text on what the scene will compute: bodies, effects, channels, the model of each engine, and assumptions."""
        from studies.command.asked import plan_module_of

        return str(plan_module_of(self.checked).describe(self.checked))

    def __repr__(self) -> str:
        head = f"{self.title}\n  system {self.system}, scene {self.file}"
        return "\n".join(
            [head, *(f"  {key} = {value!r}" for key, value in _dotted_values(self.table) if key != "title")]
        )


def of_table(table: Mapping[str, Any], file: str, folder: Path, changes: Mapping[str, Any]) -> Scene:
    """The checked scene of a table with values changed by dotted keys; the table itself is unchanged."""
    from models.core.scene_file import set_key
    from models.core.systems import scene_of_table as checked
    from studies.command.asked import KNOWN_SYSTEMS

    if not isinstance(changes, Mapping):
        raise InputError("set", "", changes, 'must be a table of dotted keys, for example {"run.step": 5e-4}')
    changed = plain_value(table)
    file = file + CHANGED_SUFFIX if changes and not file.endswith(CHANGED_SUFFIX) else file
    for key, value in changes.items():
        set_key(changed, str(key), plain_value(value))
    return Scene(changed, file, folder, checked(plain_value(changed), file, folder, KNOWN_SYSTEMS))


def plain_value(value: Any) -> Any:
    """A value as a scene file would hold it: arrays and tuples as lists, numpy's numbers as Python's, paths as text."""
    if isinstance(value, Mapping):
        return {str(key): plain_value(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain_value(inner) for inner in value]
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if hasattr(value, "tolist") else value


def _dotted_values(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of a nested table with their dotted keys."""
    for key, value in table.items():
        if isinstance(value, Mapping) and value:
            yield from _dotted_values(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
