"""Files of other kinds that measurements come as: named for what they are, with what to do."""

import zipfile
from pathlib import Path

from validation.measured.measured_files.csv import whole
from validation.measured.measured_files.odd import Make, called, every, raw

TEXT = b"no table at all\n"
BINARY = bytes(range(32)) * 8


def archive(name: str, *members: str) -> Make:
    """Make a zip archive with these files in it."""

    def make(folder: Path) -> Path:
        with zipfile.ZipFile(folder / name, "w") as file:
            for member in members:
                file.writestr(member, whole())
        return folder / name

    return make


KINDS = (
    ("workbook", archive("odd.xlsx", "xl/workbook.xml", "[Content_Types].xml"), "Excel or OpenDocument workbook"),
    ("workbook called CSV", archive("odd.csv", "xl/workbook.xml"), "Excel or OpenDocument workbook"),
    ("damaged workbook", raw(b"PK\x03\x04" + BINARY, "odd.xlsx"), "workbook: save the sheet as CSV"),
    ("OpenDocument table", archive("odd.ods", "content.xml"), "workbook"),
    ("old workbook", raw(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + BINARY, "odd.xls"), "1997 to 2003"),
    ("archive with a table", archive("odd.zip", "a.csv"), "unpack it"),
    ("numpy arrays", archive("odd.npz", "a.npy"), "numpy"),
    ("packed table", raw(b"\x1f\x8b\x08" + BINARY, "odd.csv.gz"), "gzip: unpack"),
    ("MATLAB 5", raw(b"MATLAB 5.0 MAT-file, Platform: PCWIN64", "odd.mat"), "writetable"),
    ("MATLAB 4", raw(BINARY, "odd.mat"), "a MATLAB file"),
    ("text called .mat", raw(TEXT, "odd.mat"), "a MATLAB file"),
    ("HDF5", raw(b"\x89HDF\r\n\x1a\n" + BINARY, "odd.h5"), "HDF5"),
    ("Parquet", raw(b"PAR1" + BINARY, "odd.parquet"), "read_parquet"),
    (
        "bus trace as text",
        raw(b"date Mon Mar 2 09:30:00 am 2026\nbase hex  timestamps absolute\n", "odd.asc"),
        "bus messages (Vector ASC)",
    ),
    ("bus trace", raw(b"LOGG" + BINARY, "odd.blf"), "bus messages (Vector BLF)"),
    ("DIAdem header", raw(b"DIAEXTENDED  {@:ENGLISH\n#BEGINGLOBALHEADER\n", "odd.dat"), "export the data set as TDMS"),
    ("DIAdem TDM", raw(b'<?xml version="1.0"?>\n<usi:tdm xmlns="x"/>', "odd.tdm"), "TDMS or MDF 4"),
    ("LabVIEW text", raw(b"LabVIEW Measurement\t\nWriter_Version\t2\n", "odd.lvm"), "write TDMS in LabVIEW"),
    ("time history that is none", raw(BINARY, "odd.tim"), "begins with FORMAT"),
    ("drive file that is text", raw(TEXT, "odd.drv"), "begins with FORMAT"),
    ("MDF that is none", raw(BINARY, "odd.mf4"), "begins with MDF"),
    ("binary without a name", raw(BINARY, "odd.bin"), "no known format"),
)
FILES = every(
    {f"kind: {name}": ("its samples cannot be read", make, says) for name, make, says in KINDS},
    {
        "kind: RPC III called .drv": ("drive signals are no measurement", called(".rsp", "odd.drv"), "actuators"),
        "kind: table called .xlsx": (
            "saved under the wrong name",
            raw(whole().encode(), "odd.xlsx"),
            "extension .xlsx",
        ),
    },
    {
        "kind: RPC III called .tim": ("another extension of the same", called(".rsp", "odd.tim")),
        "kind: table called .asc": ("a bus trace, or text", raw(whole().encode(), "odd.asc")),
    },
)
