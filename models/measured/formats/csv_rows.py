"""Rows of a CSV file: their positions in the file, and the numbers in some of them, read by pandas.

What is no number, no mark for nothing measured and no cell of a column of text is refused with its line, its column and
what to write.
"""

import csv
import io
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from models.core.csv_header import MISSING_VALUE_PATTERN
from models.core.errors import InputError
from models.measured.formats.csv_times import TimeStamps

ROWS_PER_MARK = 1000
"""Number of rows between two entries in the table of row positions."""
BYTES_PER_READ = 1 << 22
"""Number of bytes read at once while rows are counted."""
TAIL_CHARACTERS = 1000
"""Number of characters at the end of a file among which empty lines are looked for."""
_GAP_CELLS = ["", "nan", "NaN", "NAN", "NA", "na", "-", "--", "---"]
"""Usual cells that mark a missing measured value; others are looked for where these do not suffice."""
_PLAIN_BYTES = bytes(range(32, 127)) + b"\n"
"""Bytes of which numbers and marks consist; where there are others, every cell is checked."""
_QUOTED_SEPARATOR = "\x1a"
"""Replacement for a separator within quotes: never a part of a number."""
_THOUSANDS_PATTERN = re.compile(r"\s*[+-]?\d{1,3}([., '’\u00a0\u202f]\d{3})+([.,]\d+)?\s*")


@dataclass(frozen=True)
class CsvLayout:
    """Layout of the rows of a CSV file: separators, columns, clock.

    separator, decimal_sign : characters. first_byte : byte where the rows begin. line : number of the line before them.
    names : headings of all columns. cells_per_row : cells of a row, which may have empty ones beyond the last heading.
    text_columns : columns that hold no numbers. time_column : the column of time; time_stamps : how it is written, None
    for numbers. unit : bytes of a character, as numpy reads it.
    """

    separator: str
    decimal_sign: str
    first_byte: int
    line: int
    names: tuple[str, ...]
    cells_per_row: int
    text_columns: tuple[int, ...]
    time_column: int
    time_stamps: TimeStamps | None
    unit: np.dtype

    @property
    def start(self) -> datetime | None:
        """Date and time at time 0; None where the rows do not give it."""
        return self.time_stamps.start if self.time_stamps else None

    @property
    def numbers(self) -> list[int]:
        """Indices of the columns that hold numbers."""
        return [i for i in range(len(self.names)) if i not in self.text_columns]


