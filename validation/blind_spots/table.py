"""Saved table of the audit: for each shared function, which rows and tests notice that its output is 1 % wrong.

A row is independent if its other side does not share the function: a closed form, a published figure, or separate force
laws (``validation.common.rows.Independence``). A test is independent if its mark ``grounds`` names such grounds. Rows
of planted faults are not independent: they judge checks, not values.

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
"""Reasons why a fault changes no value: it moves a starting point or a step of a search, whose result stays within the
stated error; or the function returns views of its arguments, new arrays that are overwritten, zeros, or nothing; or it
selects by arrays of zeros and ones, in which no fault is planted."""
INDEPENDENT_GROUNDS = ("closed form", "published", "native", "written equations", "plain counterpart")
CHECKS_OF_CHECKS = "planted."
LIST_SEPARATOR = "; "
NOT_AUDITED = "not audited"


@dataclass(frozen=True)
class Line:
    """Result of the audit for a function: the checks (ids of rows and tests) that notice its fault, which of them are
    independent, and how many were not run.

    ended : "whole", or why not: "crashed", "out of time", "not spoiled" (the function returns and writes nothing in
    which a fault can be planted), "no numbers" (it returns counts or indices alone), "not run" (by any case or test of
    the audit), "not audited" (not all checks that call it were run);
    calling : number of the audit's cases and tests in which it gives numbers: checks on independent grounds, and all
    others if no independent check noticed; left : number of these checks not run, for lack of time; commit : of the
    sources; kind : "compiled", or "Python" and the engines that call the function.
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
        """Whether an independent check notices the function's fault."""
        return bool(self.independent)

    @property
    def noticing_count(self) -> int:
        """Number of rows and tests that notice the function's fault."""
        return sum(len(text.split(LIST_SEPARATOR)) for text in (self.rows, self.tests) if text)

    def joined_with(self, other_line: "Line") -> "Line":
        """Joins this line with a line that other checks gave for the same function."""
        texts = {
            name: LIST_SEPARATOR.join(filter(None, (getattr(self, name), getattr(other_line, name))))
            for name in ("rows", "tests", "independent")
        }
        made = replace(self, calling=self.calling + other_line.calling, left=self.left + other_line.left)
        made = replace(made, ended=other_line.ended if self.ended in ("whole", "not run", "no numbers") else self.ended)
        return Line(**{**asdict(made), **texts})


def read_table(table_path: Path = TABLE_FILE) -> list[Line]:
    """Lines of an audit's table (CSV); none where there is no file."""
    if not table_path.is_file():
        return []
    with table_path.open(newline="", encoding="utf-8") as file:
        return [
            Line(**{**each, "calling": int(each["calling"]), "left": int(each["left"])})  # type: ignore[arg-type]
            for each in csv.DictReader(file)
        ]


def write_table(audit_lines: Iterable[Line], table_path: Path) -> None:
    """Write an audit's table (CSV), sorted by the names of the functions."""
    with whole_file(table_path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Line)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(line) for line in sorted(audit_lines, key=lambda line: line.function))


def is_independent(check_id: str, stated_grounds: str) -> bool:
    """Whether a row or test with an id and grounds counts as an independent check."""
    return stated_grounds in INDEPENDENT_GROUNDS and not check_id.startswith(CHECKS_OF_CHECKS)


@cache
def harmless_functions() -> dict[str, tuple[str, str]]:
    """Function whose fault changes no value -> the reason, one of ``WHY_HARMLESS``, and the id of the test that proves
    it."""
    with HARMLESS_FILE.open(newline="", encoding="utf-8") as file:
        return {each["function"]: (each["why"], each["proof"]) for each in csv.DictReader(file)}


def kind_of(function_name: str, engines_of_function: Mapping[str, tuple[str, ...]]) -> str:
    """Kind of a function, in the words of ``Line.kind``: "compiled", or "Python" with the engines that share it."""
    return (
        "compiled"
        if function_name in compiled_functions()
        else " ".join(["Python", *engines_of_function.get(function_name, ())])
    )


def merged_lines(saved_lines: Iterable[Line], new_lines: Iterable[Line], function_names: Iterable[str]) -> list[Line]:
    """Table lines of a new audit, joined with the saved lines of all other functions that still exist.

    A function that the new audit did not examine retains its saved line.
    """
    new_lines = sorted(new_lines, key=lambda line: line.ended != NOT_AUDITED)
    count = sum(line.ended == NOT_AUDITED for line in new_lines)
    lines = {line.function: line for line in (*new_lines[:count], *saved_lines, *new_lines[count:])}
    return [lines[name] for name in function_names if name in lines]


def uncovered_functions(audit_lines: Iterable[Line], function_names: Iterable[str]) -> dict[str, list[str]]:
    """Reason -> functions whose fault no independent check notices.

    function_names : all functions that are shared now; functions without a line count as "not audited".
    """
    known = {line.function: line for line in audit_lines}
    gaps: dict[str, list[str]] = {"noticed by nothing": [], "noticed by nothing independent": []}
    gaps |= {"run by nothing": [], "not spoiled": [], NOT_AUDITED: [], **{why: [] for why in WHY_HARMLESS}}
    for name in function_names:
        line = known.get(name)
        if name in harmless_functions():
            gaps[harmless_functions()[name][0]].append(name)
        elif line is None or line.ended in (NOT_AUDITED, "not spoiled"):
            gaps[NOT_AUDITED if line is None else line.ended].append(name)
        elif line.ended == "not run":
            gaps["run by nothing"].append(name)
        elif not line.is_covered and line.ended != "no numbers":
            some = line.noticing_count or line.ended != "whole"
            gaps["noticed by nothing independent" if some else "noticed by nothing"].append(name)
    return {kind: names for kind, names in gaps.items() if names}


if __name__ == "__main__":
    from validation.blind_spots.shared import candidate_functions

    write_table(
        merged_lines(read_table(), read_table(Path(sys.argv[1]) / TABLE_FILE.name), candidate_functions()), TABLE_FILE
    )
