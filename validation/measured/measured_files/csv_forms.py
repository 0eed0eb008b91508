"""CSV as loggers, spreadsheets and scripts write it: the same samples in many forms, and forms with two meanings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

from validation.measured.measured_files.csv import holes
from validation.measured.measured_files.odd import FX, FZ, REPEATED_NAME, SAMPLE_TIMES, Files, Truth, every, raw, usual

BEGAN = datetime(2026, 3, 2, 9, 30, 0)
DAY_END = datetime(2026, 3, 2, 23, 59, 59, 900_000)
HEADINGS = ("time [s]", "Fz [N]", "Fx [N]")
BARE_HEADINGS = ("Time", "Fz", "Fx")
UNITS = ("s", "N", "N")
HOLE = range(10, 20)
"""Rows in which some forms have no force."""


@dataclass(frozen=True)
class Form:
    """How a CSV file is written; the defaults are the usual file.

    above, between : lines above the headings, and beneath them. decimal : sign. quoted : whether every cell is.
    trailing : what ends every row. gap : what stands for a force in the rows of the hole; None for the force itself.
    comments : a column of text beside.
    """

    headings: tuple[str, ...] = HEADINGS
    above: tuple[str, ...] = ()
    between: tuple[str, ...] = ()
    separator: str = ","
    decimal: str = "."
    quoted: bool = False
    trailing: str = ""
    end: str = "\n"
    encoding: str = "utf-8"
    times: Sequence[str] = tuple(map(repr, SAMPLE_TIMES.tolist()))
    gap: str | None = None
    below: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()

    def text(self) -> str:
        """Text of the whole file."""
        rows = [self.row(i) for i in range(len(self.times))]
        lines = (*self.above, self.line(self.headings), *self.between, *rows, *self.below)
        return "".join(line + self.end for line in lines)

    def row(self, i: int) -> str:
        """One row of numbers."""
        time, force, drag = (
            cell if ":" in cell else cell.replace(".", self.decimal)
            for cell in (self.times[i], repr(float(FZ[i])), repr(float(FX[i])))
        )
        return self.line((time, force if self.gap is None or i not in HOLE else self.gap, drag, *self.beside))

    def line(self, cells: Sequence[str]) -> str:
        """Cells as one line."""
        return self.separator.join(f'"{cell}"' if self.quoted else cell for cell in cells) + self.trailing

    def make(self, folder: Path) -> Path:
        """Write the file."""
        return raw(self.text().encode(self.encoding))(folder)


def stamps(written: Callable[[datetime], str], began: datetime = BEGAN) -> tuple[str, ...]:
    """Function that writes the time of a sample as date and time of day in a given notation."""
    return tuple(written(began + timedelta(milliseconds=10 * i)) for i in range(len(SAMPLE_TIMES)))


def clock(time_stamp: datetime) -> str:
    """Hours, minutes, seconds and thousandths."""
    return time_stamp.strftime("%H:%M:%S.%f")[:-3]


def iso(time_stamp: datetime) -> str:
    """ISO 8601 without a zone."""
    return time_stamp.isoformat(timespec="milliseconds")


def german(time_stamp: datetime) -> str:
    """Day, month and year, with a decimal comma."""
    return time_stamp.strftime("%d.%m.%Y %H:%M:%S,%f")[:-3]


GERMAN = Form(separator=";", decimal=",")
MILLI = tuple(f"{10 * i}" for i in range(len(SAMPLE_TIMES)))
TITLES = ("Kistler RoaDyn export", "Operator: Meier", "Date: 02.03.2026", "")
KEYS = ("Date;02.03.2026", "Time;09:30:00", "Channels;3", "")
WHEELS = {"VL/Fz": (SAMPLE_TIMES, FZ), "HR/Fz": (SAMPLE_TIMES, FX)}
READ: tuple[tuple[str, str, Form, Truth], ...] = (
    ("a line sep=", "a spreadsheet writes it for itself", replace(GERMAN, above=("sep=;",)), usual()),
    ("sep= of tabs", "the line ends in what it names", Form(above=("sep=\t",), separator="\t"), usual()),
    ("titles above the headings", "the first line is no header", Form(above=TITLES), usual()),
    ("keys with the word Time above", "a title looks like the headings", replace(GERMAN, above=KEYS), usual()),
    (
        "titles with commas and semicolons",
        "the separator shows in the rows alone",
        Form(above=("a, b; c", "x;y;z", "1,2")),
        usual(),
    ),
    (
        "a key Time right above the headings",
        "its value is no heading",
        replace(GERMAN, above=("Time;09:30:00;x",)),
        usual(),
    ),
    (
        "a row of words above the headings that says time",
        "two rows of headings",
        Form(above=("time,vertical,long",)),
        usual(),
    ),
    (
        "an index without a name",
        "pandas counts the rows",
        Form(("", *HEADINGS), times=tuple(f"{i},{t!r}" for i, t in enumerate(SAMPLE_TIMES.tolist()))),
        usual(),
    ),
    ("spaces around the numbers", "columns are padded", Form(separator=" , "), usual()),
    ("200 titles", "headers of data sets are long", Form(above=tuple(f"channel {i}: Fz" for i in range(200))), usual()),
    (
        "units beneath the headings",
        "a row of words among the numbers",
        Form(BARE_HEADINGS, between=(",".join(UNITS),)),
        usual(),
    ),
    ("units in brackets beneath", "brackets of their own", Form(BARE_HEADINGS, between=("[s],[N],[N]",)), usual()),
    (
        "units beneath and an empty line",
        "numbers begin three lines below",
        Form(BARE_HEADINGS, between=("s,N,N", "")),
        usual(),
    ),
    (
        "milliseconds by the row of units",
        "taken for seconds, every rate is 1000 times too slow",
        Form(BARE_HEADINGS, between=("ms,N,N",), times=MILLI),
        usual(),
    ),
    (
        "units beneath the forces alone",
        "the time has its unit in the heading",
        Form(("time [s]", "Fz", "Fx"), between=(",N,N",)),
        usual(),
    ),
    (
        "two rows beneath the headings",
        "types stand above the units",
        Form(BARE_HEADINGS, between=("double,double,double", "s,N,N")),
        usual(),
    ),
    ("every cell in quotes", "numbers look like texts", Form(quoted=True), usual()),
    ("quotes around decimal commas", "commas part the columns, too", Form(quoted=True, decimal=","), usual()),
    ("quotes, semicolons and decimal commas", "three habits at once", replace(GERMAN, quoted=True), usual()),
    ("tabs and decimal points", "invisible separators", Form(separator="\t"), usual()),
    ("tabs and decimal commas", "the same of a German logger", Form(separator="\t", decimal=","), usual()),
    ("times of the clock", "hh:mm:ss is no number", Form(times=stamps(clock)), usual()),
    ("times over midnight", "the clock begins anew", Form(times=stamps(clock, DAY_END)), usual()),
    (
        "times of the clock with decimal commas",
        "a comma after the seconds",
        replace(GERMAN, times=tuple(text.replace(".", ",") for text in stamps(clock))),
        usual(),
    ),
    ("ISO 8601", "a date before the time", Form(times=stamps(iso)), usual()),
    (
        "ISO 8601 with a space and a zone",
        "an offset behind the seconds",
        Form(times=stamps(lambda stamp: iso(stamp).replace("T", " ") + "+01:00")),
        usual(),
    ),
    (
        "ISO 8601 in UTC, in quotes",
        "Z is a letter",
        Form(quoted=True, times=stamps(lambda stamp: iso(stamp) + "Z")),
        usual(),
    ),
    ("German dates", "points in the date, commas in the seconds", replace(GERMAN, times=stamps(german)), usual()),
    (
        "a column called Timestamp",
        "no column is called time",
        Form(("Timestamp", "Fz [N]", "Fx [N]"), times=stamps(iso)),
        usual(),
    ),
    ("a column called Time (s)", "the unit in other brackets", Form(("Time (s)", "Fz [N]", "Fx [N]")), usual()),
    (
        "a column called Elapsed Time_s",
        "the unit behind a stroke",
        Form(("Elapsed Time_s", "Fz [N]", "Fx [N]")),
        usual(),
    ),
    *(
        (f"{gap!r} where nothing was measured", "a word among numbers", Form(gap=gap), holes())
        for gap in ("NA", "n/a", "NaN", "--", "-", "INVALID", "null", "#N/A", "-nan(ind)", " NA ")
    ),
    ("gaps in quotes with decimal commas", "an empty text", replace(GERMAN, quoted=True, gap=""), holes()),
    ("'n.a.' and decimal commas", "a point where the sign is a comma", replace(GERMAN, gap="n.a."), holes()),
    (
        "a byte-order mark and Windows line ends",
        "the first name keeps the mark",
        Form(encoding="utf-8-sig", end="\r\n"),
        usual(),
    ),
    ("UTF-16 of Windows", "every second byte is zero", replace(GERMAN, encoding="utf-16", end="\r\n"), usual()),
    (
        "UTF-16, the larger byte first",
        "the mark is the other way round",
        Form(encoding="utf-16-be", above=("\ufefftitle",)),
        usual(),
    ),
    ("a separator at the end of every row", "one cell too many", Form(trailing=","), usual()),
    ("a separator at the end of the rows alone", "more cells than headings", Form(beside=("",)), usual()),
    ("empty rows at the end", "rows of separators of a spreadsheet", Form(below=(",,", ",,")), usual()),
    (
        "comments behind # among the titles",
        "two kinds of titles",
        Form(above=("# by hand", "Run 7", "# again")),
        usual(),
    ),
    ("headings behind #", "numpy writes them so", Form(("# time [s]", "Fz [N]", "Fx [N]")), usual()),
    (
        "groups above repeated names",
        "every wheel has an Fz",
        Form(("time [s]", "Fz [N]", "Fz [N]"), above=(",VL,HR",)),
        WHEELS,
    ),
    ("a column of remarks", "texts beside the numbers", Form((*HEADINGS, "remark"), beside=("dry",)), usual()),
    (
        "a column of dates beside the times",
        "two columns make one time",
        Form((*HEADINGS, "Date"), times=stamps(clock), beside=("02.03.2026",)),
        usual(),
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
        Form(times=stamps(lambda s: s.strftime("%m/%d/%Y %H:%M:%S.%f"))),
        "two meanings",
    ),
    (
        "minutes and seconds alone",
        "30:00.0 of a spreadsheet",
        Form(times=stamps(lambda s: s.strftime("%M:%S.%f"))),
        "two meanings",
    ),
    (
        "no column of time, but a rate",
        "a title says 100 Hz",
        Form(("a [-]", "Fz [N]", "Fx [N]"), above=("Sample rate: 100 Hz",)),
        "line 1 ('Sample rate: 100 Hz')",
    ),
    ("no header", "the first row is one of numbers", Form(("0.0", "1.0", "2.0")), "begins with numbers"),
    ("units that differ", "N above, kN beneath", Form(between=("s,kN,N",)), "name one unit"),
    (
        "a time without unit, above units of the forces",
        "s or ms",
        Form(BARE_HEADINGS, between=(",N,N",)),
        "write Time [s]",
    ),
    ("a time without unit", "s or ms", Form(BARE_HEADINGS), "write Time [s]"),
    ("sep= of bars", "a separator that few use", Form(above=("sep=|",), separator="|"), "can part the columns"),
    ("a number with its unit", "1000 N in a cell", Form(gap="1000 N"), "line 12, column 'Fz [N]'"),
    ("overload in a cell", "it was measured, and too large", Form(gap="overload"), "a number is needed"),
    ("a quote that is not closed", "two cells become one", Form(gap='"1000.5'), "quote"),
    (
        "times that change their notation",
        "another logger goes on",
        Form(times=(*stamps(clock)[:20], *stamps(iso)[20:])),
        "line 22, column 'time [s]'",
    ),
    (
        "a time of the clock that is none",
        "25 o'clock",
        Form(times=(*stamps(clock)[:20], "25:00:00.000", *stamps(clock)[21:])),
        "line 22, column 'time [s]'",
    ),
    ("line ends of an old Macintosh", "the whole file is one line", Form(end="\r"), "Macintosh"),
    ("text in UTF-32", "four bytes a letter", Form(encoding="utf-32"), "save it as UTF-8"),
)
VALUE = raw(Form(beside=("",)).text().replace("-25.0,\n", "-25.0,7\n").encode())
UNKNOWN = Form(("time [s]", "Fz [µ]", "Fx [°]"), encoding="cp1252")
NAMED: Files = {
    "CSV: a column of forces that is text": (
        "a whole channel would be lost",
        Form((*HEADINGS, "Fy [N]"), beside=("off",)).make,
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
FILES = every(
    {f"CSV: {name}": (hard, form.make, says) for name, hard, form, says in TWO_MEANINGS}
    | {"CSV: a value beyond the last heading": ("a channel without a name", VALUE, "beyond the last heading")},
    NAMED,
    {f"CSV: {name}": (hard, form.make, truth) for name, hard, form, truth in READ},
)
