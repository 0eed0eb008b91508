"""Reader of CSV files as engineers and loggers write them: headings ``name [unit]``, a column of time, one row per
sample.

Lines that begin with ``#`` stand before the header and are kept as the comment, but for ``# start:`` (ISO 8601 with its
zone), ``# samples:`` (how many rows there must be) and ``# channel "name": text`` (a channel's comment); so are titles
above the header. Columns are parted by commas, semicolons or tabs, as ``sep=`` says or the header shows; the decimal
sign is a point, or a comma where commas do not part columns or numbers are in quotes: what the first rows show holds
for all, and whatever is not a comma and a point is said. Units stand in the headings or in a row beneath them; times
are seconds, milliseconds or times of the clock (``csv_times``). An empty cell, ``nan``, ``NA`` or ``--`` was not
measured. Text is UTF-8, UTF-16 with its mark, or else Windows-1252, which is said. Numbers are read to the last digit.
Rows are found by a table of every thousandth line, so that any block is read without those before it.
"""

import io
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.core.csv_header import TableHead, name_and_unit
from models.core.errors import InputError
from models.core.finding import Finding
from models.core.tables import SECONDS
from models.measured.channel import FileChannel
from models.measured.formats.csv_layout import (
    TIME_UNITS,
    Remarks,
    clock_heading,
    find_headings_and_clock,
    find_layout,
    find_units,
    read_first_lines,
)
from models.measured.formats.csv_rows import ROWS_PER_MARK, CsvLayout, find_rows, numbers_of_rows, one_byte_text
from models.measured.formats.opened import (
    OpenFile,
    SampleSpan,
    distinct_names,
    flaw_finding,
    library_errors_as_input,
    start_with_zone,
)


@dataclass(frozen=True)
class CsvFile(OpenFile):
    """Reader of a CSV file; ``row_positions[k]`` is the byte where row 1000 k begins, and its last element is the end
    of the used rows.

    time_column : column of time among those of numbers, None where times are those of the clock. seconds_per_unit : of
    that column. channel_columns : of the channels, among those of numbers.
    """

    layout: CsvLayout
    row_positions: np.ndarray
    time_column: int | None
    seconds_per_unit: float
    channel_columns: tuple[int, ...]

    def pieces(
        self, channel_indices: list[int], sample_spans: Iterable[SampleSpan]
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Times and values of the rows of each span."""
        columns = [self.channel_columns[i] for i in channel_indices]
        with self.path.open("rb") as file:
            for first, count in sample_spans:
                table, times = numbers_of_rows(self.path, self.layout, self._bytes_of_rows(file, first, count), first)
                yield self.seconds_per_unit * table[:, self.time_column] if times is None else times, table[:, columns]

    def _bytes_of_rows(self, open_file: io.BufferedReader, first_row: int, row_count: int) -> bytes:
        """Bytes of ``row_count`` rows from row ``first_row`` on."""
        low, high = (
            first_row // ROWS_PER_MARK,
            min(-(-(first_row + row_count) // ROWS_PER_MARK), len(self.row_positions) - 1),
        )
        open_file.seek(int(self.row_positions[low]))
        text = open_file.read(int(self.row_positions[high] - self.row_positions[low]))
        unit = self.layout.unit
        ends = np.flatnonzero(np.frombuffer(text, unit) == ord("\n"))
        skipped = first_row - low * ROWS_PER_MARK
        begin = 0 if skipped == 0 else int(ends[skipped - 1]) + 1
        return text[begin * unit.itemsize : (int(ends[skipped + row_count - 1]) + 1) * unit.itemsize]


def open_csv(csv_path: Path) -> CsvFile:
    """``CsvFile`` of a path: headings read, rows counted, notation determined; raises InputError."""
    with library_errors_as_input(csv_path):
        first_lines = read_first_lines(csv_path)
        head, clock, remarks, findings = find_headings_and_clock(csv_path, first_lines)
        units, unit_findings = find_units(csv_path, first_lines, head, clock)
        layout, notes = find_layout(csv_path, first_lines, head, clock, units)
        rows, count, left = find_rows(csv_path, layout)
        findings += notes + unit_findings + _findings_on_end(csv_path, layout, remarks, count, left)
        factor = 1.0 if layout.time_stamps else _factor_to_seconds(csv_path, head, clock, units[clock])
        start, notes = start_with_zone(csv_path, remarks.start) if remarks.start else (layout.start, [])
        columns = [i for i in layout.numbers if i != clock]
        if not columns:
            raise InputError(
                csv_path,
                f"line {head.header.number} (header)",
                ", ".join(head.names),
                "a column of numbers beside time is needed",
            )
        groups = head.groups()
        families = [groups[i] if groups else "" for i in columns]
        names, repeated = distinct_names(csv_path, [name_and_unit(head.names[i])[0] for i in columns], families)
        channels = tuple(
            FileChannel(
                name,
                unit_of(head.names[i]) or units[i],
                "\n".join(remarks.channel_comments.get(name, [])),
                0,
                count,
                None,
                family=family,
            )
            for name, family, i in zip(names, families, columns, strict=True)
        )
        places = {column: i for i, column in enumerate(layout.numbers)}
        return CsvFile(
            csv_path,
            channels,
            start,
            "\n".join(remarks.comments),
            tuple(findings + notes + repeated),
            layout,
            rows,
            places.get(clock),
            factor,
            tuple(places[i] for i in columns),
        )


def unit_of(heading: str) -> str:
    """Unit in a column heading: in brackets, or in parentheses if the text there is a unit of a quantity that can be
    mapped."""
    unit = name_and_unit(heading)[1]
    bracketed = re.fullmatch(r".*\(([^()]*[A-Za-z%°µ][^()]*)\)\s*", heading) if "[" not in heading else None
    if bracketed is None:
        return unit
    from models.measured.units import quantities_of_unit

    return bracketed[1].strip() if quantities_of_unit(bracketed[1]) else ""


def _findings_on_end(
    csv_path: Path, layout: CsvLayout, remarks: Remarks, row_count: int, byte_count_left: int
) -> list[Finding]:
    """Findings on a file that does not end as a complete file does."""
    if row_count == 0:
        raise InputError(csv_path, f"line {layout.line + 1}", None, "rows of numbers are needed, and there is none")
    findings, samples = list[Finding](), remarks.sample_count
    if byte_count_left:
        with csv_path.open("rb") as file:
            file.seek(-byte_count_left, io.SEEK_END)
            is_whole = (
                one_byte_text(file.read(), layout.unit).count(layout.separator.encode()) + 1 == layout.cells_per_row
            )
        ends = "may be" if is_whole else "is"
        text = f"the last line has no line end and {ends} cut off: it is left out, and {row_count} rows are used"
        findings.append(flaw_finding(csv_path, "note" if is_whole else "doubt", text))
    if samples is not None and samples > row_count:
        text = f"the header announces {samples} rows, but {row_count} are there: the file is cut off"
        findings.append(flaw_finding(csv_path, "doubt", text))
    if samples is not None and samples < row_count:
        raise InputError(csv_path, "samples", samples, f"the header announces fewer rows than there are ({row_count})")
    return findings


def _factor_to_seconds(csv_path: Path, table_head: TableHead, time_column: int, unit: str) -> float:
    """Factor from the unit of the column of times to seconds."""
    name, given = clock_heading(table_head.names[time_column])
    if (given or unit).casefold() not in TIME_UNITS:
        place = f"line {table_head.header.number} (header), column {name!r}, unit"
        raise InputError(csv_path, place, given or unit, f"write {name} [s]", tuple(SECONDS))
    return TIME_UNITS[(given or unit).casefold()]
