"""A scene as it was written, with what was checked of it; changes give a new scene, which is checked again."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.core.errors import InputError

CHANGED = " with changes"
"""Behind the name of a scene that is not as its file has it, which results keep."""


@dataclass(frozen=True, repr=False)
class Scene:
    """A checked scene.

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
        """Name of the system."""
        return str(self.checked.system)

    def with_(self, changes: Mapping[str, Any]) -> "Scene":
        """A scene with other values, as ``{"run.step": 5e-4}``: keys are dotted, entries of lists are numbered from 0.

        A value may be a table; None takes a key out. Raises InputError for what the scene does not understand.
        """
        return of_table(self.table, self.file, self.folder, changes)

    def plan(self) -> str:
        """Text of what the scene will compute: bodies, effects, channels, what each engine builds, what all that
        assumes."""
        from studies.command.asked import plan_of

        return str(plan_of(self.checked).describe(self.checked))

    def __repr__(self) -> str:
        head = f"{self.title}\n  system {self.system}, scene {self.file}"
        return "\n".join(
            [head, *(f"  {key} = {value!r}" for key, value in _dotted_values(self.table) if key != "title")]
        )


def of_table(table: Mapping[str, Any], file: str, folder: Path, changes: Mapping[str, Any]) -> Scene:
    """The checked scene of a table with changes of dotted keys; the table itself stays as it is."""
    from models.core.scene_file import set_key
    from models.core.systems import of_table as checked
    from studies.command.asked import KNOWN_SYSTEMS

    if not isinstance(changes, Mapping):
        raise InputError("set", "", changes, 'must be a table of dotted keys, for example {"run.step": 5e-4}')
    changed = plain(table)
    file = file + CHANGED if changes and not file.endswith(CHANGED) else file
    for key, value in changes.items():
        set_key(changed, str(key), plain(value))
    return Scene(changed, file, folder, checked(plain(changed), file, folder, KNOWN_SYSTEMS))


def plain(value: Any) -> Any:
    """A value as a scene file would hold it: arrays and tuples as lists, numpy's numbers as Python's, paths as text."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if hasattr(value, "tolist") else value


def _dotted_values(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Values of a nested table by their dotted keys."""
    for key, value in table.items():
        if isinstance(value, Mapping) and value:
            yield from _dotted_values(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
