"""Layout of a CSV file, determined from its first lines: comments, headings, units, separator, decimal sign, clock."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from models.core.csv_header import (
    CLOCK_TIME_PATTERN,
    MISSING_VALUE_PATTERN,
    SEPARATORS,
    FileLine,
    TableHead,
    decimal_sign,
    find_headings,
    find_heads_above_numbers,
    is_number,
    name_and_unit,
    separator_line,
    split_cells,
)
from models.core.errors import InputError
from models.core.finding import Finding, FindingWeight
from models.measured.formats.csv_rows import CsvLayout
from models.measured.formats.csv_times import find_stamps
from models.measured.formats.opened import flaw_finding

FIRST_ROWS_BYTES = 1 << 20
"""Number of bytes at the beginning of a file that must contain the first rows of numbers."""
FIRST_ROWS_LINES = 2000
"""Number of lines at the beginning of a file that must contain the first rows of numbers."""
TIME_COLUMN_NAMES = ("time", "zeit", "t")
"""Usual names of the column of time."""
OTHER_TIME_COLUMN_NAMES = (
    "timestamp",
    "timestamps",
    "time stamp",
    "zeitstempel",
    "uhrzeit",
    "date time",
    "datetime",
    "datum zeit",
    "datum uhrzeit",
    "elapsed time",
    "relative time",
    "absolute time",
    "rel time",
    "abs time",
    "time rel",
    "time abs",
    "test time",
    "run time",
    "messzeit",
    "time axis",
    "zeitachse",
    "x value",
)
"""Headings that mean the column of time in a file where no heading is a usual name of it."""
TIME_UNITS = {
    "s": 1.0,
    "sec": 1.0,
    "secs": 1.0,
    "second": 1.0,
    "seconds": 1.0,
    "sekunden": 1.0,
    "ms": 1e-3,
    "msec": 1e-3,
    "milliseconds": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "ns": 1e-9,
}
"""Units of time in lower case, with their factors to seconds."""
_RATE_PATTERN = re.compile(
    r"\d\s*k?hz\b|(rate|freq|abtast|sampl|interval|period|increment|delta[ _]?t)\D*\d", re.IGNORECASE
)
_DATE_PATTERN = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}")
_NUMBER_START_PATTERN = re.compile(r"[+-]?[.,]?\d")
BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be", b"\xef\xbb\xbf": "utf-8"}
"""Byte-order marks with which text begins, and the encoding that each shows."""
NEEDED_HEADINGS_TEXT = "a CSV file needs a header line name [unit], ... and rows of numbers, as text"


@dataclass
class FirstLines:
    """First lines of a CSV file, and facts on its format.

    lines : those that are neither empty nor comments. comment_lines : comments that begin with ``#``. separator : as a
    line ``sep=`` says. undecodable_lines : numbers of lines that are no UTF-8. unit : of characters. unreadable_line :
    number of the line that could not be read, 0 for none.
    """

    unit: np.dtype
    lines: list[FileLine] = field(default_factory=list)
    comment_lines: list[FileLine] = field(default_factory=list)
    separator: str = ""
    undecodable_lines: list[FileLine] = field(default_factory=list)
    unreadable_line: int = 0


@dataclass
class Remarks:
    """Facts that the comment lines of a CSV file state."""

    comments: list[str] = field(default_factory=list)
    start: str = ""
    sample_count: int | None = None
    channel_comments: dict[str, list[str]] = field(default_factory=dict)

    def add(self, csv_path: Path, line_number: int, comment_text: str) -> None:
        """Evaluate one comment line, given without its ``#``."""
        key, _, value = comment_text.partition(":")
        if key == "start":
            self.start = value.strip()
        elif key == "samples":
            if not value.strip().isdecimal():
                raise InputError(csv_path, f"line {line_number}, samples", value.strip(), "a number of rows is needed")
            self.sample_count = int(value)
        elif (remark := re.fullmatch(r'channel ("(?:[^"\\]|\\.)*"): ?(.*)', comment_text)) is not None:
            self.channel_comments.setdefault(_name_in_quotes(csv_path, line_number, remark[1]), []).append(remark[2])
        else:
            self.comments.append(value.removeprefix(" ") if key == "comment" else comment_text)


def _name_in_quotes(csv_path: Path, line_number: int, quoted_name: str) -> str:
    """A channel's name from a JSON string in quotes."""
    try:
        return str(json.loads(quoted_name))
    except ValueError:
        raise InputError(csv_path, f"line {line_number}", quoted_name, "a channel's name in quotes is needed") from None


