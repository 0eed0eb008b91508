"""Kind of a measurement file by its first bytes or its extension, with advice for kinds that cannot be read."""

import re
import zipfile
from dataclasses import dataclass
from pathlib import Path

from models.core.errors import InputError

FORMAT_OF_EXTENSION = {
    ".csv": "CSV",
    ".txt": "CSV",
    ".tsv": "CSV",
    ".mf4": "ASAM MDF",
    ".mdf": "ASAM MDF",
    ".dat": "ASAM MDF",
    ".rsp": "RPC III",
    ".rpc": "RPC III",
    ".drv": "RPC III",
    ".tim": "RPC III",
    ".tdms": "TDMS",
}
"""Usual format of a readable file, by its extension."""
FORMAT_OF_FIRST_BYTES = {b"MDF ": "ASAM MDF", b"UnFinMF": "ASAM MDF", b"TDSm": "TDMS", b"FORMAT\0": "RPC III"}
"""Format of a readable file, by its first bytes; any other text is read as CSV."""
KNOWN_FORMATS = "CSV, ASAM MDF (.mf4), MTS RPC III (.rsp) and TDMS can be read"
EXPORT_AS_CSV_ADVICE = "save its channels as CSV with a column time [s]"
DESCRIPTION_OF_FORMAT = {
    "ASAM MDF": "ASAM MDF, which begins with MDF",
    "TDMS": "TDMS, which begins with TDSm",
    "RPC III": "MTS RPC III (response .rsp, drive .drv, time history .tim), which begins with FORMAT",
}
"""Full name and first bytes of each format."""
WRITE_ANEW_ADVICE = f"write it anew from the software that has it, or {EXPORT_AS_CSV_ADVICE}"
DECODE_ADVICE = "decode its messages with their database (.dbc) into MDF 4, with asammdf or the logger's software"
UNPACK_ADVICE = "unpack it, and name the file inside"


@dataclass(frozen=True)
class UnreadableKind:
    """A kind of file that cannot be read here: its description, advice to the user, pattern of its first bytes,
    extensions."""

    name: str
    remedy: str
    first_bytes: bytes
    extensions: tuple[str, ...] = ()


