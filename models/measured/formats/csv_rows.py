"""Rows of a CSV file: where they begin, and the numbers in some of them, by pandas.

Every byte is looked at before a row is parsed: what is no number, no mark for nothing measured and no cell of a column
of text is refused with its line, its column and what to write.
"""

import io
import re
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path

import numpy as np

from models.core.csv_header import MARKS
from models.core.errors import InputError
from models.measured.formats.csv_times import Stamps

STRIDE = 1000
"""Rows from one place of the table of rows to the next."""
CHUNK = 1 << 22
"""Bytes read at once while rows are counted."""
TAIL = 1000
"""Characters at the end of a file among which empty lines are looked for."""
_ALLOWED = b"0123456789+-.eEnaNAinfIF, \n"
"""Bytes of a row of numbers, after the decimal sign and the separator are a point and a comma."""
_GAPS = ["", "nan", "NaN", "NAN", "NA", "na", "-", "--", "---"]
"""Cells of these bytes that say that nothing was measured."""
_WRONG = b"\x1a"
"""What stands for a separator within quotes: never a part of a number."""
_THOUSANDS = re.compile(r"\s*[+-]?\d{1,3}([., '’\u00a0\u202f]\d{3})+([.,]\d+)?\s*")


@dataclass(frozen=True)
class Layout:
    """How the rows are written.

    separator, decimal : signs. begin : byte where the rows begin. line : number of the line before them. names :
    headings of all columns. width : cells of a row, which may have empty ones beyond the last heading. texts : columns
    that hold no numbers. clock : the column of time; stamps : how it is written, None for numbers. unit : bytes of a
    character, as numpy reads it.
    """

    separator: str
    decimal: str
    begin: int
    line: int
    names: tuple[str, ...]
    width: int
    texts: tuple[int, ...]
    clock: int
    stamps: Stamps | None
    unit: np.dtype

    @property
    def start(self) -> datetime | None:
        """When time was 0; None where the rows do not say."""
        return self.stamps.start if self.stamps else None

    @property
    def numbers(self) -> list[int]:
        """Columns of numbers."""
        return [i for i in range(len(self.names)) if i not in self.texts]


