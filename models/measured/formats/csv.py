"""CSV as engineers write it: a header ``name [unit]``, a column ``time [s]``, one row per sample.

UTF-8; lines that begin with ``#`` stand before the header and are kept as the comment, but for ``# start:`` (ISO 8601
with its zone), ``# samples:`` (how many rows there must be) and ``# channel "name": text`` (a channel's comment).
Columns are parted by commas, semicolons or tabs, whichever the header has; the decimal sign is a point, or a comma
where commas do not part columns: what the first rows show holds for all, and whatever is not a comma and a point is
said. An empty cell or ``nan`` was not measured. Numbers are read to the last digit. Rows are found by a table of every
thousandth line, so that any block is read without those before it.
"""

import csv
import io
import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from models.errors import InputError
from models.measured.channel import Channel
from models.measured.finding import Finding
from models.measured.formats.opened import Opened, Span, notice, readable, told_apart, zoned
from models.tables import SECONDS

STRIDE = 1000
"""Rows from one place of the table of rows to the next."""
CHUNK = 1 << 22
"""Bytes read at once while rows are counted."""
LONGEST = 1 << 20
"""Bytes of a line; a longer one is not text."""
SAMPLE = 1 << 16
"""Bytes of rows that show the decimal sign."""
CLOCKS = ("time", "zeit", "t")
SIGNS = {",": "commas", ";": "semicolons", "\t": "tabs"}
_HEADING = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\])?", re.DOTALL)
_ALLOWED = b"0123456789+-.eEnaNAinfIF, \n"
"""Bytes of a row of numbers, after the decimal sign and the separator are a point and a comma."""


@dataclass(frozen=True)
class Layout:
    """How the rows are written: separator, decimal sign, byte and line where they begin, names of all columns."""

    separator: str
    decimal: str
    begin: int
    line: int
    names: tuple[str, ...]


@dataclass
class Header:
    """What stands before the rows."""

    comments: list[str] = field(default_factory=list)
    start: str = ""
    samples: int | None = None
    of_channels: dict[str, list[str]] = field(default_factory=dict)
    headings: str = ""
    begin: int = 0
    line: int = 0

    def add(self, path: Path, text: str) -> None:
        """Take one comment line, without its ``#``."""
        key, _, value = text.partition(":")
        if key == "start":
            self.start = value.strip()
        elif key == "samples":
            if not value.strip().isdecimal():
                raise InputError(path, f"line {self.line}, samples", value.strip(), "a number of rows is needed")
            self.samples = int(value)
        elif (found := re.fullmatch(r'channel ("(?:[^"\\]|\\.)*"): ?(.*)', text)) is not None:
            self.of_channels.setdefault(_text(path, self.line, found[1]), []).append(found[2])
        else:
            self.comments.append(value.removeprefix(" ") if key == "comment" else text)


