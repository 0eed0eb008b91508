"""CSV files as loggers, spreadsheets and scripts write them: the same samples in many notations, and notations that are
ambiguous."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

from validation.measured.measured_files.csv import truth_with_gap
from validation.measured.measured_files.odd import (
    FX,
    FZ,
    REPEATED_NAME,
    SAMPLE_TIMES,
    Files,
    Truth,
    file_of_bytes,
    odd_files,
    usual_truth,
)

BEGAN = datetime(2026, 3, 2, 9, 30, 0)
DAY_END = datetime(2026, 3, 2, 23, 59, 59, 900_000)
HEADINGS = ("time [s]", "Fz [N]", "Fx [N]")
BARE_HEADINGS = ("Time", "Fz", "Fx")
UNITS = ("s", "N", "N")
HOLE = range(10, 20)
"""Numbers of the rows in which some files have no force."""


@dataclass(frozen=True)
class Form:
    """How a CSV file is written; the defaults give the usual file.

    lines_above, lines_below_headings : lines above the headings, and between them and the numbers. decimal : decimal
    sign. quoted : whether every cell is in quotes. trailing : text at the end of every row. end : line end. gap : text
    instead of a force in the rows of ``HOLE``; None for the force itself. last_lines : lines after the numbers.
    last_cells : cells at the end of every row of numbers, for example a remark.
    """

    headings: tuple[str, ...] = HEADINGS
    lines_above: tuple[str, ...] = ()
    lines_below_headings: tuple[str, ...] = ()
    separator: str = ","
    decimal: str = "."
    quoted: bool = False
    trailing: str = ""
    end: str = "\n"
    encoding: str = "utf-8"
    times: Sequence[str] = tuple(map(repr, SAMPLE_TIMES.tolist()))
    gap: str | None = None
    last_lines: tuple[str, ...] = ()
    last_cells: tuple[str, ...] = ()

    def text(self) -> str:
        """Content of the whole file."""
        rows = [self.row(i) for i in range(len(self.times))]
        lines = (*self.lines_above, self.line(self.headings), *self.lines_below_headings, *rows, *self.last_lines)
        return "".join(line + self.end for line in lines)

    def row(self, row_index: int) -> str:
        """Row ``row_index`` of numbers, as text."""
        time, force, drag = (
            cell if ":" in cell else cell.replace(".", self.decimal)
            for cell in (self.times[row_index], repr(float(FZ[row_index])), repr(float(FX[row_index])))
        )
        return self.line(
            (time, force if self.gap is None or row_index not in HOLE else self.gap, drag, *self.last_cells)
        )

    def line(self, cell_texts: Sequence[str]) -> str:
        """Join cells to one line."""
        return self.separator.join(f'"{cell}"' if self.quoted else cell for cell in cell_texts) + self.trailing

    def make(self, output_folder: Path) -> Path:
        """Write the file into a folder and return its path."""
        return file_of_bytes(self.text().encode(self.encoding))(output_folder)


def time_texts(text_of_time: Callable[[datetime], str], start_time: datetime = BEGAN) -> tuple[str, ...]:
    """Times of all samples as texts. ``text_of_time`` turns a date and time into text; the first sample is at
    ``start_time``."""
    return tuple(text_of_time(start_time + timedelta(milliseconds=10 * i)) for i in range(len(SAMPLE_TIMES)))


def clock_text(time_stamp: datetime) -> str:
    """Time of day: hours, minutes, seconds and thousandths."""
    return time_stamp.strftime("%H:%M:%S.%f")[:-3]


def iso_text(time_stamp: datetime) -> str:
    """Date and time in ISO 8601, without a time zone."""
    return time_stamp.isoformat(timespec="milliseconds")


def german_text(time_stamp: datetime) -> str:
    """Date and time in German notation: day, month, year, and a decimal comma in the seconds."""
    return time_stamp.strftime("%d.%m.%Y %H:%M:%S,%f")[:-3]


GERMAN = Form(separator=";", decimal=",")
MILLI = tuple(f"{10 * i}" for i in range(len(SAMPLE_TIMES)))
TITLES = ("Kistler RoaDyn export", "Operator: Meier", "Date: 02.03.2026", "")
KEYS = ("Date;02.03.2026", "Time;09:30:00", "Channels;3", "")
WHEELS = {"VL/Fz": (SAMPLE_TIMES, FZ), "HR/Fz": (SAMPLE_TIMES, FX)}
READ: tuple[tuple[str, str, Form, Truth], ...] = (
    ("a line sep=", "a spreadsheet writes it for itself", replace(GERMAN, lines_above=("sep=;",)), usual_truth()),
    ("sep= of tabs", "the line ends in what it names", Form(lines_above=("sep=\t",), separator="\t"), usual_truth()),
    ("titles above the headings", "the first line is no header", Form(lines_above=TITLES), usual_truth()),
    (
        "keys with the word Time above",
        "a title looks like the headings",
        replace(GERMAN, lines_above=KEYS),
        usual_truth(),
    ),
    (
        "titles with commas and semicolons",
        "the separator shows in the rows alone",
        Form(lines_above=("a, b; c", "x;y;z", "1,2")),
        usual_truth(),
    ),
    (
        "a key Time right above the headings",
        "its value is no heading",
        replace(GERMAN, lines_above=("Time;09:30:00;x",)),
        usual_truth(),
    ),
    (
        "a row of words above the headings that says time",
        "two rows of headings",
        Form(lines_above=("time,vertical,long",)),
        usual_truth(),
    ),
    (
        "an index without a name",
        "pandas counts the rows",
        Form(("", *HEADINGS), times=tuple(f"{i},{t!r}" for i, t in enumerate(SAMPLE_TIMES.tolist()))),
        usual_truth(),
    ),
    ("spaces around the numbers", "columns are padded", Form(separator=" , "), usual_truth()),
    (
        "200 titles",
        "headers of data sets are long",
        Form(lines_above=tuple(f"channel {i}: Fz" for i in range(200))),
        usual_truth(),
    ),
    (
        "units beneath the headings",
        "a row of words among the numbers",
        Form(BARE_HEADINGS, lines_below_headings=(",".join(UNITS),)),
        usual_truth(),
    ),
    (
        "units in brackets beneath",
        "brackets of their own",
        Form(BARE_HEADINGS, lines_below_headings=("[s],[N],[N]",)),
        usual_truth(),
    ),
    (
        "units beneath and an empty line",
        "numbers begin three lines below",
        Form(BARE_HEADINGS, lines_below_headings=("s,N,N", "")),
        usual_truth(),
    ),
    (
        "milliseconds by the row of units",
        "taken for seconds, every rate is 1000 times too slow",
        Form(BARE_HEADINGS, lines_below_headings=("ms,N,N",), times=MILLI),
        usual_truth(),
    ),
    (
        "units beneath the forces alone",
        "the time has its unit in the heading",
        Form(("time [s]", "Fz", "Fx"), lines_below_headings=(",N,N",)),
        usual_truth(),
    ),
    (
        "two rows beneath the headings",
        "types stand above the units",
        Form(BARE_HEADINGS, lines_below_headings=("double,double,double", "s,N,N")),
        usual_truth(),
    ),
    ("every cell in quotes", "numbers look like texts", Form(quoted=True), usual_truth()),
    ("quotes around decimal commas", "commas part the columns, too", Form(quoted=True, decimal=","), usual_truth()),
    ("quotes, semicolons and decimal commas", "three habits at once", replace(GERMAN, quoted=True), usual_truth()),
    ("tabs and decimal points", "invisible separators", Form(separator="\t"), usual_truth()),
    ("tabs and decimal commas", "the same of a German logger", Form(separator="\t", decimal=","), usual_truth()),
    ("times of the clock", "hh:mm:ss is no number", Form(times=time_texts(clock_text)), usual_truth()),
    ("times over midnight", "the clock begins anew", Form(times=time_texts(clock_text, DAY_END)), usual_truth()),
    (
        "times of the clock with decimal commas",
        "a comma after the seconds",
        replace(GERMAN, times=tuple(text.replace(".", ",") for text in time_texts(clock_text))),
        usual_truth(),
    ),
    ("ISO 8601", "a date before the time", Form(times=time_texts(iso_text)), usual_truth()),
    (
        "ISO 8601 with a space and a zone",
        "an offset behind the seconds",
        Form(times=time_texts(lambda stamp: iso_text(stamp).replace("T", " ") + "+01:00")),
        usual_truth(),
    ),
    (
        "ISO 8601 in UTC, in quotes",
        "Z is a letter",
        Form(quoted=True, times=time_texts(lambda stamp: iso_text(stamp) + "Z")),
        usual_truth(),
    ),
    (
        "German dates",
        "points in the date, commas in the seconds",
        replace(GERMAN, times=time_texts(german_text)),
        usual_truth(),
    ),
    (
        "a column called Timestamp",
        "no column is called time",
        Form(("Timestamp", "Fz [N]", "Fx [N]"), times=time_texts(iso_text)),
        usual_truth(),
    ),
    ("a column called Time (s)", "the unit in other brackets", Form(("Time (s)", "Fz [N]", "Fx [N]")), usual_truth()),
    (
        "a column called Elapsed Time_s",
        "the unit behind a stroke",
        Form(("Elapsed Time_s", "Fz [N]", "Fx [N]")),
        usual_truth(),
    ),
    *(
        (f"{gap!r} where nothing was measured", "a word among numbers", Form(gap=gap), truth_with_gap())
        for gap in ("NA", "n/a", "NaN", "--", "-", "INVALID", "null", "#N/A", "-nan(ind)", " NA ")
    ),
    ("gaps in quotes with decimal commas", "an empty text", replace(GERMAN, quoted=True, gap=""), truth_with_gap()),
    ("'n.a.' and decimal commas", "a point where the sign is a comma", replace(GERMAN, gap="n.a."), truth_with_gap()),
    (
        "a byte-order mark and Windows line ends",
        "the first name keeps the mark",
        Form(encoding="utf-8-sig", end="\r\n"),
        usual_truth(),
    ),
    ("UTF-16 of Windows", "every second byte is zero", replace(GERMAN, encoding="utf-16", end="\r\n"), usual_truth()),
    (
        "UTF-16, the larger byte first",
        "the mark is the other way round",
        Form(encoding="utf-16-be", lines_above=("\ufefftitle",)),
        usual_truth(),
    ),
    ("a separator at the end of every row", "one cell too many", Form(trailing=","), usual_truth()),
    ("a separator at the end of the rows alone", "more cells than headings", Form(last_cells=("",)), usual_truth()),
    ("empty rows at the end", "rows of separators of a spreadsheet", Form(last_lines=(",,", ",,")), usual_truth()),
    (
        "comments behind # among the titles",
        "two kinds of titles",
        Form(lines_above=("# by hand", "Run 7", "# again")),
        usual_truth(),
    ),
    ("headings behind #", "numpy writes them so", Form(("# time [s]", "Fz [N]", "Fx [N]")), usual_truth()),
    (
        "groups above repeated names",
        "every wheel has an Fz",
        Form(("time [s]", "Fz [N]", "Fz [N]"), lines_above=(",VL,HR",)),
        WHEELS,
    ),
    (
        "a column of remarks",
        "texts beside the numbers",
        Form((*HEADINGS, "remark"), last_cells=("dry",)),
        usual_truth(),
    ),
    (
        "a column of dates beside the times",
        "two columns make one time",
        Form((*HEADINGS, "Date"), times=time_texts(clock_text), last_cells=("02.03.2026",)),
        usual_truth(),
    ),
)
TWO_MEANINGS: tuple[tuple[str, str, Form, str], ...] = (
    ("separators of thousands", "1.000,5 and 1,000.5 are both in use", replace(GERMAN, gap="1.000,5"), "thousands"),
    ("apostrophes of thousands", "a Swiss number", Form(gap="1'000.5"), "thousands"),
    ("spaces of thousands", "a French number", replace(GERMAN, gap="1 000,5"), "thousands"),
    ("commas of thousands in quotes", "a decimal comma for others", Form(quoted=True, gap="1,000.5"), "thousands"),
    (
        "month or day first",
        "3/2/2026",
        Form(times=time_texts(lambda s: s.strftime("%m/%d/%Y %H:%M:%S.%f"))),
        "two meanings",
    ),
    (
        "minutes and seconds alone",
        "30:00.0 of a spreadsheet",
        Form(times=time_texts(lambda s: s.strftime("%M:%S.%f"))),
        "two meanings",
    ),
    (
        "no column of time, but a rate",
        "a title says 100 Hz",
        Form(("a [-]", "Fz [N]", "Fx [N]"), lines_above=("Sample rate: 100 Hz",)),
        "line 1 ('Sample rate: 100 Hz')",
    ),
    ("no header", "the first row is one of numbers", Form(("0.0", "1.0", "2.0")), "begins with numbers"),
    ("units that differ", "N above, kN beneath", Form(lines_below_headings=("s,kN,N",)), "name one unit"),
    (
        "a time without unit, above units of the forces",
        "s or ms",
        Form(BARE_HEADINGS, lines_below_headings=(",N,N",)),
        "write Time [s]",
    ),
    ("a time without unit", "s or ms", Form(BARE_HEADINGS), "write Time [s]"),
    ("sep= of bars", "a separator that few use", Form(lines_above=("sep=|",), separator="|"), "can part the columns"),
    ("a number with its unit", "1000 N in a cell", Form(gap="1000 N"), "line 12, column 'Fz [N]'"),
    ("overload in a cell", "it was measured, and too large", Form(gap="overload"), "a number is needed"),
    ("a quote that is not closed", "two cells become one", Form(gap='"1000.5'), "quote"),
    (
        "times that change their notation",
        "another logger goes on",
        Form(times=(*time_texts(clock_text)[:20], *time_texts(iso_text)[20:])),
        "line 22, column 'time [s]'",
    ),
    (
        "a time of the clock that is none",
        "25 o'clock",
        Form(times=(*time_texts(clock_text)[:20], "25:00:00.000", *time_texts(clock_text)[21:])),
        "line 22, column 'time [s]'",
    ),
    ("line ends of an old Macintosh", "the whole file is one line", Form(end="\r"), "Macintosh"),
    ("text in UTF-32", "four bytes a letter", Form(encoding="utf-32"), "save it as UTF-8"),
)
VALUE = file_of_bytes(Form(last_cells=("",)).text().replace("-25.0,\n", "-25.0,7\n").encode())
UNKNOWN = Form(("time [s]", "Fz [µ]", "Fx [°]"), encoding="cp1252")
NAMED: Files = {
    "CSV: a column of forces that is text": (
        "a whole channel would be lost",
        Form((*HEADINGS, "Fy [N]"), last_cells=("off",)).make,
        "no numbers: 'Fy [N]'",
    ),
    "CSV: repeated names without groups": (
        "Fz of which wheel",
        Form(("time [s]", "Fz [N]", "Fz [N]")).make,
        "2 channels are called 'Fz'",
        REPEATED_NAME,
    ),
    "CSV: units of Windows-1252": ("the bytes are no UTF-8", UNKNOWN.make, "Windows-1252"),
}
FILES = odd_files(
    {f"CSV: {name}": (hard, form.make, says) for name, hard, form, says in TWO_MEANINGS}
    | {"CSV: a value beyond the last heading": ("a channel without a name", VALUE, "beyond the last heading")},
    NAMED,
    {f"CSV: {name}": (hard, form.make, truth) for name, hard, form, truth in READ},
)
