"""Odd CSV files."""

from pathlib import Path

import numpy as np

from validation.measured.measured_files.odd import (
    FX,
    FZ,
    MANY_CHANNELS,
    REPEATED_NAME,
    SAMPLE_COUNT,
    SAMPLE_TIMES,
    Files,
    Make,
    altered,
    every,
    plain,
    raw,
    usual,
    wide,
)

HEADER = "time [s],Fz [N],Fx [N]"


def csv_rows(separator: str = ",", line_end: str = "\n") -> list[str]:
    """Rows of the usual file."""
    return [
        separator.join(map(repr, row)) + line_end
        for row in zip(SAMPLE_TIMES.tolist(), FZ.tolist(), FX.tolist(), strict=True)
    ]


def text(header: str = HEADER, body: list[str] | None = None, encoding: str = "utf-8") -> Make:
    """A CSV file made of a header and rows."""
    return raw((header + "\n" + "".join(csv_rows() if body is None else body)).encode(encoding))


def changed_rows(index: int, row: str) -> list[str]:
    """The rows of the usual file with one row changed."""
    return [*csv_rows()[:index], row + "\n", *csv_rows()[index + 1 :]]


def folder_of_that_name(folder: Path) -> Path:
    """Make a folder whose name looks like a CSV file's."""
    (folder / "odd.csv").mkdir()
    return folder / "odd.csv"


