"""Odd CSV files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from validation.measured.measured_files.odd import COUNT, FX, FZ, TIMES, Odd, cut, usual, written

HEADER = "time [s],Fz [N],Fx [N]"


def rows(separator: str = ",", end: str = "\n") -> list[str]:
    """Rows of the usual file."""
    return [separator.join(map(repr, row)) + end for row in zip(TIMES.tolist(), FZ.tolist(), FX.tolist(), strict=True)]


def text(header: str = HEADER, body: list[str] | None = None, encoding: str = "utf-8") -> Callable[[Path], Path]:
    """Make a file of a header and rows."""

    def make(folder: Path) -> Path:
        path = folder / "odd.csv"
        path.write_bytes((header + "\n" + "".join(rows() if body is None else body)).encode(encoding))
        return path

    return make


def raw(data: bytes, name: str = "odd.csv") -> Callable[[Path], Path]:
    """Make a file of bytes."""

    def make(folder: Path) -> Path:
        (folder / name).write_bytes(data)
        return folder / name

    return make


def changed(index: int, row: str) -> list[str]:
    """Rows with one of them another."""
    return [*rows()[:index], row + "\n", *rows()[index + 1 :]]


def folder_of_that_name(folder: Path) -> Path:
    """Make a folder called like a file."""
    (folder / "odd.csv").mkdir()
    return folder / "odd.csv"


def holes() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Truth with nothing measured for ten samples of one channel."""
    values = FZ.copy()
    values[10:20] = np.nan
    return usual(Fz=values)


def plain() -> str:
    """Return the usual file as text."""
    return HEADER + "\n" + "".join(rows())


BACK = np.where(np.arange(COUNT) < 20, TIMES, TIMES - 0.1)
GAP = [
    row if not 10 <= i < 20 else ",".join((row.split(",")[0], ("", "nan")[i % 2], row.split(",")[2]))
    for i, row in enumerate(rows())
]
BACKWARDS = [f"{t!r},{z!r},{x!r}\n" for t, z, x in zip(BACK.tolist(), FZ.tolist(), FX.tolist(), strict=True)]
GERMAN = [row.replace(".", ",") for row in rows(";")]
WIDE = tuple(f"c{i}" for i in range(300))
MANY = np.add.outer(FZ, np.arange(300.0))
UMLAUTS = {"Kraft Räder": (TIMES, FZ), "Größe": (TIMES, FX)}