UNREADABLE_KINDS = (
    UnreadableKind(
        "an Excel or OpenDocument workbook", "save the sheet as CSV UTF-8", rb"(?!)", (".xlsx", ".xlsm", ".ods")
    ),
    UnreadableKind("an Excel workbook of 1997 to 2003", "save the sheet as CSV UTF-8", rb"\xd0\xcf\x11\xe0", (".xls",)),
    UnreadableKind("text in UTF-32", "save it as UTF-8", rb"\xff\xfe\0\0|\0\0\xfe\xff"),
    UnreadableKind(
        "a MATLAB file",
        "write its channels as CSV with a column time [s]: writetable in MATLAB, scipy.io.loadmat in Python",
        rb"MATLAB",
        (".mat",),
    ),
    UnreadableKind(
        "HDF5",
        "write its channels as CSV with a column time [s], or as MDF 4: h5py in Python opens it",
        rb"\x89HDF",
        (".h5", ".hdf5", ".hdf"),
    ),
    UnreadableKind(
        "Parquet",
        "write it as CSV with a column time [s]: pandas.read_parquet(...).to_csv(...) in Python",
        rb"PAR1",
        (".parquet",),
    ),
    UnreadableKind(
        "Arrow or Feather",
        "write it as CSV with a column time [s]: pandas.read_feather(...).to_csv(...) in Python",
        rb"ARROW1",
        (".feather", ".arrow"),
    ),
    UnreadableKind("a trace of bus messages (Vector BLF)", DECODE_ADVICE, rb"LOGG", (".blf",)),
    UnreadableKind(
        "a trace of bus messages (Vector ASC)",
        DECODE_ADVICE,
        rb"(?i)(date [^\n]*\n\s*base (hex|dec)|base (hex|dec) )",
        (".asc",),
    ),
    UnreadableKind("a trace of bus messages (PEAK)", DECODE_ADVICE, rb";\$FILEVERSION", (".trc",)),
    UnreadableKind("a trace of bus messages (candump)", DECODE_ADVICE, rb"\s*\(\d+\.\d+\)\s+\w+\s", ()),
    UnreadableKind(
        "the header of a DIAdem data set, whose samples are in other files",
        "export the data set as TDMS",
        rb"(?i)(DIAEXTENDED|DIADEM|#BEGINGLOBALHEADER)",
        (),
    ),
    UnreadableKind(
        "the header of a DIAdem or ASAM ODS data set, whose samples are in another file",
        "export the data set as TDMS or MDF 4",
        rb"<\?xml[^>]*>\s*(<!--.*?-->\s*)*<(usi:tdm|atfx)",
        (".tdm", ".tdx", ".atfx"),
    ),
    UnreadableKind(
        "the index of a TDMS file", "name the .tdms file beside it, which has the data", rb"TDSh", (".tdms_index",)
    ),
    UnreadableKind(
        "a LabVIEW measurement file",
        f"write TDMS in LabVIEW, or {EXPORT_AS_CSV_ADVICE}",
        rb"LabVIEW Measurement",
        (".lvm",),
    ),
    UnreadableKind("a universal file of modal analysis", EXPORT_AS_CSV_ADVICE, rb"\s{1,4}-1\s", (".unv", ".uff")),
    UnreadableKind("imc FAMOS", "export it as MDF 4 or CSV from the software that wrote it", rb"\|CF,", (".raw",)),
    UnreadableKind("a Dewesoft file", "export it as MDF 4 or CSV from Dewesoft", rb"(?!)", (".dxd", ".d7d")),
    UnreadableKind("an nCode time series", "export it as RPC III or CSV", rb"(?!)", (".s3t", ".dac")),
    UnreadableKind("a CarMaker result file", "export it as MDF 4 or CSV", rb"(?!)", (".erg",)),
    UnreadableKind("a numpy array", EXPORT_AS_CSV_ADVICE, rb"\x93NUMPY", (".npy", ".npz")),
    UnreadableKind("packed by gzip", UNPACK_ADVICE, rb"\x1f\x8b", (".gz", ".tgz")),
    UnreadableKind("packed by bzip2", UNPACK_ADVICE, rb"BZh", (".bz2",)),
    UnreadableKind("packed by xz", UNPACK_ADVICE, rb"\xfd7zXZ", (".xz",)),
    UnreadableKind("packed by zstd", UNPACK_ADVICE, rb"\x28\xb5\x2f\xfd", (".zst",)),
    UnreadableKind("a 7-Zip archive", UNPACK_ADVICE, rb"7z\xbc\xaf", (".7z",)),
    UnreadableKind("a RAR archive", UNPACK_ADVICE, rb"Rar!", (".rar",)),
    UnreadableKind("a zip archive", UNPACK_ADVICE, rb"PK\x03\x04|PK\x05\x06", (".zip",)),
    UnreadableKind("a web page", EXPORT_AS_CSV_ADVICE, rb"(?i)\s*<(!doctype )?html", (".html", ".htm")),
    UnreadableKind("XML", EXPORT_AS_CSV_ADVICE, rb"<\?xml", (".xml",)),
    UnreadableKind("JSON", EXPORT_AS_CSV_ADVICE, rb"\s*[\[{]\s*[\[{\"]", (".json",)),
    UnreadableKind("a PDF", EXPORT_AS_CSV_ADVICE, rb"%PDF", (".pdf",)),
    UnreadableKind("sound", EXPORT_AS_CSV_ADVICE, rb"RIFF....WAVE", (".wav",)),
    UnreadableKind("an SQLite database", EXPORT_AS_CSV_ADVICE, rb"SQLite format 3", (".db", ".sqlite")),
)
"""Kinds of measurement files that cannot be read here; the first kind that fits a file is reported."""
WORKBOOK_KIND, ARRAYS_KIND = UNREADABLE_KINDS[0], next(kind for kind in UNREADABLE_KINDS if ".npz" in kind.extensions)


