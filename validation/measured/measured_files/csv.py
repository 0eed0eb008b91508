"""Damaged and unusual CSV files."""

from pathlib import Path

import numpy as np

from validation.measured.measured_files.odd import (
    FX,
    FZ,
    MANY_CHANNELS,
    REPEATED_NAME,
    SAMPLE_COUNT,
    SAMPLE_TIMES,
    FileMaker,
    Files,
    altered_file_maker,
    file_of_300_channels,
    file_of_bytes,
    odd_files,
    usual_file,
    usual_truth,
)

HEADER = "time [s],Fz [N],Fx [N]"


def csv_rows(separator: str = ",", line_ending: str = "\n") -> list[str]:
    """Rows of the usual file, as text."""
    return [
        separator.join(map(repr, row)) + line_ending
        for row in zip(SAMPLE_TIMES.tolist(), FZ.tolist(), FX.tolist(), strict=True)
    ]


def csv_file(header_line: str = HEADER, body_rows: list[str] | None = None, text_encoding: str = "utf-8") -> FileMaker:
    """Make a CSV file from a header and rows (by default those of the usual file)."""
    return file_of_bytes(
        (header_line + "\n" + "".join(csv_rows() if body_rows is None else body_rows)).encode(text_encoding)
    )


def changed_rows(row_index: int, new_row: str) -> list[str]:
    """Rows of the usual file, with one of them replaced."""
    return [*csv_rows()[:row_index], new_row + "\n", *csv_rows()[row_index + 1 :]]


def folder_named_like_file(parent_folder: Path) -> Path:
    """Make a folder that has the name of a CSV file."""
    (parent_folder / "odd.csv").mkdir()
    return parent_folder / "odd.csv"