def read_first_lines(csv_path: Path) -> FirstLines:
    """``FirstLines`` of a file; raises InputError where no line is text."""
    with csv_path.open("rb") as file:
        data = file.read(FIRST_ROWS_BYTES)
    codec, mark = next(
        ((codec, mark) for mark, codec in BYTE_ORDER_MARKS.items() if data.startswith(mark)), ("utf-8", b"")
    )
    first_lines = FirstLines(np.dtype({"utf-16-le": "<u2", "utf-16-be": ">u2"}.get(codec, "u1")))
    for line in _complete_lines(data, len(mark), codec, first_lines):
        shown = line.text.strip()
        if line.number == 1 and separator_line(line.text):
            first_lines.separator = separator_line(line.text)
        elif shown.startswith("#"):
            first_lines.comment_lines.append(line)
        elif shown:
            first_lines.lines.append(line)
    if first_lines.separator and first_lines.separator not in SEPARATORS:
        raise InputError(
            csv_path, "line 1", first_lines.separator, f"{', '.join(SEPARATORS.values())} can part the columns"
        )
    if not first_lines.lines and not (first_lines.comment_lines and not first_lines.unreadable_line):
        old = b"\r" in data and b"\n" not in data
        hint = ": lines end as on an old Macintosh, and have to be saved with line ends of today" if old else ""
        raise InputError(
            csv_path,
            f"line {first_lines.unreadable_line or len(first_lines.comment_lines) + 1}",
            None,
            NEEDED_HEADINGS_TEXT + hint,
        )
    return first_lines