def one_byte_text(file_bytes: bytes, character_type: np.dtype) -> bytes:
    """Text recoded to one byte per character; a wide character becomes a byte that no number can contain."""
    if character_type.itemsize == 1:
        return file_bytes
    codes = np.frombuffer(
        file_bytes[: len(file_bytes) // character_type.itemsize * character_type.itemsize], character_type
    )
    return np.where(codes > 127, ord(_QUOTED_SEPARATOR), codes).astype(np.uint8).tobytes()


def find_rows(csv_path: Path, layout: CsvLayout) -> tuple[np.ndarray, int, int]:
    """Byte position of every thousandth row and of the end, number of rows, and number of bytes after the last line
    end."""
    begin, size = layout.first_byte, layout.unit.itemsize
    marks, count, place, last = [begin], 0, begin, begin
    with csv_path.open("rb") as file:
        file.seek(begin)
        while chunk := file.read(BYTES_PER_READ):
            codes = np.frombuffer(chunk[: len(chunk) // size * size], layout.unit)
            ends = (np.flatnonzero(codes == ord("\n")) + 1) * size + place
            marks += ends[(ROWS_PER_MARK - 1 - count) % ROWS_PER_MARK :: ROWS_PER_MARK].tolist()
            count, place = count + len(ends), place + len(chunk)
            last = int(ends[-1]) if len(ends) else last
    empty = _empty_lines(csv_path, layout, last)
    count -= len(empty)
    end = empty[0] if empty else last
    marks = [mark for mark in marks if mark < end] + [end]
    return np.array(marks), count, place - last


def _empty_lines(csv_path: Path, layout: CsvLayout, last_row_end: int) -> list[int]:
    """Byte positions of the empty lines at the end of the file; only its last thousand characters are searched."""
    size = layout.unit.itemsize
    begin = max(layout.first_byte, last_row_end - TAIL_CHARACTERS * size)
    with csv_path.open("rb") as file:
        file.seek(begin)
        tail = one_byte_text(file.read(last_row_end - begin), layout.unit)
    used = len(tail.rstrip(b' \r\n"' + layout.separator.encode()))
    first = tail.find(b"\n", used) + 1 if used else 0
    ends = [i for i, byte in enumerate(tail) if byte == ord("\n") and i >= first]
    return [last_row_end + size * (i - len(tail)) for i in [first, *(end + 1 for end in ends[:-1])]] if ends else []


def numbers_of_rows(
    csv_path: Path, layout: CsvLayout, row_bytes: bytes, first_row: int
) -> tuple[np.ndarray, np.ndarray | None]:
    """Table (rows, columns) of the numbers in some rows, from row ``first_row`` on, and the seconds (rows,) since the
    first time stamp; None if times are numbers."""
    line = layout.line + 1 + first_row
    text = _without_quotes(csv_path, layout, one_byte_text(row_bytes, layout.unit).replace(b"\r\n", b"\n"), line)
    _refuse_uneven_row(csv_path, layout, text, line)
    times = None
    if layout.time_stamps is not None:
        stamps = [
            cell.replace(_QUOTED_SEPARATOR, layout.separator)
            for cell in _read_columns(layout, text, [layout.time_column], str)[:, 0]
        ]
        times = layout.time_stamps.seconds(csv_path, stamps, line, layout.names[layout.time_column])
    table, used = _number_table(csv_path, layout, text, line), len(layout.numbers)
    beyond = np.isfinite(table[:, used:]).any(axis=1)
    if beyond.any():
        wrong = f"a value stands beyond the last heading: {len(layout.names)} values are needed"
        raise InputError(csv_path, f"line {line + int(np.argmax(beyond))}", None, wrong)
    return table[:, :used], times


def _number_table(csv_path: Path, layout: CsvLayout, row_text: bytes, line_number: int) -> np.ndarray:
    """Numbers (rows, columns) in the columns of numbers and in any beyond the last heading; NaN where a cell marks a
    missing value."""
    columns, wrong = [*layout.numbers, *range(len(layout.names), layout.cells_per_row)], None
    if row_text.translate(None, _PLAIN_BYTES + layout.separator.encode()):
        wrong = _first_wrong_cell(csv_path, layout, row_text, line_number)
    if wrong is None:
        with suppress(ValueError, OverflowError):
            return _read_columns(layout, row_text, columns, np.float64)
        cells = np.unique(_read_columns(layout, row_text, columns, str).astype(str))
        with suppress(ValueError, OverflowError):
            return _read_columns(
                layout, row_text, columns, np.float64, [cell for cell in cells if MISSING_VALUE_PATTERN.fullmatch(cell)]
            )
        wrong = _first_wrong_cell(csv_path, layout, row_text, line_number)
    raise wrong or InputError(csv_path, f"line {line_number} and after", None, "rows of numbers are needed")


def _read_columns(
    layout: CsvLayout, row_text: bytes, column_indices: list[int], number_type: type, missing_marks: Sequence[str] = ()
) -> np.ndarray:
    """Some columns of rows without quotes, as numbers or text; ValueError for cells that are neither numbers nor marks
    of missing data."""
    import pandas

    return pandas.read_csv(
        io.BytesIO(row_text),
        sep=layout.separator,
        decimal=layout.decimal_sign if layout.decimal_sign != layout.separator else ".",
        header=None,
        usecols=column_indices,
        dtype=number_type,
        keep_default_na=False,
        na_values=[*_GAP_CELLS, *missing_marks] if number_type is np.float64 else [],
        skip_blank_lines=False,
        skipinitialspace=True,
        quoting=csv.QUOTE_NONE,
        encoding="latin-1",
    ).to_numpy()


def _without_quotes(csv_path: Path, layout: CsvLayout, row_text: bytes, line_number: int) -> bytes:
    """Text of rows with quotes removed; a comma inside quotes becomes a decimal point where numbers are written so."""
    if b'"' not in row_text:
        return row_text
    codes = np.frombuffer(row_text, np.uint8).copy()
    quotes = codes == ord('"')
    inside = np.logical_xor.accumulate(quotes)
    ends = np.flatnonzero(codes == ord("\n"))
    if inside[ends].any():
        row = int(np.argmax(inside[ends]))
        raise _error_at_byte(
            csv_path, line_number, row_text, int(ends[row]), "a quote is opened and not closed in this line"
        )
    decimal = layout.separator == layout.decimal_sign == ","
    codes[inside & (codes == ord(layout.separator))] = ord("." if decimal else _QUOTED_SEPARATOR)
    return codes[~quotes].tobytes()


def _refuse_uneven_row(csv_path: Path, layout: CsvLayout, row_text: bytes, line_number: int) -> None:
    """Raise InputError for a row that has more or fewer columns than the header."""
    data = np.frombuffer(row_text, np.uint8)
    ends = np.flatnonzero(data == ord("\n"))
    signs = np.searchsorted(np.flatnonzero(data == ord(layout.separator)), ends)
    cells = np.diff(signs, prepend=0) + 1
    wrong = np.flatnonzero(cells != layout.cells_per_row)
    if wrong.size:
        width = int(cells[wrong[0]])
        doubled = width in (2 * layout.cells_per_row, 2 * layout.cells_per_row - 1) and layout.separator == ","
        hint = "; where commas are decimal signs, semicolons must part the columns" if doubled else ""
        raise _error_at_byte(
            csv_path,
            line_number,
            row_text,
            int(ends[wrong[0]]),
            f"{layout.cells_per_row} values are needed, found {width}{hint}",
        )


def _first_wrong_cell(csv_path: Path, layout: CsvLayout, row_text: bytes, line_number: int) -> InputError | None:
    """InputError for the first cell that is no number, or has a tab in a time; None if there is none."""
    comma = layout.decimal_sign == ","
    for i, row in enumerate(row_text.split(b"\n")):
        cells = row.decode("utf-8", errors="backslashreplace").split(layout.separator)
        time = (
            cells[layout.time_column].replace(_QUOTED_SEPARATOR, ",")
            if layout.time_stamps and layout.time_column < len(cells)
            else ""
        )
        if not time.isprintable():
            place = f"line {line_number + i}, column {layout.names[layout.time_column]!r}"
            allowed = "a time is needed; a tab in it, or another sign that nobody sees, may stand for a lost digit"
            return InputError(csv_path, place, time.strip(), allowed)
        for column in (column for column in layout.numbers if column < len(cells)):
            cell = cells[column]
            try:
                mark = MISSING_VALUE_PATTERN.fullmatch(cell) is not None
                mark or float(cell.replace(",", ".") if comma else cell)
                number = (
                    cell.isascii() and cell.isprintable() and "_" not in cell and ("." if comma else ",") not in cell
                )
            except ValueError:
                mark = number = False
            if not mark and not number:
                place = f"line {line_number + i}, column {layout.names[column]!r}"
                return InputError(csv_path, place, cell.strip(), _cell_advice(layout, cell))
    return None


def _cell_advice(layout: CsvLayout, cell_text: str) -> str:
    """Advice on what to write instead of a cell that is not a number."""
    if _THOUSANDS_PATTERN.fullmatch(cell_text):
        return "write numbers without separators of thousands"
    if ("." if layout.decimal_sign == "," else ",") in cell_text:
        return f"the decimal sign is {layout.decimal_sign!r} before this line: write all numbers in one way"
    return "a number is needed; where nothing was measured, leave the cell empty"


def _error_at_byte(
    csv_path: Path, line_number: int, row_text: bytes, byte_offset: int, allowed_text: str
) -> InputError:
    """InputError at one byte within some rows."""
    begin, end = row_text.rfind(b"\n", 0, byte_offset) + 1, row_text.find(b"\n", byte_offset)
    row = row_text[begin : len(row_text) if end < 0 else end].decode("utf-8", errors="backslashreplace")
    return InputError(csv_path, f"line {line_number + row_text[:byte_offset].count(10)}", row, allowed_text)