def truth_with_gap() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Expected values of the usual file with ten samples missing in its first channel."""
    values = FZ.copy()
    values[10:20] = np.nan
    return usual_truth(Fz=values)


def usual_text() -> str:
    """Content of the usual file as text."""
    return HEADER + "\n" + "".join(csv_rows())


BACK = np.where(np.arange(SAMPLE_COUNT) < 20, SAMPLE_TIMES, SAMPLE_TIMES - 0.1)
GAP = [
    row if not 10 <= i < 20 else ",".join((row.split(",")[0], ("", "nan")[i % 2], row.split(",")[2]))
    for i, row in enumerate(csv_rows())
]
BACKWARDS = [f"{t!r},{z!r},{x!r}\n" for t, z, x in zip(BACK.tolist(), FZ.tolist(), FX.tolist(), strict=True)]
GERMAN = [row.replace(".", ",") for row in csv_rows(";")]
UMLAUTS = {"Kraft Räder": (SAMPLE_TIMES, FZ), "Größe": (SAMPLE_TIMES, FX)}

REFUSED: Files = {
    "CSV of no byte": ("there is nothing to read", file_of_bytes(b""), "empty"),
    "folder called odd.csv": ("opening it is an error of the system", folder_named_like_file, "not a file"),
    "CSV without rows": ("a header alone looks well", csv_file(body_rows=[]), "rows of numbers"),
    "CSV of random bytes": ("no text at all", file_of_bytes(bytes(range(128, 255)) * 40), "header"),
    "CSV with binary bytes in a row": (
        "a disk error in the middle",
        file_of_bytes(usual_text().encode().replace(b"1000.25,", b"10\xff0.25,")),
        "line 18",
    ),
    "CSV with a zero byte in a row": (
        "some readers stop there",
        file_of_bytes(usual_text().encode().replace(b"1000.25,", b"100\x00.25,")),
        "line 18",
    ),
    "CSV with line ends of an old Macintosh": (
        "the whole file is one line",
        file_of_bytes(usual_text().replace("\n", "\r").encode()),
        "header line",
    ),
    "CSV with points for thousands": (
        "1.000,25 has two meanings",
        csv_file(HEADER.replace(",", ";"), [row.replace(";1", ";1.") for row in GERMAN]),
        "one decimal sign",
    ),
    "CSV with commas for both": (
        "0,01,1000,25 is five columns or two",
        csv_file(HEADER, [row.replace(".", ",") for row in csv_rows()]),
        "3 values are needed",
    ),
    "CSV whose decimal sign changes": (
        "what held for the first rows does not hold",
        csv_file(HEADER.replace(",", ";"), GERMAN * 100 + csv_rows(";")),
        "decimal sign",
    ),
    "CSV with a short row": (
        "a reader fills it up with NaN",
        csv_file(body_rows=changed_rows(30, "0.3,1000.5")),
        "line 32",
    ),
    "CSV with a long row": (
        "a reader shifts the columns",
        csv_file(body_rows=changed_rows(30, "0.3,1.0,2.0,3.0")),
        "3 values are needed, found 4",
    ),
    "CSV with inf": (
        "it passes every comparison with a bound",
        csv_file(body_rows=changed_rows(30, "0.3,inf,1.0")),
        "channel 'Fz', sample 30",
    ),
    "CSV with a word in a cell": (
        "a reader makes a column of texts",
        csv_file(body_rows=changed_rows(30, "0.3,overload,1.0")),
        "line 32",
    ),
    "CSV with a letter of a number in a cell": (
        "e and n are letters of numbers",
        csv_file(body_rows=changed_rows(30, "0.3,1e,1.0")),
        "line 32, column 'Fz [N]'",
    ),
    "CSV without a clock": ("rows have no times", csv_file("a [s],Fz [N],Fx [N]"), "time [s]"),
    "CSV with two clocks": ("which one holds", csv_file("time [s],t [s],Fx [N]"), "found 2"),
    "CSV with minutes": ("a unit of time that is not known", csv_file(HEADER.replace("[s]", "[min]")), "[s]"),
    "CSV with fewer rows announced than there are": (
        "two files in one",
        csv_file("# samples: 7\n" + HEADER),
        "fewer rows",
    ),
    "CSV of one endless line": (
        "a reader looks for its end in memory",
        file_of_bytes(b"time [s]," + b"x" * (3 << 20)),
        "header line",
    ),
    "web page called odd.csv": ("text, but no table", file_of_bytes(b"<!DOCTYPE html>\n<html>\n</html>\n"), "web page"),
    "spreadsheet called odd.csv": (
        "saved under the wrong name",
        file_of_bytes(b"PK\x03\x04" + bytes(100)),
        "zip archive",
    ),
}
NAMED: Files = {
    "CSV cut within a number": (
        "a number that lost digits is still a number",
        file_of_bytes(usual_text()[:-5].encode()),
        "cut off",
    ),
    "CSV cut at a line end": (
        "nothing in the rows shows it",
        altered_file_maker(usual_file(".csv"), lambda data: data[: -len(csv_rows()[-1])]),
        "cut off",
    ),
    "CSV that ends in zero bytes": (
        "the recorder lost power",
        file_of_bytes(usual_text().encode() + bytes(5000)),
        "cut off",
    ),
    "CSV with umlauts of Windows": (
        "the bytes are no UTF-8",
        csv_file("time [s],Kraft Räder [N],Größe [N]", text_encoding="cp1252"),
        "Windows-1252",
        UMLAUTS,
    ),
    "CSV with decimal commas": (
        "semicolons part the columns",
        csv_file(HEADER.replace(",", ";"), GERMAN),
        "the decimal sign is a comma",
    ),
    "CSV with the same name twice": (
        "the first or the last is taken",
        csv_file("time [s],Fz [N],Fz [N]"),
        "2 channels are called 'Fz'",
        REPEATED_NAME,
    ),
    "CSV with a start without zone": (
        "eight o'clock where",
        csv_file("# start: 2026-11-21T08:00:00\n" + HEADER),
        "no time zone",
    ),
    "CSV called odd.mf4": (
        "the extension says otherwise",
        file_of_bytes(usual_text().encode(), "odd.mf4"),
        "extension",
    ),
}
RIGHT: Files = {
    "CSV without units": ("kN or N, nobody knows", csv_file("time [s],Fz,Fx")),
    "CSV with a byte-order mark": ("the mark becomes part of the first name", csv_file("\ufeff" + HEADER)),
    "CSV with line ends of Windows": (
        "the last column keeps a character",
        file_of_bytes(usual_text().replace("\n", "\r\n").encode()),
    ),
    "CSV with umlauts": ("names beyond ASCII", csv_file("time [s],Kraft Räder [N],Größe [N]"), UMLAUTS),
    "CSV in UTF-16": ("every second byte is zero", file_of_bytes(usual_text().encode("utf-16"))),
    "CSV of 300 channels": ("long lines", file_of_300_channels(".csv"), MANY_CHANNELS),
    "CSV with empty cells and nan": ("nothing was measured for ten samples", csv_file(body_rows=GAP), truth_with_gap()),
    "CSV whose clock goes back": (
        "sorting would hide it",
        csv_file(body_rows=BACKWARDS),
        {"Fz": (BACK, FZ), "Fx": (BACK, FX)},
    ),
    "CSV with milliseconds": (
        "taken for seconds, every rate is 1000 times too slow",
        csv_file(
            HEADER.replace("[s]", "[ms]"),
            [
                f"{1e3 * t!r},{z!r},{x!r}\n"
                for t, z, x in zip(SAMPLE_TIMES.tolist(), FZ.tolist(), FX.tolist(), strict=True)
            ],
        ),
    ),
}
GREEDY = ("CSV of one endless line",)
FILES = odd_files(refused_files=REFUSED, files_with_message=NAMED, readable_files=RIGHT, greedy_names=GREEDY)
