"""Output folders of runs: a new one each time, so that no earlier result is overwritten."""

import sys
from collections.abc import Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path

from models.core.errors import InputError
from models.core.whole_files import DISK_FULL_ERRORS, remove_partial_files

COMMAND_FILE = "command.txt"
"""Name of the first file of an output folder: the command line that made the other files."""
RESULTS_FOLDER = Path("results")
"""Default parent folder of all output folders, within the working folder."""


def new_folder(requested_folder: Path | None, base_name: str) -> Path:
    """The output folder that the user named, which must be empty, or the first unused one under ``results/``.

    Raises InputError if the named folder holds anything or cannot be made. Two runs at the same time never
    get the same folder: it is made, or its first file is, in one step that only one of them can take.
    """
    if requested_folder is None:
        return next(path for path in _candidate_folders(base_name) if _make_folder(path))
    check_unused(requested_folder)
    _make_folder(requested_folder)
    if not _take_folder(requested_folder):
        raise _used_folder(requested_folder)
    return requested_folder


def check_unused(requested_folder: Path) -> None:
    """Raise InputError if the path is a file, or a folder that holds anything or cannot be read; nothing is made."""
    try:
        if requested_folder.exists() and not requested_folder.is_dir():
            raise InputError("--out", "", str(requested_folder), "is a file: name a folder")
        is_used = requested_folder.is_dir() and any(requested_folder.iterdir())
    except OSError as error:
        raise _unwritable_folder(requested_folder, "cannot be used", error) from None
    if is_used:
        raise _used_folder(requested_folder)


def _used_folder(output_folder: Path) -> InputError:
    """The error for a folder with files of an earlier run."""
    return InputError(
        "--out", "", str(output_folder), "holds files already and is left as it is: name a new or empty folder"
    )


def resumed_folder(requested_folder: Path, blocks_subfolder: str) -> Path:
    """The output folder of an interrupted run, which has no results yet except finished blocks in the subfolder
    ``blocks_subfolder``; raises InputError for any other folder.

    What the run left of files when it was killed is removed.
    """
    has_begun = requested_folder.is_dir() and {path.name for path in requested_folder.iterdir()} <= {COMMAND_FILE}
    if not has_begun and not (requested_folder / blocks_subfolder).is_dir():
        allowed = f"holds no unfinished run: name a folder with {blocks_subfolder!r} in it, or leave out --resume"
        raise InputError("--resume", "", str(requested_folder), allowed)
    remove_partial_files(requested_folder)
    return requested_folder


def _take_folder(output_folder: Path) -> bool:
    """Claim an output folder by writing the command into it as its first file; False if another run claimed it
    before."""
    try:
        with (output_folder / COMMAND_FILE).open("x", encoding="utf-8", errors="backslashreplace") as file:
            file.write(" ".join(sys.argv) + "\n")
    except FileExistsError:
        return False
    except OSError as error:
        (output_folder / COMMAND_FILE).unlink(missing_ok=True)
        error.filename = str(output_folder / COMMAND_FILE)
        raise
    return True


def drop_if_empty(output_folder: Path) -> None:
    """Remove the output folder of a run that saved nothing."""
    with suppress(OSError):
        if [path.name for path in output_folder.iterdir()] == [COMMAND_FILE]:
            (output_folder / COMMAND_FILE).unlink()
        output_folder.rmdir()
        if output_folder.parent == RESULTS_FOLDER:
            RESULTS_FOLDER.rmdir()


def _candidate_folders(base_name: str) -> Iterator[Path]:
    """Possible output folders under ``results/``: ``base_name``, then name-2, name-3, ..."""
    yield RESULTS_FOLDER / base_name
    for i in count(2):
        yield RESULTS_FOLDER / f"{base_name}-{i}"


def _make_folder(output_folder: Path) -> bool:
    """Create an output folder; False if it exists already."""
    try:
        output_folder.mkdir(parents=True)
    except FileExistsError:
        return False
    except OSError as error:
        raise _unwritable_folder(output_folder, "cannot be made", error) from None
    return True


def _unwritable_folder(output_folder: Path, reason: str, error: OSError) -> Exception:
    """The error to raise for an output folder that cannot be written: InputError, or the original error if the disk is
    full."""
    return (
        error
        if error.errno in DISK_FULL_ERRORS
        else InputError("--out", "", str(output_folder), f"{reason}: {error.strerror}")
    )
