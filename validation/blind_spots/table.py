"""The kept table of the audit: for each shared function, which rows and tests notice that it is 1 % off.

Independent are rows whose other side does not share the function: an exact answer, a published figure, or force laws of
its own (``validation.common.rows.Independence``); of tests, those that name such grounds by the mark ``grounds``.
Rows of planted faults are none: they judge checks, not values.

A fault that changes no value needs no judge: ``harmless.csv`` names such functions, why, and the test that proves it.

``python -m validation.blind_spots.table FOLDER`` keeps the table of an audit in the sources, and the kept lines of
functions that it did not spoil.
"""

import csv
import sys
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import cache
from pathlib import Path

from models.core.whole_files import whole_file
from validation.blind_spots.shared import compiled_functions

TABLE_FILE = Path(__file__).with_name("blind_spots.csv")
HARMLESS_FILE = Path(__file__).with_name("harmless.csv")
WHY_HARMLESS = (
    "harmless, as they change cost alone",
    "harmless, without a number of their own",
    "harmless, as they give whole numbers alone",
)
"""Why a fault changes no value: it moves a starting point or a step of a search, whose end stays within the stated
error; or the function gives views of its arguments, new arrays that are written over, zeros, or nothing; or it selects,
by arrays of zeros and ones, which are not spoiled."""
INDEPENDENT_GROUNDS = ("closed form", "published", "native", "written equations", "plain counterpart")
CHECKS_OF_CHECKS = "planted."
LIST_SEPARATOR = "; "
NOT_AUDITED = "not audited"


@dataclass(frozen=True)
class Line:
    """Result for one function: the checks (ids of rows and tests) that notice its fault, which of these are
    independent, and how many were not run.

    ended : "whole", or why not: "crashed", "out of time", "not spoiled" (rewriting sees nothing that it gives back or
    writes), "no numbers" (what it gives counts or names places), "not run" (by any case or test that was asked), "not
    audited" (it is shared, and not all that call it were asked);
    calling : in how many cases and tests that were asked it gives numbers, which are those on independent grounds, and
    all others if none of these noticed; left : how many of them were not run, for want of time; commit : that the line
    belongs to; kind : "compiled", or "Python" and the engines that call the function.
    """

    function: str
    ended: str
    calling: int
    left: int
    rows: str
    tests: str
    independent: str
    commit: str
    kind: str = "compiled"

    @property
    def is_covered(self) -> bool:
        """Whether an independent check notices the fault."""
        return bool(self.independent)

    @property
    def noticed(self) -> int:
        """Number of rows and tests that notice the fault."""
        return sum(len(text.split(LIST_SEPARATOR)) for text in (self.rows, self.tests) if text)

    def with_others(self, line: "Line") -> "Line":
        """This line joined with a line of other checks on the same function."""
        texts = {
            name: LIST_SEPARATOR.join(filter(None, (getattr(self, name), getattr(line, name))))
            for name in ("rows", "tests", "independent")
        }
        made = replace(self, calling=self.calling + line.calling, left=self.left + line.left)
        made = replace(made, ended=line.ended if self.ended in ("whole", "not run", "no numbers") else self.ended)
        return Line(**{**asdict(made), **texts})


def read(path: Path = TABLE_FILE) -> list[Line]:
    """The lines of a table; none where there is no file."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Line(**{**each, "calling": int(each["calling"]), "left": int(each["left"])})  # type: ignore[arg-type]
            for each in csv.DictReader(file)
        ]


def write(lines: Iterable[Line], path: Path) -> None:
    """Keep a table, functions in the order of their names."""
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Line)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(line) for line in sorted(lines, key=lambda line: line.function))


def is_independent(id: str, grounds: str) -> bool:
    """Whether a row or test with this id on these grounds counts as independent."""
    return grounds in INDEPENDENT_GROUNDS and not id.startswith(CHECKS_OF_CHECKS)


@cache
def harmless_functions() -> dict[str, tuple[str, str]]:
    """Functions whose faults change no value: why, one of ``WHY_HARMLESS``, and the id of the test that proves it."""
    with HARMLESS_FILE.open(newline="", encoding="utf-8") as file:
        return {each["function"]: (each["why"], each["proof"]) for each in csv.DictReader(file)}


def kind_of(function: str, engines: Mapping[str, tuple[str, ...]]) -> str:
    """Kind of a function, in the words of ``Line.kind``: compiled, or in Python and shared by which engines."""
    return "compiled" if function in compiled_functions() else " ".join(["Python", *engines.get(function, ())])


def merged_lines(kept: Iterable[Line], measured: Iterable[Line], functions: Iterable[str]) -> list[Line]:
    """The newly measured lines, and the kept lines of all other functions that still exist.

    A function that was not audited now keeps its line.
    """
    measured = sorted(measured, key=lambda line: line.ended != NOT_AUDITED)
    count = sum(line.ended == NOT_AUDITED for line in measured)
    lines = {line.function: line for line in (*measured[:count], *kept, *measured[count:])}
    return [lines[name] for name in functions if name in lines]


def uncovered_functions(lines: Iterable[Line], functions: Iterable[str]) -> dict[str, list[str]]:
    """Functions whose fault no independent check notices, grouped by the reason.

    functions : all that are shared now; those that have no line are "not audited" as well.
    """
    known = {line.function: line for line in lines}
    gaps: dict[str, list[str]] = {"noticed by nothing": [], "noticed by nothing independent": []}
    gaps |= {"run by nothing": [], "not spoiled": [], NOT_AUDITED: [], **{why: [] for why in WHY_HARMLESS}}
    for name in functions:
        line = known.get(name)
        if name in harmless_functions():
            gaps[harmless_functions()[name][0]].append(name)
        elif line is None or line.ended in (NOT_AUDITED, "not spoiled"):
            gaps[NOT_AUDITED if line is None else line.ended].append(name)
        elif line.ended == "not run":
            gaps["run by nothing"].append(name)
        elif not line.is_covered and line.ended != "no numbers":
            some = line.noticed or line.ended != "whole"
            gaps["noticed by nothing independent" if some else "noticed by nothing"].append(name)
    return {kind: names for kind, names in gaps.items() if names}


if __name__ == "__main__":
    from validation.blind_spots.shared import candidate_functions

    write(merged_lines(read(), read(Path(sys.argv[1]) / TABLE_FILE.name), candidate_functions()), TABLE_FILE)
