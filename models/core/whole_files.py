"""Files that are written completely or not at all, even if the disk is full, the process is killed or the machine
stops."""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PARTIAL_NAME = ".{}.{}.part{}"
"""Name of a file while it is written: the final name, the number of the process, and the extension again."""
DISK_FULL_ERRORS = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EFBIG)
"""Error numbers of the operating system for storage that is full: the disk, the user's quota, or the largest file
size."""


@contextmanager
def whole_file(output_path: Path) -> Iterator[Path]:
    """Context with the path of a temporary file beside ``output_path``; if the block ends without error, the file is
    renamed to ``output_path``.

    An earlier file of that name is replaced. After an error the temporary file is removed, and the error is raised
    again; an OSError then names ``output_path``.
    """
    partial_path = output_path.with_name(PARTIAL_NAME.format(output_path.name, os.getpid(), output_path.suffix))
    try:
        yield partial_path
        with partial_path.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(partial_path, output_path)
    except BaseException as error:
        partial_path.unlink(missing_ok=True)
        if isinstance(error, OSError):
            error.filename = str(output_path)
        raise


def write_whole(output_path: Path, file_content: bytes | memoryview | str) -> None:
    """Write a file completely or not at all, from bytes, or from text in UTF-8 with its line ends unchanged."""
    with whole_file(output_path) as partial_path:
        partial_path.write_bytes(file_content.encode() if isinstance(file_content, str) else file_content)


def remove_partial_files(folder: Path) -> None:
    """Remove temporary files and folders that killed processes left in a folder and its subfolders."""
    for partial_path in list(folder.rglob(PARTIAL_NAME.format("*", "*", "*"))):
        number = partial_path.name.rpartition(".part")[0].rpartition(".")[2]
        if number.isdigit() and not _runs_elsewhere(int(number)):
            shutil.rmtree(partial_path) if partial_path.is_dir() else partial_path.unlink(missing_ok=True)


def _runs_elsewhere(process_number: int) -> bool:
    """Whether another running process has this number; True where the operating system offers no harmless query."""
    if os.name != "posix":
        return True
    try:
        os.kill(process_number, 0)
    except OSError as error:
        return error.errno == errno.EPERM
    return process_number != os.getpid()


def write_error_phrase(write_error: OSError) -> str:
    """The operating system's reason why a file could not be written, as a phrase with the file name."""
    reason = "the disk is full" if write_error.errno in DISK_FULL_ERRORS else write_error.strerror or str(write_error)
    return " ".join(reason.split()) + (f" ({write_error.filename})" if write_error.filename else "")
