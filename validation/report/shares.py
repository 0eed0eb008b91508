"""The share of a quick report in the full one, by system: rows and seconds.

``python -m validation.report.shares FOLDER`` keeps what a full report had of each case in ``full_report.json``; quick
ones tell it beside what they ran, and cases that took long are begun first.
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

KEPT_REPORT = Path(__file__).with_name("full_report.json")
QUICK_SHARES = {
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
"""Seconds of two cores that each system may take of the quick report's minute, once kernels are compiled."""
DRAWING_SECONDS = 20
"""Seconds of the minute that are left for starting and drawing."""
assert set(QUICK_SHARES) == set(get_args(System)) and sum(QUICK_SHARES.values()) + DRAWING_SECONDS == 120


@cache
def full_report_data() -> dict[str, Saved]:
    """Data of each case in the last full report: number of rows by system, seconds, and commit."""
    kept: dict[str, Saved] = json.loads(KEPT_REPORT.read_text(encoding="utf-8"))
    return kept


def case_of(row: Saved) -> str:
    """Name of the case of a row: the row's id begins with it, or with a word that stands for it."""
    first = row["id"].partition(".")[0]
    return first if first in CASES else next((case for case in CASES if first in case.split("_")), first)


def shares_of_systems(results: Saved) -> list[Saved]:
    """For each system, the numbers of cases and rows that were measured, those of a full report, and the stated
    computing times.

    A case counts to the system of most of its rows. What is not known of some case of a system is None.
    """
    counted = _row_counts(results["rows"])
    main = {case: systems.most_common(1)[0][0] for case, systems in counted.items()}
    return [
        _line(system, counted, main, results["provenance"]["seconds"])
        for system in QUICK_SHARES
        if any(system in systems for systems in counted.values())
    ]


def _line(system: str, counted: dict[str, Counter[str]], main: dict[str, str], seconds: dict[str, float]) -> Saved:
    main_cases = [case for case in counted if main[case] == system]
    shared = [case for case in counted if system in counted[case]]
    return {
        "name": system,
        "cases": len(main_cases),
        "rows": sum(counted[case][system] for case in shared),
        "seconds": sum(seconds.get(case, 0.0) for case in main_cases),
        "stated": QUICK_SHARES[system],
        "full_rows": sum(full_report_data()[case]["rows"].get(system, 0) for case in shared)
        if full_report_data().keys() >= set(shared)
        else None,
        "full_seconds": sum(full_report_data()[case]["seconds"] for case in main_cases)
        if full_report_data().keys() >= set(main_cases)
        else None,
    }


def _row_counts(rows: list[Saved]) -> dict[str, Counter[str]]:
    """Number of rows for each case, by system."""
    counted: dict[str, Counter[str]] = {}
    for row in rows:
        counted.setdefault(case_of(row), Counter())[row["system"]] += 1
    return counted


def keep(folder: Path) -> None:
    """Save the number of rows and the seconds of each case of a full report; raises InputError for a quick report."""
    from validation.report.page import read

    results = read(folder / "results.json")
    source = results["provenance"]
    if source["quick"]:
        raise InputError(folder / "results.json", "provenance.quick", True, "the results of a full report")
    new = {
        case: {"rows": dict(systems), "seconds": round(source["seconds"][case], 1), "commit": source["commit"]}
        for case, systems in _row_counts(results["rows"]).items()
        if case in source["seconds"]
    }
    write_whole(KEPT_REPORT, (json.dumps(dict(sorted((full_report_data() | new).items())), indent=1) + "\n").encode())


if __name__ == "__main__":
    keep(Path(sys.argv[1]))