def holes() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Expected values with ten samples missing in one channel."""
    values = FZ.copy()
    values[10:20] = np.nan
    return usual(Fz=values)


def whole() -> str:
    """Return the usual file as text."""
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
    "CSV of no byte": ("there is nothing to read", raw(b""), "empty"),
    "folder called odd.csv": ("opening it is an error of the system", folder_of_that_name, "not a file"),
    "CSV without rows": ("a header alone looks well", text(body=[]), "rows of numbers"),
    "CSV of random bytes": ("no text at all", raw(bytes(range(128, 255)) * 40), "header"),
    "CSV with binary bytes in a row": (
        "a disk error in the middle",
        raw(whole().encode().replace(b"1000.25,", b"10\xff0.25,")),
        "line 18",
    ),
    "CSV with a zero byte in a row": (
        "some readers stop there",
        raw(whole().encode().replace(b"1000.25,", b"100\x00.25,")),
        "line 18",
    ),
    "CSV with line ends of an old Macintosh": (
        "the whole file is one line",
        raw(whole().replace("\n", "\r").encode()),
        "header line",
    ),
    "CSV with points for thousands": (
        "1.000,25 has two meanings",
        text(HEADER.replace(",", ";"), [row.replace(";1", ";1.") for row in GERMAN]),
        "one decimal sign",
    ),
    "CSV with commas for both": (
        "0,01,1000,25 is five columns or two",
        text(HEADER, [row.replace(".", ",") for row in csv_rows()]),
        "3 values are needed",
    ),
    "CSV whose decimal sign changes": (
        "what held for the first rows does not hold",
        text(HEADER.replace(",", ";"), GERMAN * 100 + csv_rows(";")),
        "decimal sign",
    ),
    "CSV with a short row": ("a reader fills it up with NaN", text(body=changed_rows(30, "0.3,1000.5")), "line 32"),
    "CSV with a long row": (
        "a reader shifts the columns",
        text(body=changed_rows(30, "0.3,1.0,2.0,3.0")),
        "3 values are needed, found 4",
    ),
    "CSV with inf": (
        "it passes every comparison with a bound",
        text(body=changed_rows(30, "0.3,inf,1.0")),
        "channel 'Fz', sample 30",
    ),
    "CSV with a word in a cell": (
        "a reader makes a column of texts",
        text(body=changed_rows(30, "0.3,overload,1.0")),
        "line 32",
    ),
    "CSV with a letter of a number in a cell": (
        "e and n are letters of numbers",
        text(body=changed_rows(30, "0.3,1e,1.0")),
        "line 32, column 'Fz [N]'",
    ),
    "CSV without a clock": ("rows have no times", text("a [s],Fz [N],Fx [N]"), "time [s]"),
    "CSV with two clocks": ("which one holds", text("time [s],t [s],Fx [N]"), "found 2"),
    "CSV with minutes": ("a unit of time that is not known", text(HEADER.replace("[s]", "[min]")), "[s]"),
    "CSV with fewer rows announced than there are": ("two files in one", text("# samples: 7\n" + HEADER), "fewer rows"),
    "CSV of one endless line": (
        "a reader looks for its end in memory",
        raw(b"time [s]," + b"x" * (3 << 20)),
        "header line",
    ),
    "web page called odd.csv": ("text, but no table", raw(b"<!DOCTYPE html>\n<html>\n</html>\n"), "web page"),
    "spreadsheet called odd.csv": ("saved under the wrong name", raw(b"PK\x03\x04" + bytes(100)), "zip archive"),
}
NAMED: Files = {
    "CSV cut within a number": ("a number that lost digits is still a number", raw(whole()[:-5].encode()), "cut off"),
    "CSV cut at a line end": (
        "nothing in the rows shows it",
        altered(plain(".csv"), lambda data: data[: -len(csv_rows()[-1])]),
        "cut off",
    ),
    "CSV that ends in zero bytes": ("the recorder lost power", raw(whole().encode() + bytes(5000)), "cut off"),
    "CSV with umlauts of Windows": (
        "the bytes are no UTF-8",
        text("time [s],Kraft Räder [N],Größe [N]", encoding="cp1252"),
        "Windows-1252",
        UMLAUTS,
    ),
    "CSV with decimal commas": (
        "semicolons part the columns",
        text(HEADER.replace(",", ";"), GERMAN),
        "the decimal sign is a comma",
    ),
    "CSV with the same name twice": (
        "the first or the last is taken",
        text("time [s],Fz [N],Fz [N]"),
        "2 channels are called 'Fz'",
        REPEATED_NAME,
    ),
    "CSV with a start without zone": (
        "eight o'clock where",
        text("# start: 2026-11-21T08:00:00\n" + HEADER),
        "no time zone",
    ),
    "CSV called odd.mf4": ("the extension says otherwise", raw(whole().encode(), "odd.mf4"), "extension"),
}
RIGHT: Files = {
    "CSV without units": ("kN or N, nobody knows", text("time [s],Fz,Fx")),
    "CSV with a byte-order mark": ("the mark becomes part of the first name", text("\ufeff" + HEADER)),
    "CSV with line ends of Windows": ("the last column keeps a character", raw(whole().replace("\n", "\r\n").encode())),
    "CSV with umlauts": ("names beyond ASCII", text("time [s],Kraft Räder [N],Größe [N]"), UMLAUTS),
    "CSV in UTF-16": ("every second byte is zero", raw(whole().encode("utf-16"))),
    "CSV of 300 channels": ("long lines", wide(".csv"), MANY_CHANNELS),
    "CSV with empty cells and nan": ("nothing was measured for ten samples", text(body=GAP), holes()),
    "CSV whose clock goes back": ("sorting would hide it", text(body=BACKWARDS), {"Fz": (BACK, FZ), "Fx": (BACK, FX)}),
    "CSV with milliseconds": (
        "taken for seconds, every rate is 1000 times too slow",
        text(
            HEADER.replace("[s]", "[ms]"),
            [
                f"{1e3 * t!r},{z!r},{x!r}\n"
                for t, z, x in zip(SAMPLE_TIMES.tolist(), FZ.tolist(), FX.tolist(), strict=True)
            ],
        ),
    ),
}
GREEDY = ("CSV of one endless line",)
FILES = every(refused=REFUSED, named_files=NAMED, right_files=RIGHT, greedy=GREEDY)
