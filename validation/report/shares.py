"""Rows and computing times of a quick report compared with the last full report, by system.

``python -m validation.report.shares FOLDER`` saves rows and seconds of each case of a full report in
``full_report.json``; quick reports state them, and cases that took long are started first.
"""

import json
import sys
from collections import Counter
from functools import cache
from pathlib import Path
from typing import get_args

from models.core.errors import InputError
from models.core.whole_files import write_whole
from validation.cases import CASES
from validation.common.rows import Saved, System

FULL_REPORT_FILE = Path(__file__).with_name("full_report.json")
QUICK_SECONDS = {
    "pitch-plane": 13,
    "drift": 16,
    "contact": 9,
    "ride": 8,
    "rolling-vehicle": 5,
    "anti-lock": 8,
    "measured": 3,
    "hard-cases": 14,
    "cost": 12,
    "effects": 12,
}
"""Processor time (s, summed over two cores) that each system may take of the quick report's minute, once kernels are
compiled."""
DRAWING_SECONDS = 20
"""Processor time (s, summed over two cores) of that minute for starting and drawing."""
assert set(QUICK_SECONDS) == set(get_args(System)) and sum(QUICK_SECONDS.values()) + DRAWING_SECONDS == 120


@cache
def full_report_data() -> dict[str, Saved]:
    """Saved data of each case of the last full report: number of rows by system, seconds, and commit."""
    kept: dict[str, Saved] = json.loads(FULL_REPORT_FILE.read_text(encoding="utf-8"))
    return kept


def case_of_row(report_row: Saved) -> str:
    """Name of the case that a row belongs to: the row's id begins with it, or with one of its words."""
    first = report_row["id"].partition(".")[0]
    return first if first in CASES else next((case for case in CASES if first in case.split("_")), first)


def report_sizes_of_systems(validation_results: Saved) -> list[Saved]:
    """For each system, the numbers of cases and rows that were measured, computing times, and the same for the last
    full report.

    A case counts to the system of most of its rows. What is not known of some case of a system is None.
    """
    counted = _row_counts(validation_results["rows"])
    main = {case: systems.most_common(1)[0][0] for case, systems in counted.items()}
    return [
        _sizes_of_system(system, counted, main, validation_results["provenance"]["seconds"])
        for system in QUICK_SECONDS
        if any(system in systems for systems in counted.values())
    ]


def _sizes_of_system(
    system_name: str,
    row_counts: dict[str, Counter[str]],
    main_system_of_case: dict[str, str],
    seconds_of_case: dict[str, float],
) -> Saved:
    main_cases = [case for case in row_counts if main_system_of_case[case] == system_name]
    shared = [case for case in row_counts if system_name in row_counts[case]]
    return {
        "name": system_name,
        "cases": len(main_cases),
        "rows": sum(row_counts[case][system_name] for case in shared),
        "seconds": sum(seconds_of_case.get(case, 0.0) for case in main_cases),
        "stated": QUICK_SECONDS[system_name],
        "full_rows": sum(full_report_data()[case]["rows"].get(system_name, 0) for case in shared)
        if full_report_data().keys() >= set(shared)
        else None,
        "full_seconds": sum(full_report_data()[case]["seconds"] for case in main_cases)
        if full_report_data().keys() >= set(main_cases)
        else None,
    }


def _row_counts(report_rows: list[Saved]) -> dict[str, Counter[str]]:
    """Numbers of rows by system, for each case."""
    counted: dict[str, Counter[str]] = {}
    for row in report_rows:
        counted.setdefault(case_of_row(row), Counter())[row["system"]] += 1
    return counted


def save_full_report(report_folder: Path) -> None:
    """Save the number of rows and the seconds of each case of a full report in ``full_report.json``; raises InputError
    for a quick report."""
    from validation.report.page import read

    results = read(report_folder / "results.json")
    source = results["provenance"]
    if source["quick"]:
        raise InputError(report_folder / "results.json", "provenance.quick", True, "the results of a full report")
    new = {
        case: {"rows": dict(systems), "seconds": round(source["seconds"][case], 1), "commit": source["commit"]}
        for case, systems in _row_counts(results["rows"]).items()
        if case in source["seconds"]
    }
    write_whole(
        FULL_REPORT_FILE, (json.dumps(dict(sorted((full_report_data() | new).items())), indent=1) + "\n").encode()
    )


if __name__ == "__main__":
    save_full_report(Path(sys.argv[1]))