def _complete_lines(file_bytes: bytes, first_byte: int, codec: str, first_lines: FirstLines) -> Iterator[FileLine]:
    """Complete lines of text, up to the first one that contains a zero character or has no line end."""
    size = first_lines.unit.itemsize
    characters = np.frombuffer(file_bytes[: len(file_bytes) // size * size], first_lines.unit)
    ends = (np.flatnonzero(characters == ord("\n")) + 1) * size
    for number, end in enumerate(ends[:FIRST_ROWS_LINES].tolist(), start=1):
        try:
            text, foreign = file_bytes[first_byte:end].decode(codec), False
        except UnicodeDecodeError:
            text, foreign = file_bytes[first_byte:end].decode("cp1252", errors="replace"), True
        if "\0" in text:
            first_lines.unreadable_line = number
            return
        line = FileLine(number, text.rstrip("\r\n"), first_byte, end)
        if foreign:
            first_lines.undecodable_lines.append(line)
        yield line
        first_byte = end
    first_lines.unreadable_line = len(ends) + 1 if len(ends) < FIRST_ROWS_LINES else 0


def find_headings_and_clock(csv_path: Path, first_lines: FirstLines) -> tuple[TableHead, int, Remarks, list[Finding]]:
    """Headings above the numbers, index of the column of time, facts in the comments, and findings on these lines."""
    head, known = _table_head(csv_path, first_lines)
    clocks = [i for i, name in enumerate(head.names) if known(name)]
    if len(clocks) != 1:
        raise InputError(
            csv_path,
            f"line {head.header.number} (header)",
            ", ".join(head.names),
            f"one column time [s] is needed, found {len(clocks)}",
        )
    remarks = Remarks()
    above = [
        line
        for line in (*first_lines.comment_lines, *head.titles)
        if line.number <= head.line_before_numbers and line != head.header
    ]
    for line in sorted(above):
        if line in first_lines.comment_lines:
            remarks.add(csv_path, line.number, line.text.strip()[1:].strip())
        else:
            remarks.comments.append(line.text.strip(' ",;\t'))
    foreign = {
        passage.number: passage.text.strip()[:60]
        for passage in first_lines.undecodable_lines
        if passage.number <= head.line_before_numbers
    }
    odd = "is not UTF-8 and is read as Windows-1252"
    said = [flaw_finding(csv_path, "doubt", f"line {number} {odd}: {text!r}") for number, text in foreign.items()]
    if first_lines.unit.itemsize > 1:
        said.append(flaw_finding(csv_path, "note", "the text is UTF-16"))
    if head.titles:
        text = f"{len(head.titles)} line(s) above the headings in line {head.header.number} are kept as the comment"
        said.append(flaw_finding(csv_path, "note", text))
    return head, clocks[0], remarks, said


IsClock = Callable[[str], bool]
"""Function that tells whether a heading means the column of time."""


def _table_head(csv_path: Path, first_lines: FirstLines) -> tuple[TableHead, IsClock]:
    """Headings above the numbers, determined by the first method that gives exactly one result. Lines behind # count
    too, since numpy writes headings there."""
    signs = (first_lines.separator,) if first_lines.separator else tuple(SEPARATORS)
    bare = [line._replace(text=line.text.strip().lstrip("# ")) for line in first_lines.comment_lines]
    every = sorted((*first_lines.lines, *bare))
    for find, lines in (
        (find_heads_above_numbers, first_lines.lines),
        (find_heads_above_numbers, every),
        (find_headings, first_lines.lines),
    ):
        for known in (is_clock, is_other_clock):
            heads = find(lines, known, signs)
            if len(heads) == 1:
                return heads[0], known
            if heads:
                what = " and ".join(SEPARATORS[head.separator] for head in heads)
                place, text = f"line {heads[0].header.number} (header)", heads[0].header.text
                raise InputError(
                    csv_path, place, text, f"commas alone (or semicolons, or tabs) must part the columns, found {what}"
                )
    raise _no_clock_error(csv_path, first_lines, signs)


def _no_clock_error(csv_path: Path, first_lines: FirstLines, tried_signs: tuple[str, ...]) -> InputError:
    """InputError that says why no line can be the headings, and what the user has to write."""
    lines = first_lines.lines or first_lines.comment_lines
    first = next((line for line in lines if any(sign in line.text for sign in tried_signs)), lines[0])
    place, text = f"line {first.number} (header)", first.text.strip()
    rate = next(
        (line for line in (*first_lines.lines, *first_lines.comment_lines) if _RATE_PATTERN.search(line.text)), None
    )
    if rate is not None:
        needed = (
            f"one column time [s] is needed, found 0: line {rate.number} ({rate.text.strip()[:40]!r}) speaks of the "
            "sampling; write the time of every row"
        )
    elif not any(sign in first.text for sign in tried_signs):
        needed = (
            f"commas alone (or semicolons, or tabs) must part the columns, found no separator; {NEEDED_HEADINGS_TEXT}"
        )
    elif any(all(map(is_number, cells)) for sign in tried_signs if len(cells := split_cells(text, sign)) > 1):
        needed = "the file begins with numbers: write a header line time [s], name [unit], ... above them"
    else:
        needed = "one column time [s] is needed, found 0: call it so in the header line"
    return InputError(csv_path, place, text, needed)


def clock_heading(heading: str) -> tuple[str, str]:
    """Name and unit in the heading of a column of time; the unit is in brackets, or as in ``time (s)``, ``time / s``,
    ``time_s``."""
    name, unit = name_and_unit(heading)
    in_name = re.fullmatch(r"(.*?)\s*(?:\(([^()]*)\)|[/_,]\s*([^\W\d]+))", name) if not unit else None
    if in_name is not None and (in_name[2] is not None or in_name[3].casefold() in TIME_UNITS):
        return in_name[1], (in_name[2] or in_name[3] or "").strip()
    return name, unit


def is_clock(heading: str) -> bool:
    """Whether a heading is a usual name of the column of time."""
    return clock_heading(heading)[0].casefold() in TIME_COLUMN_NAMES


def is_other_clock(heading: str) -> bool:
    """Whether a heading can mean the column of time, in a file where no heading is a usual name of it."""
    name = clock_heading(heading)[0]
    parted = (name, re.sub(r"([a-z])([A-Z])", r"\1 \2", name))
    return any(" ".join(re.findall(r"[^\W_]+", words.casefold())) in OTHER_TIME_COLUMN_NAMES for words in parted)


def first_cells(first_lines: FirstLines, table_head: TableHead) -> list[list[str]]:
    """Cells of each column in the first rows of numbers; rows of another width are skipped here and reported later."""
    lines = [line for line in first_lines.lines if line.number > table_head.line_before_numbers]
    rows = [cells for line in lines if len(cells := split_cells(line.text, table_head.separator)) == table_head.width]
    return [[row[i] for row in rows] for i in range(len(table_head.names))]


def find_layout(
    csv_path: Path, first_lines: FirstLines, table_head: TableHead, time_column: int, column_units: tuple[str, ...]
) -> tuple[CsvLayout, list[Finding]]:
    """``CsvLayout`` of the rows of a CSV file, from the first rows, and findings; raises InputError where two
    interpretations are possible."""
    columns, first_row = first_cells(first_lines, table_head), table_head.line_before_numbers + 1
    first = next(iter(columns[time_column]), "")
    stamps = find_stamps(csv_path, first, first_row, table_head.names[time_column]) if is_stamp(first) else None
    nameless = tuple(i for i, name in enumerate(table_head.names) if not name_and_unit(name)[0])
    texts = tuple(i for i, cells in enumerate(columns) if i not in (time_column, *nameless) and _is_text(cells))
    taken = tuple(sorted({*texts, *nameless, *((time_column,) if stamps else ())}))
    numbers = {cell: None for i, cells in enumerate(columns) if i not in taken for cell in cells}
    decimal = decimal_sign(csv_path, first_row, table_head.separator, list(numbers))
    layout = CsvLayout(
        table_head.separator,
        decimal,
        table_head.numbers_begin,
        table_head.line_before_numbers,
        table_head.names,
        table_head.width,
        taken,
        time_column,
        stamps,
        first_lines.unit,
    )
    said = list[Finding]()
    for i in texts:
        weight: FindingWeight = "doubt" if column_units[i] or name_and_unit(table_head.names[i])[1] else "note"
        said.append(flaw_finding(csv_path, weight, f"left out, no numbers: {table_head.names[i]!r}"))
    for i in nameless:
        cells = columns[i]
        counts = cells[:1] in (["0"], ["1"]) and cells == [str(k + int(cells[0])) for k in range(len(cells))]
        weight = "note" if counts else "doubt"
        said.append(flaw_finding(csv_path, weight, f"column {i + 1} has no name and is left out"))
    return layout, said + [flaw_finding(csv_path, "note", text) for text in _layout_remarks(layout, list(numbers))]


def _layout_remarks(layout: CsvLayout, cells: list[str]) -> Iterator[str]:
    """Sentences on deviations from the usual form: commas between columns of numbers with decimal points."""
    stamps = layout.time_stamps
    if stamps is not None:
        wraps = "; they go on past midnight" if stamps.notation == "hh:mm:ss.fff" else ""
        yield (
            f"{layout.names[layout.time_column]!r} holds times of the clock ({stamps.notation}); seconds are "
            f"counted from the first, {stamps.first_text}{wraps}"
        )
    marks = [
        repr(cell) for cell in cells if cell.casefold() not in ("", "nan") and MISSING_VALUE_PATTERN.fullmatch(cell)
    ]
    if marks:
        yield f"cells {', '.join(marks)} are read as not measured"
    sign = "comma" if layout.decimal_sign == "," else "point"
    if layout.separator != "," or layout.decimal_sign == ",":
        yield f"{SEPARATORS[layout.separator]} part the columns and the decimal sign is a {sign}"


def is_stamp(cell: str) -> bool:
    """Whether a cell is a time of day or a date with time."""
    return not is_number(cell) and CLOCK_TIME_PATTERN.fullmatch(cell) is not None


def _is_text(column_cells: list[str]) -> bool:
    """Whether a column holds text or dates, so that no cell in it can be a number."""
    said = [cell for cell in column_cells if not MISSING_VALUE_PATTERN.fullmatch(cell)]
    return bool(said) and all(
        CLOCK_TIME_PATTERN.fullmatch(cell) or _DATE_PATTERN.fullmatch(cell) or not _NUMBER_START_PATTERN.match(cell)
        for cell in said
    )


def find_units(
    csv_path: Path, first_lines: FirstLines, table_head: TableHead, time_column: int
) -> tuple[tuple[str, ...], list[Finding]]:
    """Units of the columns from a row below the headings, empty texts if there is no such row, and findings."""
    stamped = any(map(is_stamp, first_cells(first_lines, table_head)[time_column][:1]))
    rows = [(line, [_bare_unit(cell) for cell in table_head.cells(line)]) for line in table_head.rows_between]
    known = {*TIME_UNITS, "", "-"} if clock_heading(table_head.names[time_column])[1] else set(TIME_UNITS)
    unit_row = next((row for row in rows if row[1][time_column].casefold() in known or stamped), None)
    if unit_row is None:
        said = [
            flaw_finding(
                csv_path, "note", f"line {line.number}, beneath the headings, is not read: {line.text.strip()[:60]!r}"
            )
            for line, _ in rows
        ]
        return ("",) * len(table_head.names), said
    line, units = unit_row
    for i, (name, unit) in enumerate(zip(table_head.names, units, strict=True)):
        if unit not in ("", "-") and name_and_unit(name)[1] not in ("", unit) and not (stamped and i == time_column):
            raise InputError(csv_path, f"line {line.number}", unit, f"the heading says {name!r}: name one unit")
    return tuple(units), [flaw_finding(csv_path, "note", f"line {line.number}, beneath the headings, is read as units")]


def _bare_unit(cell: str) -> str:
    """A unit without surrounding brackets."""
    brackets = re.fullmatch(r"\s*[\[(](.*)[\])]\s*", cell)
    return (brackets[1] if brackets else cell).strip()
