"""Measurement files, opened by what is in them: CSV, ASAM MDF, MTS RPC III, TDMS."""

from pathlib import Path

from models.errors import InputError, similar_file
from models.measured.channel import Source

OTHERS = {b"PK\x03\x04": "a spreadsheet or an archive", b"\x89HDF": "HDF5", b"MATLAB": "MATLAB", b"\x1f\x8b": "packed",
          b"TDSh": "the index of a TDMS file, whose data are in the .tdms file beside it"}  # fmt: skip
KNOWN = "CSV, ASAM MDF (.mf4), MTS RPC III (.rsp) and TDMS can be read"


def open_source(path: str | Path) -> Source:
    """Open a measurement file for reading.

    Parameters
    ----------
    path : the file; its first bytes decide what it is, and its extension only has to be looked at twice if they differ

    Raises
    ------
    InputError : naming the file, and the byte, line or sample where it cannot be read
    """
    path = Path(path)
    head = _head(path)
    if head.startswith((b"MDF ", b"UnFinMF")):
        from models.measured.formats.mdf4 import open_mdf

        return open_mdf(path)
    for magic, name in OTHERS.items():
        if head.startswith(magic):
            raise InputError(path, "", None, f"this is {name}; {KNOWN}")
    if b"\0" in head:
        raise InputError(path, "byte 0", head[:8].hex(" "), f"this is the beginning of no known format: {KNOWN}")
    from models.measured.formats.csv import open_csv

    return open_csv(path)


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