def narrow(data: bytes, unit: np.dtype) -> bytes:
    """Text with one byte per character; a character that needs two becomes one that is never part of a number."""
    if unit.itemsize == 1:
        return data
    codes = np.frombuffer(data[: len(data) // unit.itemsize * unit.itemsize], unit)
    return np.where(codes > 127, _WRONG[0], codes).astype(np.uint8).tobytes()


def find_rows(path: Path, layout: Layout) -> tuple[np.ndarray, int, int]:
    """Byte of every thousandth row and of their end, number of rows, bytes left over after the last line end."""
    begin, size = layout.begin, layout.unit.itemsize
    marks, count, place, last = [begin], 0, begin, begin
    with path.open("rb") as file:
        file.seek(begin)
        while chunk := file.read(CHUNK):
            codes = np.frombuffer(chunk[: len(chunk) // size * size], layout.unit)
            ends = (np.flatnonzero(codes == ord("\n")) + 1) * size + place
            marks += ends[(STRIDE - 1 - count) % STRIDE :: STRIDE].tolist()
            count, place = count + len(ends), place + len(chunk)
            last = int(ends[-1]) if len(ends) else last
    empty = _empty_lines(path, layout, last)
    count -= len(empty)
    end = empty[0] if empty else last
    marks = [mark for mark in marks if mark < end] + [end]
    return np.array(marks), count, place - last


def _empty_lines(path: Path, layout: Layout, last: int) -> list[int]:
    """Bytes where lines without a value begin that end the file, of at most a thousand characters."""
    size = layout.unit.itemsize
    begin = max(layout.begin, last - TAIL * size)
    with path.open("rb") as file:
        file.seek(begin)
        tail = narrow(file.read(last - begin), layout.unit)
    used = len(tail.rstrip(b' \r\n"' + layout.separator.encode()))
    first = tail.find(b"\n", used) + 1 if used else 0
    ends = [i for i, byte in enumerate(tail) if byte == ord("\n") and i >= first]
    return [last + size * (i - len(tail)) for i in [first, *(end + 1 for end in ends[:-1])]] if ends else []


def numbers(path: Path, layout: Layout, data: bytes, first: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Table (rows, columns of numbers) of some rows, the first of which is row ``first``; seconds (rows,) since the
    first stamp where times are those of the clock."""
    line = layout.line + 1 + first
    text = _unquoted(path, layout, narrow(data, layout.unit).replace(b"\r\n", b"\n"), line)
    _even(path, layout, text, line)
    times = None
    if layout.texts:
        text, cells = _parted(layout, text)
        if layout.stamps is not None:
            times = layout.stamps.seconds(path, cells, line, layout.names[layout.clock])
    table = _parsed(layout, text)
    if table is None:
        table = _parsed(layout, _blanked(layout, text))
    if table is None:
        raise _culprit(path, layout, text, line)
    beyond = np.isfinite(table[:, len(layout.numbers) :])
    if beyond.any():
        row = int(np.argmax(beyond.any(axis=1)))
        raise InputError(
            path,
            f"line {line + row}",
            None,
            f"a value stands beyond the last heading: {len(layout.names)} values are needed",
        )
    return table[:, : len(layout.numbers)], times


def _unquoted(path: Path, layout: Layout, text: bytes, line: int) -> bytes:
    """Rows without quotes; a comma within them is a decimal sign where the numbers have it."""
    if b'"' not in text:
        return text
    codes = np.frombuffer(text, np.uint8).copy()
    quotes = codes == ord('"')
    inside = np.logical_xor.accumulate(quotes)
    ends = np.flatnonzero(codes == ord("\n"))
    if inside[ends].any():
        row = int(np.argmax(inside[ends]))
        raise _at(path, line, text, int(ends[row]), "a quote is opened and not closed in this line")
    decimal = layout.separator == layout.decimal == ","
    codes[inside & (codes == ord(layout.separator))] = ord(".") if decimal else _WRONG[0]
    return codes[~quotes].tobytes()


def _even(path: Path, layout: Layout, text: bytes, line: int) -> None:
    """Refuse a row that has more or fewer columns than the header."""
    data = np.frombuffer(text, np.uint8)
    ends = np.flatnonzero(data == ord("\n"))
    signs = np.searchsorted(np.flatnonzero(data == ord(layout.separator)), ends)
    cells = np.diff(signs, prepend=0) + 1
    wrong = np.flatnonzero(cells != layout.width)
    if wrong.size:
        found = int(cells[wrong[0]])
        doubled = found in (2 * layout.width, 2 * layout.width - 1) and layout.separator == ","
        hint = "; where commas are decimal signs, semicolons must part the columns" if doubled else ""
        raise _at(path, line, text, int(ends[wrong[0]]), f"{layout.width} values are needed, found {found}{hint}")


def _bounds(layout: Layout, text: bytes) -> np.ndarray:
    """Byte before every cell and the one after the last (rows, width + 1): separators and line ends."""
    data = np.frombuffer(text, np.uint8)
    signs = np.flatnonzero((data == ord(layout.separator)) | (data == ord("\n"))).reshape(-1, layout.width)
    return np.column_stack([np.append(-1, signs[:-1, -1]), signs])


def _without(text: bytes, begins: np.ndarray, ends: np.ndarray) -> bytes:
    """Text without the bytes from ``begins`` to before ``ends``, which may overlap."""
    change = np.zeros(len(text) + 1, np.int8)
    np.add.at(change, begins, 1)
    np.add.at(change, ends, -1)
    return np.frombuffer(text, np.uint8)[np.cumsum(change[:-1], dtype=np.int8) == 0].tobytes()


def _parted(layout: Layout, text: bytes) -> tuple[bytes, list[str]]:
    """Rows without the columns of text, and the cells of the clock."""
    bounds, kept = _bounds(layout, text), [i for i in range(layout.width) if i not in layout.texts]
    cells = [
        text[a + 1 : b].replace(_WRONG, layout.separator.encode()).decode("latin-1")
        for a, b in bounds[:, layout.clock : layout.clock + 2].tolist()
    ]
    inner = [i for i in layout.texts if i < kept[-1]]
    begins, ends = bounds[:, inner].ravel() + 1, bounds[:, [i + 1 for i in inner]].ravel() + 1
    if kept[-1] + 1 < layout.width:  # the last ones go with the separator before them
        begins, ends = np.append(begins, bounds[:, kept[-1] + 1]), np.append(ends, bounds[:, -1])
    return _without(text, begins, ends), cells


def _parsed(layout: Layout, text: bytes) -> np.ndarray | None:
    """Table of rows of numbers; None where a cell is something else."""
    import pandas

    if layout.separator != ",":
        if (b"." if layout.decimal == "," else b",") in text:
            return None
        text = text.replace(b",", b".").replace(layout.separator.encode(), b",")
    if text.translate(None, _ALLOWED):
        return None
    try:
        table = pandas.read_csv(
            io.BytesIO(text),
            header=None,
            dtype=np.float64,
            keep_default_na=False,
            na_values=_GAPS,
            skip_blank_lines=False,
            skipinitialspace=True,
        )
    except (ValueError, OverflowError):
        return None
    return table.to_numpy()


def _blanked(layout: Layout, text: bytes) -> bytes:
    """Rows with empty cells where a mark says that nothing was measured."""
    plain = np.zeros(256, bool)
    plain[np.frombuffer(b"0123456789+-.,eE \n" + layout.separator.encode(), np.uint8)] = True
    odd = np.flatnonzero(~plain[np.frombuffer(text, np.uint8)])
    bounds = np.append(-1, np.flatnonzero(np.isin(np.frombuffer(text, np.uint8), (ord(layout.separator), ord("\n")))))
    cells = np.unique(np.searchsorted(bounds, odd))
    spans = np.column_stack([bounds[cells - 1] + 1, bounds[cells]])
    marks = np.array([_is_mark(text[a:b]) for a, b in spans.tolist()], bool)
    return _without(text, *spans[marks].T) if marks.any() else text


@lru_cache(1000)
def _is_mark(cell: bytes) -> bool:
    """Whether a cell says that nothing was measured."""
    return MARKS.fullmatch(cell.decode("latin-1")) is not None


def _culprit(path: Path, layout: Layout, text: bytes, line: int) -> InputError:
    """Error at the first cell that is not a number."""
    names = [layout.names[i] for i in layout.numbers]
    other = "." if layout.decimal == "," else ","
    for i, row in enumerate(text.split(b"\n")):
        cells = row.decode("utf-8", errors="backslashreplace").split(layout.separator)
        for name, cell in zip(names, cells, strict=False):
            plain = cell.replace(",", ".") if layout.decimal == "," else cell
            try:
                wrong = other in cell or not (
                    MARKS.fullmatch(cell) or (cell.isascii() and "_" not in cell and float(plain) is not None)
                )
            except ValueError:
                wrong = True
            if wrong:
                return InputError(path, f"line {line + i}, column {name!r}", cell.strip(), _remedy(layout, cell))
    return InputError(path, f"line {line} and after", None, "rows of numbers are needed")


def _remedy(layout: Layout, cell: str) -> str:
    """What to write in place of a cell that is no number."""
    if _THOUSANDS.fullmatch(cell):
        return "write numbers without separators of thousands"
    if ("." if layout.decimal == "," else ",") in cell:
        return f"the decimal sign is {layout.decimal!r} before this line: write all numbers in one way"
    return "a number is needed; where nothing was measured, leave the cell empty"


def _at(path: Path, line: int, text: bytes, place: int, allowed: str) -> InputError:
    """Error at one byte of some rows."""
    begin, end = text.rfind(b"\n", 0, place) + 1, text.find(b"\n", place)
    row = text[begin : len(text) if end < 0 else end].decode("utf-8", errors="backslashreplace")
    return InputError(path, f"line {line + text[:place].count(10)}", row, allowed)
