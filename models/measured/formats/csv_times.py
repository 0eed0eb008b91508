"""Dates and times of day in a CSV file, converted to seconds since the first one."""

import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from models.core.errors import InputError

CLOCK_PATTERN = r"(?P<h>\d{1,2}):(?P<m>\d{2}):(?P<s>\d{2})(?:[.,:](?P<f>\d{1,9}))?"
"""Pattern of a time of day."""
ZONE_PATTERN = r"(?P<zone>Z|[+-]\d{2}:?\d{2})?"
"""Pattern of a time zone."""
TIME_NOTATIONS = {
    "hh:mm:ss.fff": re.compile(CLOCK_PATTERN),
    "ISO 8601": re.compile(
        rf"(?P<y>\d{{4}})[-/](?P<o>\d{{1,2}})[-/](?P<d>\d{{1,2}})[ T]+{CLOCK_PATTERN} ?{ZONE_PATTERN}"
    ),
    "dd.mm.yyyy hh:mm:ss.fff": re.compile(rf"(?P<d>\d{{1,2}})\.(?P<o>\d{{1,2}})\.(?P<y>\d{{4}})[ T]+{CLOCK_PATTERN}"),
}
"""Notations of time that have one meaning, with their patterns."""
DAY_IN_NANOSECONDS = 86_400_000_000_000
"""Length of a day (ns)."""


@dataclass(frozen=True)
class TimeStamps:
    """Notation of the time stamps in a column; ``first_time`` is the first one, in ns since 1970 or since midnight."""

    notation: str
    zone: str
    first_time: int
    first_text: str

    @property
    def start(self) -> datetime | None:
        """Date and time at time 0; None where the file names no time zone."""
        if not self.zone:
            return None
        text = str(np.datetime64(self.first_time, "ns").astype("datetime64[us]"))
        return datetime.fromisoformat(text + self.zone.replace("Z", "+00:00"))

    def seconds(self, csv_path: Path, time_cells: list[str], line_number: int, column_name: str) -> np.ndarray:
        """Seconds (n,) since the first time stamp, for the cells of some rows, of which the first is line
        ``line_number``.

        Times of the day go on past midnight, for a day at most. Raises InputError at the first one that is none.
        """
        try:
            stamps = np.array([self._cell_for_numpy(cell) for cell in time_cells], "datetime64[ns]").astype(np.int64)
        except (ValueError, TypeError):
            raise self._first_wrong_cell(csv_path, time_cells, line_number, column_name) from None
        passed = stamps - self.first_time
        return np.asarray((passed % DAY_IN_NANOSECONDS if self.notation == "hh:mm:ss.fff" else passed) / 1e9)

    def _cell_for_numpy(self, cell: str) -> str:
        """A cell in the form in which numpy reads a time; ValueError where it has another notation or zone."""
        matched = TIME_NOTATIONS[self.notation].fullmatch(cell.strip())
        if matched is None or (matched.groupdict().get("zone") or "") != self.zone:
            raise ValueError(cell)
        return _iso_text(matched)

    def _first_wrong_cell(
        self, csv_path: Path, time_cells: list[str], line_number: int, column_name: str
    ) -> InputError:
        """InputError for the first cell that is no time in this notation."""
        for i, cell in enumerate(time_cells):
            try:
                np.datetime64(self._cell_for_numpy(cell), "ns")
            except ValueError:
                where = f" with the zone {self.zone}" if self.zone else ""
                return InputError(
                    csv_path,
                    f"line {line_number + i}, column {column_name!r}",
                    cell.strip(),
                    f"a time such as {self.first_text} is needed ({self.notation}{where}, as in the first row)",
                )
        return InputError(
            csv_path, f"line {line_number} and after, column {column_name!r}", None, "times of the clock are needed"
        )


def find_stamps(csv_path: Path, first_cell: str, line_number: int, column_name: str) -> TimeStamps:
    """``TimeStamps`` of a column, from its first cell; raises InputError, with advice, where the cell can be read in
    two ways."""
    first_cell = first_cell.strip()
    for form, pattern in TIME_NOTATIONS.items():
        matched = pattern.fullmatch(first_cell)
        if matched is not None:
            plain = TimeStamps(form, matched.groupdict().get("zone") or "", 0, first_cell)
            try:
                zero = int(np.datetime64(_iso_text(matched), "ns").astype(np.int64))
            except ValueError:
                raise plain._first_wrong_cell(csv_path, [first_cell], line_number, column_name) from None
            return TimeStamps(form, plain.zone, zero, first_cell)
    raise InputError(
        csv_path,
        f"line {line_number}, column {column_name!r}",
        first_cell,
        "this notation of times has two meanings or none: "
        "write 2026-03-02T09:30:00.000, 09:30:00.000, or seconds in a column time [s]",
    )


def _iso_text(matched: re.Match[str]) -> str:
    """ISO 8601 text of a matched time stamp."""
    part = matched.groupdict()
    year, month, day = (part.get("y") or "1970", part.get("o") or "01", part.get("d") or "01")
    return f"{year}-{month:0>2}-{day:0>2}T{part['h']:0>2}:{part['m']}:{part['s']}.{part['f'] or '0'}"
