"""Measurement files of four formats, recognised by their content: CSV, ASAM MDF, MTS RPC III, TDMS."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from models.core.errors import InputError, similar_file
from models.core.finding import Finding
from models.measured.channel import Source
from models.measured.file_kinds import KNOWN_FORMATS, extension_phrase, format_of, usual_kind_of_extension
from models.measured.formats.csv import open_csv
from models.measured.formats.mdf4 import open_mdf
from models.measured.formats.opened import OpenFile, flaw_finding
from models.measured.formats.rpc3 import open_rpc
from models.measured.formats.tdms import open_tdms
from models.measured.formats.writing import WRITER_OF_EXTENSION, ChannelGroup, check_groups, new_file

READER_OF_FORMAT: dict[str, Callable[[Path], OpenFile]] = {
    "CSV": open_csv,
    "ASAM MDF": open_mdf,
    "RPC III": open_rpc,
    "TDMS": open_tdms,
}
"""Function that opens a file, by format."""
DRIVE_FILE_ADVICE = (
    "a .drv file usually holds what drives the actuators of a rig, not what was measured: name the response "
    "(.rsp) of the same run"
)
"""Advice on drive files of a test rig."""


def open_source(path: str | Path) -> Source:
    """The open measurement file at a path, for reading.

    Parameters
    ----------
    path : the file; its first bytes decide what it is, and an extension that says otherwise is noticed

    Raises
    ------
    InputError : naming the file, and the byte, line or sample where it cannot be read
    """
    path = Path(path)
    form = format_of(path, _first_bytes(path))
    try:
        source = READER_OF_FORMAT[form](path)
    except InputError as error:  # what is said of text that is no CSV knows the extension
        if form != "CSV" or not extension_phrase(path):
            raise
        raise InputError(path, error.place, error.value, error.allowed + extension_phrase(path)) from None
    usual, said = usual_kind_of_extension(path.suffix.lower(), form), list[Finding]()
    if usual != form:
        text = f"the extension {path.suffix} is that of {usual}, but the file is read as {form}"
        said.append(flaw_finding(path, "doubt", text))
    if form == "RPC III" and path.suffix.lower() == ".drv":
        said.append(flaw_finding(path, "doubt", DRIVE_FILE_ADVICE))
    return replace(source, findings=(*said, *source.findings))


def write(path: str | Path, groups: Sequence[ChannelGroup], start: datetime | None = None, comment: str = "") -> Path:
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
    if path.suffix.lower() not in WRITER_OF_EXTENSION:
        raise InputError(
            path, "extension", path.suffix, "a format that can be written is needed", tuple(WRITER_OF_EXTENSION)
        )
    check_groups(path, groups, start)
    with new_file(path) as part:
        WRITER_OF_EXTENSION[path.suffix.lower()](path, part, groups, start, comment)
    return path


def _first_bytes(path: Path) -> bytes:
    """First bytes of a file; raises InputError if it is missing, empty or unreadable."""
    if not path.exists():
        raise InputError(path, "", None, f"the file does not exist{similar_file(path)}")
    if not path.is_file():
        raise InputError(path, "", None, f"this is not a file; {KNOWN_FORMATS}")
    try:
        with path.open("rb") as file:
            head = file.read(256)
    except OSError as error:
        raise InputError(path, "", None, f"the file cannot be read: {error.strerror}") from None
    if not head:
        raise InputError(path, "", None, "the file is empty")
    return head
