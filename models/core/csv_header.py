"""Finds the headings, units and first row of numbers in CSV files of spreadsheets and loggers, and turns them line by
line into the plain form of ``models.core.tables``.

The line of headings is the first one with a heading that the caller knows (a clock, say) above a row of numbers with as
many cells. Whatever exporters write above it is kept: title rows, a row of groups; beneath it a row of units.
"""

import csv
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from models.core.errors import InputError

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
MOST_ROWS_BETWEEN = 3
"""Largest number of rows between the headings and the numbers."""
NUMBER_PATTERN = re.compile(r"\s*[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?\s*", re.IGNORECASE)
MISSING_VALUE_PATTERN = re.compile(
    r"\s*([+-]?nan(\(ind\))?|#?n/?a|n\.a\.|null|none|-+|inv(alid)?|missing|\*+|\?+|no ?data|void|"
    r"#value!|#div/0!|[+-]?1[.,]#(qnan|ind)0*)?\s*",
    re.IGNORECASE,
)
"""Pattern of the cells that mark a missing measured value."""
CLOCK_TIME_PATTERN = re.compile(
    r"\s*(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]+)?\d{1,3}:\d{2}(:\d{2})?([.,:]\d+)?\s*(z|[+-]\d{2}:?\d{2}|"
    r"am|pm)?\s*",
    re.IGNORECASE,
)
"""Pattern of the cells that hold a time of day, with or without a date, in any common notation."""
_THOUSANDS_PATTERN = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_HEADING_PATTERN = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\])?", re.DOTALL)


class FileLine(NamedTuple):
    """A line of a text file: its number from 1, its text without the line end, and the bytes where it begins and
    ends."""

    number: int
    text: str
    first_byte: int
    end: int


@dataclass(frozen=True)
class TableHead:
    """Headings of a CSV table, and the lines around them up to the numbers.

    header : the line of headings. separator : between its cells. names : its cells, those that are empty at its end
    left out. width : cells of the rows of numbers. titles : lines above the headings. rows_between : rows between
    headings and numbers. numbers_begin, line_before_numbers : byte where the rows of numbers begin, and number of the
    line before them.
    """

    header: FileLine
    separator: str
    names: tuple[str, ...]
    width: int
    titles: tuple[FileLine, ...]
    rows_between: tuple[FileLine, ...]
    numbers_begin: int
    line_before_numbers: int

    def cells(self, file_line: FileLine) -> tuple[str, ...]:
        """Cells of a line, cut or filled up with empty ones to the number of headings."""
        return tuple((split_cells(file_line.text, self.separator) + [""] * len(self.names))[: len(self.names)])

    def groups(self) -> tuple[str, ...]:
        """Group name of each heading, from the row above the headings if it has as many cells; an empty cell repeats
        the name before it. Returns () if there is no such row."""
        cells_above = split_cells(self.titles[-1].text, self.separator) if self.titles else []
        if (
            len(self.names) < 3
            or len(without_empty_end(cells_above)) < 2
            or len(cells_above) not in (len(self.names), self.width)
        ):
            return ()
        groups = [""]
        for cell in cells_above[: len(self.names)]:
            groups.append(cell or groups[-1])
        return tuple(groups[1:])


def name_and_unit(heading_text: str) -> tuple[str, str]:
    """Name and unit in one heading; the unit is in the last pair of brackets, and is empty if there are none."""
    match = _HEADING_PATTERN.fullmatch(heading_text)
    name, unit = match.groups("") if match else (heading_text, "")
    return name.strip(), unit.strip()


def split_cells(line_text: str, separator: str) -> list[str]:
    """Cells of a line, stripped of quotes and surrounding spaces."""
    try:
        return [cell.strip() for cell in next(csv.reader([line_text], delimiter=separator, skipinitialspace=True), [])]
    except csv.Error:
        return [line_text]


def without_empty_end(row_cells: Sequence[str]) -> list[str]:
    """Cells of a line without the empty ones at its end."""
    used = max((i for i, cell in enumerate(row_cells, start=1) if cell), default=0)
    return list(row_cells[:used])


def separator_line(line_text: str) -> str:
    """Column separator given by a first line such as ``sep=;``; empty for any other line."""
    matched = re.fullmatch(r'\s*"?sep=(.)"?\s*', line_text, re.IGNORECASE)
    return matched[1] if matched else ""


def decimal_sign(csv_path: str | Path, line_number: int, separator: str, row_cells: Sequence[str]) -> str:
    """Decimal sign ("." or ",") of number cells, the first of which stands in line ``line_number``. Raises InputError
    where a comma can be a decimal sign or a separator of thousands."""
    commas, why = [cell for cell in row_cells if "," in cell], ""
    if not commas:
        return "."
    if any("." in cell for cell in row_cells if is_number(cell.replace(",", ""))):
        why = (
            "the numbers hold points and commas: write them "
            "with one decimal sign and nothing else, without separators of thousands"
        )
    elif separator == "," and all(map(_THOUSANDS_PATTERN.fullmatch, commas)):
        why = "the comma can be a decimal sign or one of thousands: write numbers with a decimal point and nothing else"
    if why:
        raise InputError(csv_path, f"line {line_number} and after", commas[0], why)
    return ","