FILES = (
    Odd(
        "CSV cut within a number",
        "a number that lost digits is still a number",
        lambda folder: cut(text()(folder), len(plain()) - 5),
        "named",
        "cut off",
    ),
    Odd(
        "CSV cut at a line end",
        "nothing in the rows shows it",
        lambda folder: cut(written(folder / "odd.csv"), len("# samples: 40\n" + plain()) - len(rows()[-1])),
        "named",
        "cut off",
    ),
    Odd("CSV of no byte", "there is nothing to read", raw(b""), "refused", "empty"),
    Odd("folder called odd.csv", "opening it is an error of the system", folder_of_that_name, "refused", "not a file"),
    Odd("CSV without rows", "a header alone looks well", text(body=[]), "refused", "rows of numbers"),
    Odd("CSV of random bytes", "no text at all", raw(bytes(range(128, 255)) * 40), "refused", "header"),
    Odd(
        "CSV with binary bytes in a row",
        "a disk error in the middle",
        raw(plain().encode().replace(b"1000.25,", b"10\xff0.25,")),
        "refused",
        "line 18",
    ),
    Odd(
        "CSV that ends in zero bytes",
        "the recorder lost power",
        raw(plain().encode() + bytes(5000)),
        "named",
        "cut off",
    ),
    Odd(
        "CSV with a zero byte in a row",
        "some readers stop there",
        raw(plain().encode().replace(b"1000.25,", b"100\x00.25,")),
        "refused",
        "line 18",
    ),
    Odd("CSV without units", "kN or N, nobody knows", text("time [s],Fz,Fx"), "right"),
    Odd("CSV with a byte-order mark", "the mark becomes part of the first name", text("\ufeff" + HEADER), "right"),
    Odd(
        "CSV with line ends of Windows",
        "the last column keeps a character",
        lambda folder: raw(plain().replace("\n", "\r\n").encode())(folder),
        "right",
    ),
    Odd(
        "CSV with line ends of an old Macintosh",
        "the whole file is one line",
        raw(plain().replace("\n", "\r").encode()),
        "refused",
        "header line",
    ),
    Odd("CSV with umlauts", "names beyond ASCII", text("time [s],Kraft Räder [N],Größe [N]"), "right", truth=UMLAUTS),
    Odd(
        "CSV with umlauts of Windows",
        "the bytes are no UTF-8",
        text("time [s],Kraft Räder [N],Größe [N]", encoding="cp1252"),
        "named",
        "Windows-1252",
        UMLAUTS,
    ),
    Odd("CSV in UTF-16", "every second byte is zero", raw(plain().encode("utf-16")), "right"),
    Odd(
        "CSV with decimal commas",
        "semicolons part the columns",
        text(HEADER.replace(",", ";"), GERMAN),
        "named",
        "the decimal sign is a comma",
    ),
    Odd(
        "CSV with points for thousands",
        "1.000,25 has two meanings",
        text(HEADER.replace(",", ";"), [row.replace(";1", ";1.") for row in GERMAN]),
        "refused",
        "one decimal sign",
    ),
    Odd(
        "CSV with commas for both",
        "0,01,1000,25 is five columns or two",
        text(HEADER, [row.replace(".", ",") for row in rows()]),
        "refused",
        "3 values are needed",
    ),
    Odd(
        "CSV whose decimal sign changes",
        "what held for the first rows does not hold",
        text(HEADER.replace(",", ";"), GERMAN * 100 + rows(";")),
        "refused",
        "decimal sign",
    ),
    Odd(
        "CSV with a short row",
        "a reader fills it up with NaN",
        text(body=changed(30, "0.3,1000.5")),
        "refused",
        "line 32",
    ),
    Odd(
        "CSV with a long row",
        "a reader shifts the columns",
        text(body=changed(30, "0.3,1.0,2.0,3.0")),
        "refused",
        "3 values are needed, found 4",
    ),
    Odd(
        "CSV with the same name twice",
        "the first or the last is taken",
        text("time [s],Fz [N],Fz [N]"),
        "named",
        "2 channels are called 'Fz'",
        {"Fz (1)": (TIMES, FZ), "Fz (2)": (TIMES, FX)},
    ),
    Odd(
        "CSV of 300 channels",
        "long lines",
        lambda folder: written(folder / "odd.csv", WIDE, MANY),
        "right",
        truth={name: (TIMES, MANY[:, i]) for i, name in enumerate(WIDE)},
    ),
    Odd(
        "CSV with inf",
        "it passes every comparison with a bound",
        text(body=changed(30, "0.3,inf,1.0")),
        "refused",
        "channel 'Fz', sample 30",
    ),
    Odd("CSV with empty cells and nan", "nothing was measured for ten samples", text(body=GAP), "right", truth=holes()),
    Odd(
        "CSV whose clock goes back",
        "sorting would hide it",
        text(body=BACKWARDS),
        "right",
        truth={"Fz": (BACK, FZ), "Fx": (BACK, FX)},
    ),
    Odd(
        "CSV with a word in a cell",
        "a reader makes a column of texts",
        text(body=changed(30, "0.3,overload,1.0")),
        "refused",
        "line 32",
    ),
    Odd(
        "CSV with a letter of a number in a cell",
        "e and n are letters of numbers",
        text(body=changed(30, "0.3,1e,1.0")),
        "refused",
        "line 32, column 'Fz [N]'",
    ),
    Odd("CSV without a clock", "rows have no times", text("a [s],Fz [N],Fx [N]"), "refused", "time [s]"),
    Odd("CSV with two clocks", "which one holds", text("time [s],t [s],Fx [N]"), "refused", "found 2"),
    Odd(
        "CSV with milliseconds",
        "taken for seconds, every rate is 1000 times too slow",
        text(
            HEADER.replace("[s]", "[ms]"),
            [f"{1e3 * t!r},{z!r},{x!r}\n" for t, z, x in zip(TIMES.tolist(), FZ.tolist(), FX.tolist(), strict=True)],
        ),
        "right",
    ),
    Odd("CSV with minutes", "a unit of time that is not known", text(HEADER.replace("[s]", "[min]")), "refused", "[s]"),
    Odd(
        "CSV with a start without zone",
        "eight o'clock where",
        text("# start: 2026-11-21T08:00:00\n" + HEADER),
        "named",
        "no time zone",
    ),
    Odd(
        "CSV with fewer rows announced than there are",
        "two files in one",
        text("# samples: 7\n" + HEADER),
        "refused",
        "fewer rows",
    ),
    Odd(
        "CSV of one endless line",
        "a reader looks for its end in memory",
        raw(b"time [s]," + b"x" * (3 << 20)),
        "refused",
        "header line",
        greedy=True,
    ),
    Odd(
        "web page called odd.csv",
        "text, but no table",
        raw(b"<!DOCTYPE html>\n<html>\n</html>\n"),
        "refused",
        "web page",
    ),
    Odd(
        "spreadsheet called odd.csv",
        "saved under the wrong name",
        raw(b"PK\x03\x04" + bytes(100)),
        "refused",
        "zip archive",
    ),
    Odd("CSV called odd.mf4", "the extension says otherwise", raw(plain().encode(), "odd.mf4"), "named", "extension"),
)
