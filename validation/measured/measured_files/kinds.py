"""Files of formats that cannot be read, such as workbooks and archives. The message must name the format and say what
to do."""

import zipfile
from pathlib import Path

from validation.measured.measured_files.csv import usual_text
from validation.measured.measured_files.odd import FileMaker, file_of_bytes, odd_files, usual_file_called

TEXT = b"no table at all\n"
BINARY = bytes(range(32)) * 8


def zip_archive(archive_name: str, *member_names: str) -> FileMaker:
    """Make a zip archive of files with these names; each contains the usual CSV text."""

    def make(output_folder: Path) -> Path:
        with zipfile.ZipFile(output_folder / archive_name, "w") as file:
            for member in member_names:
                file.writestr(member, usual_text())
        return output_folder / archive_name

    return make


KINDS = (
    ("workbook", zip_archive("odd.xlsx", "xl/workbook.xml", "[Content_Types].xml"), "Excel or OpenDocument workbook"),
    ("workbook called CSV", zip_archive("odd.csv", "xl/workbook.xml"), "Excel or OpenDocument workbook"),
    ("damaged workbook", file_of_bytes(b"PK\x03\x04" + BINARY, "odd.xlsx"), "workbook: save the sheet as CSV"),
    ("OpenDocument table", zip_archive("odd.ods", "content.xml"), "workbook"),
    ("old workbook", file_of_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + BINARY, "odd.xls"), "1997 to 2003"),
    ("archive with a table", zip_archive("odd.zip", "a.csv"), "unpack it"),
    ("numpy arrays", zip_archive("odd.npz", "a.npy"), "numpy"),
    ("packed table", file_of_bytes(b"\x1f\x8b\x08" + BINARY, "odd.csv.gz"), "gzip: unpack"),
    ("MATLAB 5", file_of_bytes(b"MATLAB 5.0 MAT-file, Platform: PCWIN64", "odd.mat"), "writetable"),
    ("MATLAB 4", file_of_bytes(BINARY, "odd.mat"), "a MATLAB file"),
    ("text called .mat", file_of_bytes(TEXT, "odd.mat"), "a MATLAB file"),
    ("HDF5", file_of_bytes(b"\x89HDF\r\n\x1a\n" + BINARY, "odd.h5"), "HDF5"),
    ("Parquet", file_of_bytes(b"PAR1" + BINARY, "odd.parquet"), "read_parquet"),
    (
        "bus trace as text",
        file_of_bytes(b"date Mon Mar 2 09:30:00 am 2026\nbase hex  timestamps absolute\n", "odd.asc"),
        "bus messages (Vector ASC)",
    ),
    ("bus trace", file_of_bytes(b"LOGG" + BINARY, "odd.blf"), "bus messages (Vector BLF)"),
    (
        "DIAdem header",
        file_of_bytes(b"DIAEXTENDED  {@:ENGLISH\n#BEGINGLOBALHEADER\n", "odd.dat"),
        "export the data set as TDMS",
    ),
    ("DIAdem TDM", file_of_bytes(b'<?xml version="1.0"?>\n<usi:tdm xmlns="x"/>', "odd.tdm"), "TDMS or MDF 4"),
    ("LabVIEW text", file_of_bytes(b"LabVIEW Measurement\t\nWriter_Version\t2\n", "odd.lvm"), "write TDMS in LabVIEW"),
    ("time history that is none", file_of_bytes(BINARY, "odd.tim"), "begins with FORMAT"),
    ("drive file that is text", file_of_bytes(TEXT, "odd.drv"), "begins with FORMAT"),
    ("MDF that is none", file_of_bytes(BINARY, "odd.mf4"), "begins with MDF"),
    ("binary without a name", file_of_bytes(BINARY, "odd.bin"), "no known format"),
)
FILES = odd_files(
    {f"kind: {name}": ("its samples cannot be read", make, says) for name, make, says in KINDS},
    {
        "kind: RPC III called .drv": (
            "drive signals are no measurement",
            usual_file_called(".rsp", "odd.drv"),
            "actuators",
        ),
        "kind: table called .xlsx": (
            "saved under the wrong name",
            file_of_bytes(usual_text().encode(), "odd.xlsx"),
            "extension .xlsx",
        ),
    },
    {
        "kind: RPC III called .tim": ("another extension of the same", usual_file_called(".rsp", "odd.tim")),
        "kind: table called .asc": ("a bus trace, or text", file_of_bytes(usual_text().encode(), "odd.asc")),
    },
)
