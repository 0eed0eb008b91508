"""Where results go: a new folder each time, so that nothing earlier is overwritten or lost."""

from collections.abc import Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path

from models.errors import InputError

RESULTS = Path("results")
"""Where results go unless the user says otherwise, within the folder in which the command runs."""


def new_folder(wanted: Path | None, name: str) -> Path:
    """The folder that the user names, if it is empty, or the first free one under ``results/``.

    Raises InputError if the named folder holds anything or cannot be made.
    """
    if wanted is None:
        return _make(next(path for path in _candidates(name) if not path.exists()))
    try:
        if wanted.exists() and not wanted.is_dir():
            raise InputError("--out", "", str(wanted), "is a file: name a folder")
        if wanted.exists() and any(wanted.iterdir()):
            allowed = "holds files already and is left as it is: name a new or empty folder"
            raise InputError("--out", "", str(wanted), allowed)
    except OSError as error:
        raise InputError("--out", "", str(wanted), f"cannot be used: {error.strerror}") from None
    return _make(wanted)


def drop_if_empty(folder: Path) -> None:
    """Leave no trace of a run that saved nothing."""
    with suppress(OSError):
        folder.rmdir()
        if folder.parent == RESULTS:
            RESULTS.rmdir()


def _candidates(name: str) -> Iterator[Path]:
    yield RESULTS / name
    for i in count(2):
        yield RESULTS / f"{name}-{i}"


def _make(path: Path) -> Path:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("--out", "", str(path), f"cannot be made: {error.strerror}") from None
    return path