def format_of(measurement_path: Path, first_bytes: bytes) -> str:
    """Format of a file, from its first bytes; raises InputError with the kind of an unreadable file and advice."""
    form = next((form for magic, form in FORMAT_OF_FIRST_BYTES.items() if first_bytes.startswith(magic)), "")
    if form:
        return form
    if first_bytes[:32].split(b"\0")[0].strip() == b"FORMAT":
        return "RPC III"
    kind = next(
        (
            kind
            for kind in UNREADABLE_KINDS
            if re.match(kind.first_bytes, first_bytes.removeprefix(b"\xef\xbb\xbf"), re.DOTALL)
        ),
        None,
    )
    if kind is not None:
        if kind.extensions == (".zip",):
            kind = _archive_kind(measurement_path) or kind
        raise InputError(measurement_path, "", None, f"this is {kind.name}: {kind.remedy}; {KNOWN_FORMATS}")
    if is_text(first_bytes):
        return "CSV"
    allowed = f"this is the beginning of no known format{extension_phrase(measurement_path)}; {KNOWN_FORMATS}"
    raise InputError(measurement_path, "byte 0", first_bytes[:8].hex(" "), allowed)


def is_text(first_bytes: bytes) -> bool:
    """Whether the first bytes may be text: UTF-16 begins with its byte-order mark, other text has no zero byte."""
    return first_bytes.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" not in first_bytes


def usual_kind_of_extension(extension: str, format_name: str) -> str:
    """Usual kind of files with an extension; ``format_name``, this file's own format, for an unknown extension or
    .asc."""
    if extension in FORMAT_OF_EXTENSION or extension == ".asc":
        return FORMAT_OF_EXTENSION.get(extension, format_name)
    return next((kind.name for kind in UNREADABLE_KINDS if extension in kind.extensions), format_name)


def extension_phrase(measurement_path: Path) -> str:
    """Phrase on the usual kind of files with this file's extension; empty if the extension is unknown."""
    suffix = measurement_path.suffix.lower()
    kind = next((kind for kind in UNREADABLE_KINDS if suffix in kind.extensions), None)
    if kind is not None:
        return f", and its extension {measurement_path.suffix} is that of {kind.name}: {kind.remedy}"
    usual = DESCRIPTION_OF_FORMAT.get(FORMAT_OF_EXTENSION.get(suffix, ""), "")
    return (
        usual
        and f", and its extension {measurement_path.suffix} is that of {usual}: it is damaged or something else; "
        f"{WRITE_ANEW_ADVICE}"
    )


def is_measurement(measurement_path: Path) -> bool:
    """Whether a file may be a measurement: it has an extension of measurement files, or is no text."""
    if measurement_path.suffix.lower() in (
        *FORMAT_OF_EXTENSION,
        *(each for kind in UNREADABLE_KINDS for each in kind.extensions),
    ):
        return True
    if measurement_path.suffix.lower() in ("", ".toml") or not measurement_path.is_file():
        return False
    with measurement_path.open("rb") as file:
        return not is_text(file.read(256))


def _archive_kind(measurement_path: Path) -> UnreadableKind | None:
    """Kind of data in a zip archive: a spreadsheet workbook or numpy arrays; None for other contents."""
    try:
        with zipfile.ZipFile(measurement_path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError):
        return WORKBOOK_KIND if measurement_path.suffix.lower() in WORKBOOK_KIND.extensions else None
    if any(name.startswith("xl/") or name == "content.xml" for name in names):
        return WORKBOOK_KIND
    return ARRAYS_KIND if names and all(name.endswith(".npy") for name in names) else None
