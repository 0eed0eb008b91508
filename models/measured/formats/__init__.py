"""Measurement files, opened by what is in them: CSV, ASAM MDF, MTS RPC III, TDMS."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from importlib import import_module
from pathlib import Path

from models.core.errors import InputError, similar_file
from models.measured.channel import Source
from models.measured.file_kinds import KNOWN, by_extension, format_of, usual_of
from models.measured.formats.opened import Opened, notice
from models.measured.formats.writing import Group, check_names, check_start, new_file

READERS = {
    "CSV": ("csv", "open_csv"),
    "ASAM MDF": ("mdf4", "open_mdf"),
    "RPC III": ("rpc3", "open_rpc"),
    "TDMS": ("tdms", "open_tdms"),
}
"""Format -> module and function; imported when such a file is opened."""
DRIVE = (
    "a .drv file usually holds what drives the actuators of a rig, not what was measured: name the response "
    "(.rsp) of the same run"
)


def open_source(path: str | Path) -> Source:
    """Open a measurement file for reading.

    Parameters
    ----------
    path : the file; its first bytes decide what it is, and an extension that says otherwise is noticed

    Raises
    ------
    InputError : naming the file, and the byte, line or sample where it cannot be read
    """
    path = Path(path)
    form = format_of(path, _head(path))
    source = _read(path, form)
    usual = usual_of(path.suffix.lower(), form)
    said = [
        notice(path, "doubt", text)
        for text in (
            f"the extension {path.suffix} is that of {usual}, but the file is read as {form}" if usual != form else "",
            DRIVE if form == "RPC III" and path.suffix.lower() == ".drv" else "",
        )
        if text
    ]
    return replace(source, noticed=(*said, *source.noticed))


def _read(path: Path, form: str) -> Opened:
    """Open a file by the reader of its format; what is said of text that is no CSV knows the extension."""
    module, name = READERS[form]
    reader: Callable[[Path], Opened] = getattr(import_module(f"models.measured.formats.{module}"), name)
    try:
        return reader(path)
    except InputError as error:
        if form != "CSV" or not by_extension(path):
            raise
        raise InputError(path, error.place, error.value, error.allowed + by_extension(path)) from None


WRITERS = {".csv": "write_csv", ".mf4": "write_mdf4:write_mdf", ".rsp": "write_rpc3:write_rpc", ".tdms": "write_tdms"}
"""Extension -> module and function."""


def write(path: str | Path, groups: Sequence[Group], start: datetime | None = None, comment: str = "") -> Path:
    """Write channels to a new file, in the format of its extension, block by block, whole or not at all.

    Parameters
    ----------
    path : .csv, .mf4, .rsp or .tdms; it must not exist
    groups : channels of one clock each; CSV and RPC III hold one group. Times are counted from ``start``
    start : when the first samples were, with its zone
    comment : of the file

    Resolution: every bit in CSV, MDF and TDMS, 2^-24 of a value in RPC III.

    Raises
    ------
    InputError : the file exists or cannot be written, or the format has no room for a name, a unit or a value; where
        that can be known beforehand, before any block is taken
    """
    path = Path(path)
    if path.suffix.lower() not in WRITERS:
        raise InputError(path, "extension", path.suffix, "a format that can be written is needed", tuple(WRITERS))
    check_names(path, groups)
    check_start(path, start)
    module, _, name = WRITERS[path.suffix.lower()].partition(":")
    writer = getattr(import_module(f"models.measured.formats.{module}"), name or module)
    with new_file(path) as part:
        writer(path, part, groups, start, comment)
    return path


def _head(path: Path) -> bytes:
    """First bytes of a file."""
    if not path.exists():
        raise InputError(path, "", None, f"the file does not exist{similar_file(path)}")
    if not path.is_file():
        raise InputError(path, "", None, f"this is not a file; {KNOWN}")
    try:
        with path.open("rb") as file:
            head = file.read(256)
    except OSError as error:
        raise InputError(path, "", None, f"the file cannot be read: {error.strerror}") from None
    if not head:
        raise InputError(path, "", None, "the file is empty")
    return head
