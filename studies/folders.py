"""Where results go: a new folder each time, so that nothing earlier is overwritten or lost."""

from itertools import count
from pathlib import Path

from models.errors import InputError


def new_folder(wanted: Path | None, name: str) -> Path:
    """The folder that the user names, if it is empty, or the first free one under ``results/``.

    Raises InputError if the named folder holds anything or cannot be made.
    """
    if wanted is None:
        return _make(next(path for path in _candidates(name) if not path.exists()))
    if wanted.exists() and not wanted.is_dir():
        raise InputError("--out", "", str(wanted), "is a file: name a folder")
    if wanted.exists() and any(wanted.iterdir()):
        raise InputError("--out", "", str(wanted), "holds files already and is left as it is: name a new or empty folder")
    return _make(wanted)


def _candidates(name: str):
    yield Path("results") / name
    for i in count(2):
        yield Path("results") / f"{name}-{i}"


def _make(path: Path) -> Path:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("--out", "", str(path), f"cannot be made: {error.strerror}") from None
    return path
