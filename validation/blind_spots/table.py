"""The kept table of the audit: for each shared function, which rows and tests notice that it is 1 % off.

Independent are rows whose other side does not share the function: an exact answer, a published figure, or force laws of
its own (``validation.common.rows.Independence``); of tests, those that name such grounds by the mark ``grounds``.
Rows of planted faults are none: they judge checks, not values.

``python -m validation.blind_spots.table FOLDER`` keeps the table of an audit in the sources.
"""

import csv
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

from models.core.whole_files import whole_file

KEPT = Path(__file__).with_name("blind_spots.csv")
INDEPENDENT = ("closed form", "published", "native", "written equations", "plain counterpart")
CHECKS_OF_CHECKS = "planted."
JOINED = "; "


@dataclass(frozen=True)
class Line:
    """Checks that notice a fault in a function: ids of rows and tests, which of them are independent, and what was not
    run.

    ended : "whole", or why not: "crashed", "out of time", "not spoiled" (rewriting sees nothing that it gives back or
    writes), "no numbers" (what it gives counts or names places), "not run" (by any case or test that was asked);
    calling : in how many cases and tests that were asked it gives numbers, which are those on independent grounds, and
    all others if none of these noticed; left : how many of them were not run, for want of time; commit : that the line
    belongs to.
    """

    function: str
    ended: str
    calling: int
    left: int
    rows: str
    tests: str
    independent: str
    commit: str

    @property
    def is_covered(self) -> bool:
        """Whether something independent notices."""
        return bool(self.independent)

    @property
    def noticed(self) -> int:
        """Number of rows and tests that notice the fault."""
        return sum(len(text.split(JOINED)) for text in (self.rows, self.tests) if text)

    def with_others(self, line: "Line") -> "Line":
        """This line joined with a line of other checks on the same function."""
        texts = {
            name: JOINED.join(filter(None, (getattr(self, name), getattr(line, name))))
            for name in ("rows", "tests", "independent")
        }
        made = replace(self, calling=self.calling + line.calling, left=self.left + line.left)
        made = replace(made, ended=line.ended if self.ended in ("whole", "not run", "no numbers") else self.ended)
        return Line(**{**asdict(made), **texts})


def read(path: Path = KEPT) -> list[Line]:
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
    return grounds in INDEPENDENT and not id.startswith(CHECKS_OF_CHECKS)


def uncovered(lines: Iterable[Line], functions: Iterable[str]) -> dict[str, list[str]]:
    """Functions that nothing independent notices, by what there is instead.

    functions : all that are shared now; those that have no line are "not audited".
    """
    known = {line.function: line for line in lines}
    gaps: dict[str, list[str]] = {"noticed by nothing": [], "noticed by nothing independent": []}
    gaps |= {"run by nothing": [], "not audited": []}
    for name in functions:
        line = known.get(name)
        if line is None or line.ended == "not spoiled":
            gaps["not audited"].append(name)
        elif line.ended == "not run":
            gaps["run by nothing"].append(name)
        elif not line.is_covered and line.ended != "no numbers":
            some = line.noticed or line.ended != "whole"
            gaps["noticed by nothing independent" if some else "noticed by nothing"].append(name)
    return {kind: names for kind, names in gaps.items() if names}


if __name__ == "__main__":
    write(read(Path(sys.argv[1]) / KEPT.name), KEPT)
