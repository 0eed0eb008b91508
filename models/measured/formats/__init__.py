"""Measurement files, opened by what is in them: CSV, ASAM MDF, MTS RPC III, TDMS."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from importlib import import_module
from pathlib import Path

from models.errors import InputError, similar_file
from models.measured.channel import Source
from models.measured.formats.opened import Opened, notice
from models.measured.formats.writing import Group, check_names, check_start, whole_file

READERS = {"CSV": ("csv", "open_csv"), "ASAM MDF": ("mdf4", "open_mdf"), "RPC III": ("rpc3", "open_rpc"),
           "TDMS": ("tdms", "open_tdms")}  # fmt: skip
"""Format -> module and function; imported when such a file is opened."""
MAGIC = {
    b"MDF ": "ASAM MDF", b"UnFinMF": "ASAM MDF", b"TDSm": "TDMS", b"PK\x03\x04": "a spreadsheet or an archive",
    b"\x89HDF": "HDF5", b"MATLAB": "MATLAB", b"\x1f\x8b": "packed",
    b"\xff\xfe": "text in UTF-16, which has to be saved as UTF-8", b"\xfe\xff": "text in UTF-16, which has to be saved "
    "as UTF-8", b"TDSh": "the index of a TDMS file, whose data are in the .tdms file beside it",
}  # fmt: skip
"""First bytes of a file -> what it is."""
EXTENSIONS = {".csv": "CSV", ".txt": "CSV", ".mf4": "ASAM MDF", ".mdf": "ASAM MDF", ".dat": "ASAM MDF",
              ".rsp": "RPC III", ".rpc": "RPC III", ".drv": "RPC III", ".tim": "RPC III", ".tdms": "TDMS"}  # fmt: skip
KNOWN = "CSV, ASAM MDF (.mf4), MTS RPC III (.rsp) and TDMS can be read"


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
    form, reader = _reader(path, _head(path))
    source = reader(path)
    usual = EXTENSIONS.get(path.suffix.lower(), form)
    if usual == form:
        return source
    said = notice(path, "doubt", f"the extension {path.suffix} is that of {usual}, but the file is read as {form}")
    return replace(source, noticed=(said, *source.noticed))


def _reader(path: Path, head: bytes) -> tuple[str, Callable[[Path], Opened]]:
    """Format by the first bytes of a file, and the function that opens it."""
    found = next((what for magic, what in MAGIC.items() if head.startswith(magic)), "")
    if head[:32].split(b"\0")[0].strip() == b"FORMAT":
        found = "RPC III"
    if found and found not in READERS:
        raise InputError(path, "", None, f"this is {found}; {KNOWN}")
    if not found and b"\0" in head:
        raise InputError(path, "byte 0", head[:8].hex(" "), f"this is the beginning of no known format; {KNOWN}")
    form = found or "CSV"
    module, name = READERS[form]
    return form, getattr(import_module(f"models.measured.formats.{module}"), name)


WRITERS = {".csv": "write_csv", ".mf4": "write_mdf4:write_mdf", ".rsp": "write_rpc3:write_rpc", ".tdms": "write_tdms"}
"""Extension -> module and function."""


def write(
    path: str | Path, groups: Sequence[Group], start: datetime | None = None, comment: str = ""
) -> Path:
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
    with whole_file(path) as part:
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
