"""Tables of measured values: CSV files with the unit of every column in the header, read strictly.

The accepted text, in full: UTF-8, or UTF-16 with its mark; lines that start with ``#`` and empty lines are
skipped; the first other line is the header, ``name [unit], name [unit], ...`` in any order; every further
line holds one finite number per column (or none, or ``nan``, where the reader allows gaps), comma between
columns, point as decimal sign. A last line without a line end is taken as it is if its last number goes on
from those before it, and ``ended`` says so; one that was cut off in a number is refused. What spreadsheets
and loggers make of such a table (semicolons and decimal commas, tabs, quotes, titles above, units in a row
beneath the headings, a line ``sep=``) is turned into that form first, by ``models.core.csv_header``, where it has
one meaning. Long tables of the plain form are read block by block: what is wrong with the header is the user's to
repair before anything is computed; what is wrong with a row is told beside that row, and all others go on.
"""

import io
import itertools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TextIO

import numpy as np

from models.core.errors import InputError
from models.core.whole_files import write_whole

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
"""Accepted units of lengths, with their factors to SI."""
DISTANCES = {"m": 1.0, "km": 1e3}
"""Accepted units of distances along a road, with their factors to SI."""
SECONDS = {"s": 1.0, "ms": 1e-3}
"""Accepted units of times, with their factors to SI."""
NEWTONS = {"N": 1.0, "kN": 1e3}
"""Accepted units of forces, with their factors to SI."""
PER_METRE = {"1/m": 1.0, "rad/m": 1.0, "1/mm": 1e3, "rad/mm": 1e3}
"""Accepted units of curvatures and of spin creepage, with their factors to SI."""
SHARES = {"-": 1.0, "%": 1e-2}
"""Accepted units of ratios, with their factors to SI."""
RADIANS = {"rad": 1.0, "deg": math.pi / 180.0}
"""Accepted units of angles, with their factors to SI."""
ACCELERATIONS = {"m/s^2": 1.0, "g": 9.80665}
"""Accepted units of accelerations, with their factors to SI."""
RADIANS_PER_SECOND = {"rad/s": 1.0, "deg/s": math.pi / 180.0}
"""Accepted units of angular rates, with their factors to SI."""

GAP_CELLS = ("", "nan")
"""Cells that mark a missing measured value, where gaps are allowed."""

UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""Byte-order marks with which text in UTF-16 begins."""
HEADING_CHARACTERS = 100_000
"""Number of characters at the beginning of a file among which the headings of a plain table are looked for."""
CACHED_TEXTS = 4
"""Number of files whose numbers stay in memory: every engine and method of a comparison reads the same few files."""

NUMBER_PATTERN = re.compile(r"[-+]?(?=\.?\d)(\d*)\.?(\d*)(?:[eE][-+]?(\d+))?")
"""Pattern of a number with three groups: the digits before the decimal point, after it and in the exponent."""
COMPARED_ROWS_BEFORE_CUT, LARGEST_LEAP = 8, 3.0
"""Number of rows before a last one without a line end, and how many times their largest difference the last value may
differ from the one before."""

ROWS_PER_BLOCK = 20_000
"""Rows per block in which a long table is read."""

ColumnUnits = Mapping[str, Mapping[str, float]]
"""Accepted units of each column, with their factors to SI."""
NumberedLines = list[tuple[int, str]]
"""Line numbers and texts of the lines of a file."""

_HEADING_PATTERN = re.compile(r"([^\[\]]*?)\s*(?:\[\s*([^\[\]]*?)\s*\])?")


def read_table(
    table_path: str | Path,
    column_units: ColumnUnits,
    *,
    increasing_column: str | None = None,
    least_row_count: int = 1,
    allows_gaps: bool = False,
) -> dict[str, np.ndarray]:
    """Read a CSV table whose header names the unit of every column.

    Parameters
    ----------
    table_path : the file
    column_units : name of each wanted column -> its accepted units, each with its factor to SI, for example
        ``{"time": SECONDS, "front": NEWTONS}``; the file has these columns and no others
    increasing_column : column whose values must rise from every row to the next one (time, arc length)
    least_row_count : smallest accepted number of rows
    allows_gaps : whether a cell may be empty or ``nan``, which is then NaN; never one of the increasing column

    Returns
    -------
    name -> float array of shape (rows,), in SI units; signs and frames are as in the file

    Raises
    ------
    InputError : naming file, line (counted from 1), column, value, what is allowed and the nearest match
    """
    text = whole_text(table_path)
    if not _is_plain(text, column_units):
        from models.core.csv_header import plain_text

        text = plain_text(table_path, text, tuple(column_units))
    header, rows = _header_and_rows(table_path, text)
    names, factors = columns_and_factors(table_path, header, column_units)
    raw = _all_cells(table_path, text, tuple(allows_gaps and name != increasing_column for name in names))
    if len(rows) < least_row_count:
        raise InputError(table_path, "rows", len(rows), f"at least {least_row_count} rows of numbers are needed")
    table = {name: raw[:, i] * factors[i] for i, name in enumerate(names)}
    if increasing_column is not None:
        _check_increasing(table_path, rows, increasing_column, raw[:, names.index(increasing_column)])
    return {name: table[name] for name in column_units}


def write_table(table_path: str | Path, column_units: Mapping[str, tuple[str, np.ndarray]]) -> None:
    """Write columns name -> (unit, values) with all digits, so that reading returns identical numbers."""
    names = [f"{name} [{unit}]" for name, (unit, _) in column_units.items()]
    line = ",".join(["%.17g"] * len(names)) + "\n"
    rows = zip(*(np.asarray(values).tolist() for _, values in column_units.values()), strict=True)
    write_whole(Path(table_path), ",".join(names) + "\n" + "".join([line % row for row in rows]))


def whole_text(table_path: str | Path) -> str:
    """Whole text of a file; raises InputError if the file cannot be read."""
    try:
        data = Path(table_path).read_bytes()
        return data.decode("utf-16" if data.startswith(UTF_16) else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(table_path, f"byte {error.start}", None, "the file must be text in UTF-8") from None
    except OSError as error:
        raise InputError(table_path, "", None, f"the file cannot be read: {error.strerror}") from None


def _is_plain(table_text: str, column_units: ColumnUnits) -> bool:
    """Whether the first line of a text has known headings with units, separated by commas, and no cell is quoted."""
    first = next(
        (line for line in table_text[:HEADING_CHARACTERS].split("\n") if line.strip() and not line.startswith("#")), ""
    )
    names = [cell.partition("[")[0].strip() for cell in first.split(",")]
    strange = '"' in table_text or ";" in first or "\t" in first or "[" not in first or names[-1] == ""
    return not strange and any(name in column_units for name in names)


@lru_cache(CACHED_TEXTS)
def _header_and_rows(table_path: str | Path, table_text: str) -> tuple[tuple[int, str], NumberedLines]:
    """Header line and rows of numbers, each with its line number, without comments and empty lines."""
    lines = [(i, line.strip()) for i, line in enumerate(table_text.split("\n"), start=1)]
    used = [(i, line) for i, line in lines if line and not line.startswith("#")]
    if not used:
        raise InputError(table_path, "", None, "the file is empty: a header line and rows of numbers are needed")
    if not table_text.endswith("\n") and _last_line_is_cut_off([line for _, line in used]):
        line_text = f"line {len(lines)}"
        raise InputError(
            table_path,
            line_text,
            lines[-1][1],
            "the last line has no line end and was cut off: add one, or delete the line",
        )
    return used[0], used[1:]


def has_line_end(table_path: str | Path) -> bool:
    """Whether the last line of a file has a line end; if not, the last number may lack digits."""
    with Path(table_path).open("rb") as file:
        size = file.seek(0, io.SEEK_END)
        file.seek(max(size - 1, 0))
        return file.read() in (b"\n", b"")


def _last_line_is_cut_off(last_lines: list[str]) -> bool:
    """Whether a last line without a line end is incomplete: a cell or digits are missing, or the value jumps more than
    in the rows before.

    A number counts as complete if it has as many digits before the point, after it and in the exponent as every other
    row has at least.
    """
    *complete_lines, last_line = [line.rpartition(",") for line in last_lines]
    if last_line[0].count(",") != last_lines[0].rpartition(",")[0].count(",") or len(complete_lines) < 3:
        return True
    numbers = [NUMBER_PATTERN.fullmatch(cell.strip()) for _, _, cell in (*complete_lines[1:], last_line)]
    if None in numbers:
        return True
    *digit_counts, cut = [[len(digits or "") for digits in number.groups()] for number in numbers if number is not None]
    fewest = [min(counts) for counts in zip(*digit_counts, strict=True)]
    has_all_digits = cut[1] >= fewest[1] and cut[2] >= fewest[2] and (fewest[1] > 0 or cut[0] >= fewest[0])
    value, *earlier = (float(cell) for _, _, cell in (last_line, *complete_lines[:0:-1][:COMPARED_ROWS_BEFORE_CUT]))
    leaps = [abs(a - b) for a, b in itertools.pairwise(earlier)]
    leaping = len(last_line[2]) < len(complete_lines[-1][2]) and abs(value - earlier[0]) > LARGEST_LEAP * max(
        leaps, default=0.0
    )
    return not has_all_digits or leaping


def columns_and_factors(
    table_path: str | Path, header_line: tuple[int, str], column_units: ColumnUnits
) -> tuple[list[str], list[float]]:
    """Column names and factors to SI, in the order of the file."""
    line_text = f"line {header_line[0]} (header)"
    names, factors = zip(
        *(_column_and_factor(table_path, line_text, cell, column_units) for cell in header_line[1].split(",")),
        strict=True,
    )
    for name in names:
        if names.count(name) > 1:
            raise InputError(table_path, line_text, name, "this column appears twice")
    for name in column_units:
        if name not in names:
            raise InputError(
                table_path,
                line_text,
                header_line[1],
                f"column {name!r} is missing; wanted: {_header_wanted(column_units)}",
            )
    return list(names), list(factors)


def _column_and_factor(
    table_path: str | Path, line_text: str, cell_text: str, column_units: ColumnUnits
) -> tuple[str, float]:
    """Name and factor to SI of one column heading, such as ``left [mm]``."""
    match = _HEADING_PATTERN.fullmatch(cell_text.strip().strip('"'))
    name, unit = match.groups() if match else (cell_text.strip(), None)
    if name not in column_units:
        allowed = f"this column is not known; wanted, separated by commas: {_header_wanted(column_units)}"
        raise InputError(table_path, line_text, name, allowed, tuple(column_units))
    units = tuple(column_units[name])
    if unit is None:
        raise InputError(
            table_path, line_text, cell_text.strip(), f"the unit is missing: write {name} [{units[0]}]", units
        )
    if unit not in column_units[name]:
        raise InputError(table_path, f"{line_text}, column {name!r}, unit", unit, "this unit is not known here", units)
    return name, column_units[name][unit]


def _header_wanted(column_units: ColumnUnits) -> str:
    """Header line that the file should have, with the first accepted unit of each column."""
    return ", ".join(f"{name} [{next(iter(units))}]" for name, units in column_units.items())


@lru_cache(CACHED_TEXTS)
def _all_cells(table_path: str | Path, table_text: str, gaps_allowed: tuple[bool, ...]) -> np.ndarray:
    """All cells of a table as an array (rows, columns), in the units of the file; NaN for gaps in the columns that
    allow gaps."""
    header, rows = _header_and_rows(table_path, table_text)
    headings = header[1].split(",")
    values = np.empty((len(rows), len(headings)))
    for i, (line, row) in enumerate(rows):
        values[i] = _numbers_of_row(table_path, line, row, headings, gaps_allowed)
    return values


def _numbers_of_row(
    table_path: str | Path, line_number: int, row_text: str, headings: list[str], gaps_allowed: tuple[bool, ...]
) -> list[float]:
    """The numbers of one row of a table; raises InputError that names its line."""
    cells = row_text.split(",")
    if len(cells) != len(headings):
        raise InputError(
            table_path,
            f"line {line_number}",
            row_text.strip(),
            f"{len(headings)} values are needed, found {len(cells)}",
        )
    return [
        math.nan if gap and cell.strip().lower() in GAP_CELLS else finite_number(table_path, line_number, title, cell)
        for title, cell, gap in zip(headings, cells, gaps_allowed, strict=True)
    ]


def finite_number(table_path: str | Path, line_number: int, heading: str, cell_text: str) -> float:
    """The finite number in a cell; raises InputError for other text, also for Python's extensions (1_000, non-Latin
    digits)."""
    try:
        value = float(cell_text) if cell_text.isascii() and "_" not in cell_text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        line_text = f"line {line_number}, column {heading.strip()!r}"
        raise InputError(table_path, line_text, cell_text.strip(), "a finite number such as 0.5 or -1.2e-3 is needed")
    return value


def _check_increasing(
    table_path: str | Path, numbered_lines: NumberedLines, column_name: str, column_values: np.ndarray
) -> None:
    """Raise InputError at the first row whose value is not greater than the one before."""
    wrong = np.flatnonzero(np.diff(column_values) <= 0.0)
    if wrong.size:
        i = int(wrong[0]) + 1
        line_text = f"line {numbered_lines[i][0]}, column {column_name!r}"
        raise InputError(
            table_path,
            line_text,
            float(column_values[i]),
            f"must be greater than {column_values[i - 1]:g} in the row before it",
        )


@dataclass(frozen=True)
class RowBlock:
    """Block of successive rows of a table.

    lines : (rows,) line of the file, counted from 1. values : name -> (rows,) in SI, NaN throughout a wrong row.
    faulty_rows : row of the block -> what is wrong with it.
    """

    lines: list[int]
    values: dict[str, np.ndarray]
    faulty_rows: dict[int, str]


def table_blocks(
    table_path: Path, possible_columns: tuple[ColumnUnits, ...], block_rows: int = ROWS_PER_BLOCK
) -> Iterator[RowBlock]:
    """Blocks of at most ``block_rows`` rows of a CSV table.

    possible_columns : the accepted sets of columns, of which the header must name one in full, each with its accepted
    units and their factors to SI. Raises InputError for a file or a header that cannot be used."""
    with _opened_text(table_path) as file:
        lines = ((i, line) for i, line in enumerate(file, start=1) if line.strip() and not line.startswith("#"))
        header = next(lines, None)
        if header is None:
            raise InputError(table_path, "", None, "the file is empty: a header line and rows of numbers are needed")
        names, factors = columns_and_factors(
            table_path, (header[0], header[1].strip()), _nearest_columns(header[1], possible_columns)
        )
        while block := list(itertools.islice(lines, block_rows)):
            yield _row_block(table_path, block, names, np.array(factors), header[1].split(","))


def _opened_text(table_path: Path) -> TextIO:
    """The file opened as text, with a replacement for bytes that are no text; raises InputError if it cannot be
    read."""
    try:
        return table_path.open(encoding="utf-8-sig", errors="replace")  # a byte that is no text spoils its row alone
    except OSError as error:
        raise InputError(table_path, "", None, f"the file cannot be read: {error.strerror}") from None


def _nearest_columns(header_text: str, possible_columns: tuple[ColumnUnits, ...]) -> ColumnUnits:
    """The set of columns that has most names in common with a header line."""
    in_header = {cell.partition("[")[0].strip().strip('"') for cell in header_text.split(",")}
    return max(possible_columns, key=lambda wanted: len(in_header & set(wanted)))


def _row_block(
    table_path: Path,
    numbered_rows: list[tuple[int, str]],
    column_names: list[str],
    unit_factors: np.ndarray,
    headings: list[str],
) -> RowBlock:
    """Block of rows in SI units; a row that cannot be read is NaN, with a message."""
    lines, wrong = [line for line, _ in numbered_rows], {}
    values = _rows_at_once(numbered_rows, len(column_names))
    if values is None:
        values = np.full((len(numbered_rows), len(column_names)), np.nan)
        for i, (line, text) in enumerate(numbered_rows):
            try:
                values[i] = _numbers_of_row(table_path, line, text, headings, (False,) * len(headings))
            except InputError as error:
                wrong[i] = str(error).partition(f"line {line}")[2].lstrip(":, ")
    values = values * unit_factors
    return RowBlock(lines, {name: values[:, j] for j, name in enumerate(column_names)}, wrong)


def _rows_at_once(numbered_rows: list[tuple[int, str]], column_count: int) -> np.ndarray | None:
    """All rows of a block parsed in one call, shape (rows, columns); None if some row must be parsed by itself."""
    rows = [text for _, text in numbered_rows]
    if not (all(map(str.isascii, rows)) and rows[-1].endswith("\n")) or any("_" in text for text in rows):
        return None
    try:
        values = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.shape == (len(numbered_rows), column_count) and np.isfinite(values).all() else None