def is_number(cell_text: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma."""
    return NUMBER_PATTERN.fullmatch(cell_text) is not None


def find_heads_above_numbers(
    file_lines: Sequence[FileLine], is_known_heading: Callable[[str], bool], separators: Sequence[str]
) -> list[TableHead]:
    """Headings in the first line that stands above a row of numbers: one ``TableHead`` for each separator that splits
    it so. Empty if there is no such line."""
    heads = (
        [head for sign in separators if (head := _head_in_line(file_lines, i, is_known_heading, sign))]
        for i in range(len(file_lines))
    )
    return next(filter(None, heads), [])


def find_headings(
    file_lines: Sequence[FileLine], is_known_heading: Callable[[str], bool], separators: Sequence[str]
) -> list[TableHead]:
    """Headings in the first line with a known heading, whatever rows follow: one ``TableHead`` for each possible
    separator. Errors in the rows are reported when they are read."""
    for i, line in enumerate(file_lines):
        parted = {sign: without_empty_end(split_cells(line.text, sign)) for sign in separators}
        heads = [
            TableHead(line, sign, tuple(names), len(names), tuple(file_lines[:i]), (), line.end, line.number)
            for sign, names in parted.items()
            if len(names) > 1 and any(map(is_known_heading, names))
        ]
        if heads:
            return heads
    return []


def _head_in_line(
    file_lines: Sequence[FileLine], line_index: int, is_known_heading: Callable[[str], bool], separator: str
) -> TableHead | None:
    """The ``TableHead`` of line ``line_index`` if headings stand there above a row of numbers; else None."""
    names = without_empty_end(split_cells(file_lines[line_index].text, separator))
    first_known = next((k for k, name in enumerate(names) if is_known_heading(name)), None)
    if (
        first_known is None
        or len(names) < 2
        or any(is_number(name) or CLOCK_TIME_PATTERN.fullmatch(name) for name in names)
    ):
        return None
    for j in range(line_index + 1, min(line_index + 2 + MOST_ROWS_BETWEEN, len(file_lines))):
        cells = split_cells(file_lines[j].text, separator)
        if not (len(cells) >= len(names) >= len(without_empty_end(cells))):
            return None
        if is_number(cells[first_known]) or CLOCK_TIME_PATTERN.fullmatch(cells[first_known]):
            lines_above, between = tuple(file_lines[:line_index]), tuple(file_lines[line_index + 1 : j])
            first = file_lines[j]
            return TableHead(
                file_lines[line_index],
                separator,
                tuple(names),
                len(cells),
                lines_above,
                between,
                first.first_byte,
                first.number - 1,
            )
        if any(is_number(cell) or is_known_heading(cell) for cell in cells):
            return None
    return None


def plain_text(csv_path: str | Path, file_text: str, wanted_headings: Collection[str]) -> str:
    """Text of a CSV table in plain form: commas between columns, decimal points and units in the headings. Every line
    keeps its number.

    ``wanted_headings`` are names of columns, by which the headings are known. Titles become comments; a separator that
    ends the lines, quotes and a row of units go. What has two meanings, or is no such table, comes back as it was, for
    the reader to refuse; InputError where a comma can be a decimal sign or one of thousands.
    """
    lines = [FileLine(i, line, i, i) for i, line in enumerate(file_text.split("\n"), start=1)]
    declared_separator = separator_line(lines[0].text)
    used = [line for line in lines[bool(declared_separator) :] if line.text.strip() and not line.text.startswith("#")]
    heads = find_heads_above_numbers(
        used,
        lambda cell: name_and_unit(cell)[0] in wanted_headings,
        (declared_separator,) if declared_separator else tuple(SEPARATORS),
    )
    if len(heads) != 1 or not heads[0].separator or declared_separator not in ("", *SEPARATORS):
        return file_text
    return _plain_table(csv_path, lines, heads[0])


def _plain_table(csv_path: str | Path, file_lines: list[FileLine], table_head: TableHead) -> str:
    """Text of a CSV table with headings and rows in the plain form."""
    rows = {
        line.number: split_cells(line.text, table_head.separator)
        for line in file_lines[table_head.line_before_numbers :]
    }
    cells = [cell for row in rows.values() for cell in row]
    sign = decimal_sign(csv_path, table_head.line_before_numbers + 1, table_head.separator, cells)
    new = {
        line.number: f"# {line.text}" if line.text.strip() else ""
        for line in file_lines[: table_head.line_before_numbers]
    }
    new[table_head.header.number] = ",".join(_headings_with_units(table_head))
    for number, row in rows.items():
        row_cells = (
            row[: len(table_head.names)]
            if len(row) == table_head.width and not any(row[len(table_head.names) :])
            else row
        )
        new[number] = ",".join(_plain_cell(cell, sign) for cell in row_cells)
    return "\n".join(new[line.number] for line in file_lines)


def _headings_with_units(table_head: TableHead) -> list[str]:
    """Column headings, completed by the units from the row beneath them if there is one."""
    if len(table_head.rows_between) != 1:
        return list(table_head.names)
    units = [cell.strip("[]() ") for cell in table_head.cells(table_head.rows_between[0])]
    return [
        name if name_and_unit(name)[1] else f"{name} [{unit}]"
        for name, unit in zip(table_head.names, units, strict=True)
    ]


def _plain_cell(cell_text: str, decimal_sign_used: str) -> str:
    """Cell text in plain form: a number with a decimal point, ``nan`` for a mark of missing data, other text without
    commas."""
    if is_number(cell_text) and decimal_sign_used == ",":
        return cell_text.replace(",", ".")
    return "nan" if cell_text and MISSING_VALUE_PATTERN.fullmatch(cell_text) else cell_text.replace(",", ";")
