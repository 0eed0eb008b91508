"""Measurement files of four formats, recognised by their content: CSV, ASAM MDF, MTS RPC III, TDMS."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from models.core.errors import InputError, similar_file
from models.core.finding import Finding
from models.measured.channel import MeasurementSource
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


def open_source(measurement_path: str | Path) -> MeasurementSource:
    """The open measurement file at a path, for reading.

    Parameters
    ----------
    measurement_path : the file; its first bytes decide what it is, and an extension that says otherwise is noticed

    Raises
    ------
    InputError : naming the file, and the byte, line or sample where it cannot be read
    """
    measurement_path = Path(measurement_path)
    form = format_of(measurement_path, _first_bytes(measurement_path))
    try:
        source = READER_OF_FORMAT[form](measurement_path)
    except InputError as error:  # what is said of text that is no CSV knows the extension
        if form != "CSV" or not extension_phrase(measurement_path):
            raise
        raise InputError(
            measurement_path, error.place, error.value, error.allowed + extension_phrase(measurement_path)
        ) from None
    usual, said = usual_kind_of_extension(measurement_path.suffix.lower(), form), list[Finding]()
    if usual != form:
        text = f"the extension {measurement_path.suffix} is that of {usual}, but the file is read as {form}"
        said.append(flaw_finding(measurement_path, "doubt", text))
    if form == "RPC III" and measurement_path.suffix.lower() == ".drv":
        said.append(flaw_finding(measurement_path, "doubt", DRIVE_FILE_ADVICE))
    return replace(source, findings=(*said, *source.findings))


def write(
    measurement_path: str | Path,
    channel_groups: Sequence[ChannelGroup],
    start_time: datetime | None = None,
    comment: str = "",
) -> Path:
    """Write channels to a new file, in the format of its extension, block by block, whole or not at all.

    Parameters
    ----------
    measurement_path : .csv, .mf4, .rsp or .tdms; it must not exist
    channel_groups : channels of one clock each; CSV and RPC III hold one group. Times are counted from ``start_time``
    start_time : when the first samples were, with its zone
    comment : of the file

    Resolution: every bit in CSV, MDF and TDMS, 2^-24 of a value in RPC III.

    Raises
    ------
    InputError : the file exists or cannot be written, or the format has no room for a name, a unit or a value; where
        that can be known beforehand, before any block is taken
    """
    measurement_path = Path(measurement_path)
    if measurement_path.suffix.lower() not in WRITER_OF_EXTENSION:
        raise InputError(
            measurement_path,
            "extension",
            measurement_path.suffix,
            "a format that can be written is needed",
            tuple(WRITER_OF_EXTENSION),
        )
    check_groups(measurement_path, channel_groups, start_time)
    with new_file(measurement_path) as part:
        WRITER_OF_EXTENSION[measurement_path.suffix.lower()](
            measurement_path, part, channel_groups, start_time, comment
        )
    return measurement_path


def _first_bytes(measurement_path: Path) -> bytes:
    """First bytes of a file; raises InputError if it is missing, empty or unreadable."""
    if not measurement_path.exists():
        raise InputError(measurement_path, "", None, f"the file does not exist{similar_file(measurement_path)}")
    if not measurement_path.is_file():
        raise InputError(measurement_path, "", None, f"this is not a file; {KNOWN_FORMATS}")
    try:
        with measurement_path.open("rb") as file:
            head = file.read(256)
    except OSError as error:
        raise InputError(measurement_path, "", None, f"the file cannot be read: {error.strerror}") from None
    if not head:
        raise InputError(measurement_path, "", None, "the file is empty")
    return head