@dataclass(frozen=True)
class CsvFile(Opened):
    """Rows of numbers; ``rows[k]`` is the byte where row 1000 k begins, the last one the end of the rows used."""

    layout: Layout
    rows: np.ndarray
    clock: int
    factor: float
    columns: tuple[int, ...]

    def pieces(self, chosen: list[int], spans: Iterable[Span]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Read the rows of each span and part its columns."""
        columns = [self.columns[i] for i in chosen]
        with self.path.open("rb") as file:
            for first, count in spans:
                table = numbers(self.path, self.layout, self._lines(file, first, count), first)
                yield self.factor * table[:, self.clock], table[:, columns]

    def _lines(self, file: io.BufferedReader, first: int, count: int) -> bytes:
        """Bytes of some rows."""
        low, high = first // STRIDE, min(-(-(first + count) // STRIDE), len(self.rows) - 1)
        file.seek(int(self.rows[low]))
        text = file.read(int(self.rows[high] - self.rows[low]))
        ends = np.flatnonzero(np.frombuffer(text, np.uint8) == ord("\n"))
        skipped = first - low * STRIDE
        begin = 0 if skipped == 0 else int(ends[skipped - 1]) + 1
        return text[begin : int(ends[skipped + count - 1]) + 1]


def open_csv(path: Path) -> CsvFile:
    """Read the header, count the rows and find out how they are written; raises InputError."""
    with readable(path):
        header, found = read_header(path)
        layout, notes = find_layout(path, header)
        rows, count, left = find_rows(path, header.begin)
        found += notes + _ends(path, header, count, left)
        start, notes = zoned(path, header.start) if header.start else (None, [])
        clock, factor = _clock(path, layout)
        columns = tuple(i for i in range(len(layout.names)) if i != clock)
        names, repeated = told_apart(path, [heading(layout.names[i])[0] for i in columns])
        channels = tuple(
            Channel(name, heading(layout.names[i])[1], "\n".join(header.of_channels.get(name, [])), 0, count, None)
            for name, i in zip(names, columns, strict=True)
        )
        return CsvFile(path, channels, start, "\n".join(header.comments), tuple(found + notes + repeated), layout, rows,
                       clock, factor, columns)  # fmt: skip


def read_header(path: Path) -> tuple[Header, list[Finding]]:
    """Comment lines and the line of headings."""
    header = Header()
    found: list[Finding] = []
    with path.open("rb") as file:
        while True:
            raw = file.readline(LONGEST)
            if not raw.endswith(b"\n") or b"\0" in raw:
                raise InputError(path, f"line {header.line + 1}", None, "a CSV file needs a header line name [unit], "
                                 "... and rows of numbers, as text")
            header.line += 1
            text = _decoded(path, raw, header.line, found).strip()
            if text.startswith("#"):
                header.add(path, text[1:].strip())
            elif text:
                header.headings, header.begin = text, file.tell()
                return header, found


def _decoded(path: Path, raw: bytes, line: int, found: list[Finding]) -> str:
    """Text of one line; the code page of Western Europe where it is not UTF-8, which is said."""
    try:
        return raw.decode("utf-8-sig" if line == 1 else "utf-8")
    except UnicodeDecodeError:
        text = raw.decode("cp1252", errors="replace")
        found.append(notice(path, "doubt", f"line {line} is not UTF-8 and is read as Windows-1252: "
                            f"{text.strip()[:60]!r}"))
        return text


def _text(path: Path, line: int, quoted: str) -> str:
    """Return a name in quotes, as JSON writes it."""
    try:
        return str(json.loads(quoted))
    except ValueError:
        raise InputError(path, f"line {line}", quoted, "a channel's name in quotes is needed") from None


def find_layout(path: Path, header: Header) -> tuple[Layout, list[Finding]]:
    """Separator from the header, decimal sign from the first rows; InputError where either is in doubt."""
    place = f"line {header.line} (header)"
    found = [sign for sign in SIGNS if sign in re.sub('"[^"]*"', "", header.headings)]
    if len(found) != 1:
        what = "no separator" if not found else " and ".join(SIGNS[sign] for sign in found)
        raise InputError(path, place, header.headings, f"commas alone (or semicolons, or tabs) must part the columns, "
                         f"found {what}")
    separator = found[0]
    names = next(csv.reader([header.headings], delimiter=separator))
    with path.open("rb") as file:
        file.seek(header.begin)
        sample = file.read(SAMPLE)
    comma = separator != "," and b"," in sample
    if comma and b"." in sample:
        raise InputError(path, f"line {header.line + 1} and after", None,
                         "the numbers hold points and commas: write them with one decimal sign and nothing else")
    layout = Layout(separator, "," if comma else ".", header.begin, header.line, tuple(name.strip() for name in names))
    decimal = "comma" if comma else "point"
    text = f"{SIGNS[separator]} part the columns and the decimal sign is a {decimal}"
    return layout, [] if separator == "," else [notice(path, "note", text)]


def find_rows(path: Path, begin: int) -> tuple[np.ndarray, int, int]:
    """Byte of every thousandth row and of their end, number of rows, bytes left over after the last line end."""
    marks, count, place, last = [begin], 0, begin, begin
    with path.open("rb") as file:
        file.seek(begin)
        while chunk := file.read(CHUNK):
            ends = np.flatnonzero(np.frombuffer(chunk, np.uint8) == ord("\n")) + place + 1
            marks += ends[(STRIDE - 1 - count) % STRIDE :: STRIDE].tolist()
            count, place = count + len(ends), place + len(chunk)
            last = int(ends[-1]) if len(ends) else last
    empty = _empty_lines(path, begin, last)
    count -= len(empty)
    end = empty[0] if empty else last
    marks = [mark for mark in marks if mark < end] + [end]
    return np.array(marks), count, place - last


def _empty_lines(path: Path, begin: int, last: int) -> list[int]:
    """Bytes where empty lines begin that end the file, of at most a thousand bytes."""
    with path.open("rb") as file:
        file.seek(max(begin, last - 1000))
        tail = file.read(last - max(begin, last - 1000))
    used = len(tail.rstrip(b" \r\n"))
    first = tail.find(b"\n", used) + 1 if used else 0
    ends = [i for i, byte in enumerate(tail) if byte == ord("\n") and i >= first]
    return [last - len(tail) + i for i in [first, *(end + 1 for end in ends[:-1])]] if ends else []


def _ends(path: Path, header: Header, count: int, left: int) -> list[Finding]:
    """What the end of the file says of its being whole."""
    found = []
    if count == 0:
        raise InputError(path, f"line {header.line + 1}", None, "rows of numbers are needed, and there is none")
    if left:
        found.append(notice(path, "doubt", f"the last line has no line end and may be cut off: it is left out, and "
                            f"{count} rows are used"))
    if header.samples is not None and header.samples > count:
        found.append(notice(path, "doubt", f"the header announces {header.samples} rows, but {count} are there: "
                            "the file is cut off"))
    if header.samples is not None and header.samples < count:
        raise InputError(path, "samples", header.samples, f"the header announces fewer rows than there are ({count})")
    return found


def _clock(path: Path, layout: Layout) -> tuple[int, float]:
    """Column of time, and its factor to seconds."""
    place = f"line {layout.line} (header)"
    clocks = [i for i, name in enumerate(layout.names) if heading(name)[0].casefold() in CLOCKS]
    if len(clocks) != 1:
        raise InputError(path, place, ", ".join(layout.names), f"one column time [s] is needed, found {len(clocks)}")
    name, unit = heading(layout.names[clocks[0]])
    if unit not in SECONDS:
        raise InputError(path, f"{place}, column {name!r}, unit", unit, f"write {name} [s]", tuple(SECONDS))
    if len(layout.names) < 2 or not all(heading(name)[0] for name in layout.names):
        raise InputError(path, place, ", ".join(layout.names), "every column needs a name, and one beside time")
    return clocks[0], SECONDS[unit]


def heading(text: str) -> tuple[str, str]:
    """Name and unit of one heading; the unit is the last pair of brackets, empty where there is none."""
    found = _HEADING.fullmatch(text)
    name, unit = found.groups() if found else (text, "")
    return name.strip(), (unit or "").strip()


def numbers(path: Path, layout: Layout, text: bytes, first: int) -> np.ndarray:
    """Table (rows, columns) of the numbers in some rows, the first of which is row ``first``."""
    import pandas

    line = layout.line + 1 + first
    plain = _plain(path, layout, text.replace(b"\r\n", b"\n"), line)
    _even(path, layout, plain, line)
    try:
        table = pandas.read_csv(io.BytesIO(plain), header=None, dtype=np.float64, keep_default_na=False,
                                na_values=["", "nan", "NaN", "NAN"], skip_blank_lines=False, skipinitialspace=True)
    except (ValueError, OverflowError):
        raise _culprit(path, layout, plain, line) from None
    return table.to_numpy()


def _plain(path: Path, layout: Layout, text: bytes, line: int) -> bytes:
    """Rows with commas between columns and decimal points; whatever cannot be part of a number is refused."""
    if layout.separator != ",":
        wrong = b"." if layout.decimal == "," else b","
        if wrong in text:
            raise _at(path, line, text, text.index(wrong),
                      f"the decimal sign is {layout.decimal!r} before this line: write all numbers in one way")
        text = text.replace(b",", b".").replace(layout.separator.encode(), b",")
    rest = text.translate(None, _ALLOWED)
    if rest:
        raise _at(path, line, text, text.index(rest[:1]), "rows of numbers are needed")
    return text


def _at(path: Path, line: int, text: bytes, place: int, allowed: str) -> InputError:
    """Error at one byte of some rows."""
    begin, end = text.rfind(b"\n", 0, place) + 1, text.find(b"\n", place)
    row = text[begin:end].decode("utf-8", errors="backslashreplace")
    number = line + text[:place].count(b"\n")
    return InputError(path, f"line {number}", row, allowed)


def _even(path: Path, layout: Layout, text: bytes, line: int) -> None:
    """Refuse a row that has more or fewer columns than the header."""
    data = np.frombuffer(text, np.uint8)
    ends = np.flatnonzero(data == ord("\n"))
    commas = np.searchsorted(np.flatnonzero(data == ord(",")), ends)
    cells = np.diff(commas, prepend=0) + 1
    wrong = np.flatnonzero(cells != len(layout.names))
    if wrong.size:
        allowed = f"{len(layout.names)} values are needed, found {cells[wrong[0]]}"
        raise _at(path, line, text, int(ends[wrong[0]]), allowed)


def _culprit(path: Path, layout: Layout, text: bytes, line: int) -> InputError:
    """Error at the first cell that is not a number."""
    for i, row in enumerate(text.decode().splitlines()):
        for name, cell in zip(layout.names, row.split(","), strict=True):
            try:
                float(cell or "nan")
            except ValueError:
                return InputError(path, f"line {line + i}, column {name!r}", cell.strip(), "a number is needed")
    return InputError(path, f"line {line} and after", None, "rows of numbers are needed")
