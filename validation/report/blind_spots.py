"""The report's section on the blind-spot audit: which rows and tests detect a fault planted in each shared function,
and the functions whose faults none detects."""

from collections import Counter
from pathlib import Path

from validation.blind_spots.shared import compiled_functions
from validation.blind_spots.table import LIST_SEPARATOR, TABLE_FILE, Line, read_table, uncovered_functions
from validation.common.rows import Saved

SHOWN_IDS = 3
"""Number of row ids and of tests that a line of the section names; further ones are only counted."""


def blind_spots(table_path: Path = TABLE_FILE) -> Saved:
    """Content of the report's section on blind spots: lines of the saved table, counts by module, commits, and
    functions that no independent check covers, by the reason.

    A compiled function that the sources share now and that has no line is not covered: it was not audited.
    """
    lines = read_table(table_path)
    names = dict.fromkeys((*(line.function for line in lines), *compiled_functions()))
    return {
        "lines": [_function_record(line) for line in lines],
        "modules": _counts_by_module(lines),
        "commits": [commit for commit, _ in Counter(line.commit for line in lines).most_common()],
        "uncovered": uncovered_functions(lines, names),
    }


def _function_record(audit_line: Line) -> Saved:
    rows, tests = (text.split(LIST_SEPARATOR) if text else [] for text in (audit_line.rows, audit_line.tests))
    return {
        "function": audit_line.function.replace(".<locals>", ""),
        "independent": audit_line.is_covered,
        "rows": rows[:SHOWN_IDS],
        "more_rows": len(rows[SHOWN_IDS:]),
        "tests": [test.rpartition("/")[2] for test in tests[:SHOWN_IDS]],
        "more_tests": len(tests[SHOWN_IDS:]),
        "ended": audit_line.ended,
        "calling": audit_line.calling,
        "left": audit_line.left,
    }


def _counts_by_module(audit_lines: list[Line]) -> list[tuple[str, int, int, int]]:
    """For each module, its name and the numbers of functions: all, covered by an independent check, and covered by any
    check."""
    of: dict[str, list[Line]] = {}
    for line in audit_lines:
        of.setdefault(line.function.partition(":")[0], []).append(line)
    return [
        (module, len(same), sum(line.is_covered for line in same), sum(line.noticing_count > 0 for line in same))
        for module, same in sorted(of.items())
    ]
