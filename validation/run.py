"""Measure all validation cases and save their rows and data; the report is then written from the saved files.

Cases are an ensemble (``models.ensemble.runner``) of which path i is case i: each is kept as it ends, so that a report
that was killed goes on with the others. The blocks lie in ``cases`` of the report's folder until the report is written,
and beyond.
"""

import csv
import json
import math
import time
from collections.abc import Callable
from concurrent.futures import Executor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.core.result import provenance
from models.core.whole_files import whole_file, write_whole
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.store import ArraysByName, checksum_of_sources, exclusive_folder
from models.ensemble.workers import Crew
from validation.cases import CASES
from validation.common.changes import change_lines, comparison_with_earlier
from validation.common.rows import STATUSES, Row, Saved, failed_row, rows_on_grounds
from validation.common.scenes import data_folder
from validation.report.shares import full_report_data

SEEDED_MODULES = (
    "models.machine.timing",
    "validation.choice.drawn_scenes",
    "validation.common.checks",
    "validation.contact.contact_set",
    "validation.measured.long_recording",
    "validation.price.unseen",
    "validation.price.unseen_systems",
    "validation.ride.fitted_roads",
)
"""Modules other than the cases that have a SEED of random numbers."""
CASES_ALONE = {
    True: ("recommendation",),
    False: ("effect_prices", "price", "recommendation", "ensemble", "contact_bridges", "stated_errors"),
}
"""Cases, by ``quick``, that run after all others and alone on the machine, because they measure seconds or, in the full
report, use all processors. Processor seconds need this too: other running cases empty the caches, which raises a ratio
of the times of small steps by a quarter."""
FINISHED_CASES = "cases"
"""Name of the folder of finished cases in the report's folder."""

Outcomes = dict[str, tuple[list[Row], float]]
"""For the name of each case, its rows and its computing time (s)."""


@dataclass(frozen=True)
class Cases:
    """Ensemble job (see ``models.ensemble.runner``) that measures validation cases: path i is the case ``names[i]``,
    whose data are written to ``folder``."""

    names: tuple[str, ...]
    quick: bool
    folder: Path

    def __call__(self, paths: range) -> ArraysByName:
        """Array "record" (n,): rows and seconds of each of the n cases as JSON text."""
        return _json_array([self.record(self.names[i]) for i in paths])

    def record(self, case_name: str) -> Saved:
        """Measure one case and save its data; returns its rows and seconds. Exceptions of the case pass through."""
        start = time.perf_counter()
        case = import_module(f"validation.cases.{case_name}")
        with TemporaryDirectory(
            ignore_cleanup_errors=True
        ) as case_folder:  # what cases write to run is no part of the report
            rows, data = rows_on_grounds(case_name, partial(case.measure, self.quick, Path(case_folder)))
        write_whole(self.folder / "data" / f"{case_name}.json", json.dumps(data).encode())
        return {"rows": [row.as_dict() for row in rows], "seconds": time.perf_counter() - start}

    def facts(self) -> Saved:
        """Facts on which the rows depend: the cases, quick or full report, code version, and the available measured
        files."""
        root, validation_folder = data_folder(), Path(__file__).parent
        sizes = (
            {str(path.relative_to(root)): path.stat().st_size for path in sorted(root.rglob("*")) if path.is_file()}
            if root
            else {}
        )
        return {
            "cases": list(self.names),
            "quick": self.quick,
            "measured files": sizes,
            "code of validation": checksum_of_sources(validation_folder),
            "code of studies": checksum_of_sources(validation_folder.parent / "studies"),
        }


def _json_array(case_records: list[Saved]) -> ArraysByName:
    return {"record": np.array([json.dumps(record) for record in case_records])}


def measured_cases(
    cases_to_measure: Cases,
    executor: Executor | None,
    report_progress: Callable[[int], None],
    are_run_alone: bool = False,
) -> Outcomes:
    """Rows and computing times (s) of all cases; cases that an earlier, interrupted run finished are read, not measured
    again.

    are_run_alone : one after the other; report_progress : called with the number of finished cases. A case that raises,
    or whose process dies repeatedly, is a failed row and is measured again in the next run. Raises InputError for a
    folder of another version or share, RunFailed for a full disk.
    """

    def lost(case_numbers: range, reason: str) -> ArraysByName:
        return _json_array(
            [
                {"rows": [_row_of_failed_case(cases_to_measure.names[i], reason).as_dict()], "seconds": 0.0}
                for i in case_numbers
            ]
        )

    store, blocks = (
        cases_to_measure.folder / FINISHED_CASES / ("alone" if are_run_alone else "together"),
        PathBlocks(1, 1) if are_run_alone else PathBlocks(1),
    )
    record_texts = run_paths(
        cases_to_measure,
        len(cases_to_measure.names),
        store,
        executor,
        blocks,
        lambda progress_count: report_progress(progress_count.done),
        lost,
    )["record"]
    records = (json.loads(str(record_text)) for record_text in record_texts)
    return {
        name: ([Row(**row) for row in record["rows"]], record["seconds"])
        for name, record in zip(cases_to_measure.names, records, strict=True)
    }


def _row_of_failed_case(case_name: str, reason: str) -> Row:
    """Failed row for a case that gave no rows, with the reason."""
    return failed_row(f"{case_name}.broken", f"case {case_name}", reason)


def validate(
    output_folder: Path,
    quick: bool,
    command: str,
    earlier_report: Saved | None = None,
    is_resumed: bool = False,
    worker_crew: Crew | None = None,
) -> int:
    """Measure all validation cases, save results and report in ``output_folder``; returns the number of failed rows.

    worker_crew : measures the cases that need not be alone; its workers see the folder, too. earlier_report :
    ``changes.read`` of a report. is_resumed : the folder may hold cases that have ended; the time of them all together
    is then not known.
    """
    start, start_date = time.perf_counter(), datetime.now(UTC)
    (output_folder / "data").mkdir(exist_ok=True)
    with exclusive_folder(output_folder), (worker_crew or Crew.given()).at_work(len(CASES), output_folder) as pool:
        outcomes = _outcomes_of_cases(pool, quick, output_folder)
        rows = [row for name in CASES for row in outcomes[name][0]]
        seconds = {name: outcomes[name][1] for name in CASES}
        wall = None if is_resumed else time.perf_counter() - start
        source = {**provenance(command), "date": f"{start_date:%Y-%m-%d %H:%M} UTC", "data": _data_text()}
        save(
            output_folder,
            rows,
            {
                **source,
                "seeds": _value_from_pool(pool, seeds_of_rows),
                "quick": quick,
                "seconds": seconds,
                "wall": wall,
            },
            earlier_report,
        )
        path = _write_report(pool, output_folder)
    return print_summary(rows, time.perf_counter() - start, path)


def _data_text() -> str:
    """Text for the report on the number and size of the available measured files."""
    folder = data_folder()
    if folder is None:
        return "no measured files: TWINRIG_DATA names no folder; the rows that need some are not run"
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    return f"{len(sizes)} measured files of {sum(sizes) / 1e6:.3g} MB, in the folder that TWINRIG_DATA names"


def _outcomes_of_cases(executor: Executor | None, is_quick: bool, output_folder: Path) -> Outcomes:
    """Rows and computing time (s) of every case; cases that may run in parallel are measured first, then those that
    need the machine alone."""
    from rich.console import Console
    from rich.progress import Progress

    names_alone = CASES_ALONE[is_quick]
    together = tuple(sorted((name for name in CASES if name not in names_alone), key=_last_duration, reverse=True))
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("validate", total=len(CASES))
        resolved_folder = output_folder.resolve()
        first = measured_cases(
            Cases(together, is_quick, resolved_folder),
            executor,
            lambda progress_count: bar.update(task, completed=progress_count),
        )
        return first | measured_cases(
            Cases(names_alone, is_quick, resolved_folder),
            executor,
            lambda progress_count: bar.update(task, completed=len(together) + progress_count),
            are_run_alone=True,
        )


def _last_duration(case_name: str) -> float:
    """Computing time (s) of a case in the last full report, by which cases are ordered; infinite if unknown."""
    return float(full_report_data()[case_name]["seconds"]) if case_name in full_report_data() else math.inf


def _value_from_pool(executor: Executor | None, computed_function: Callable[..., Any], *arguments: Any) -> Any:
    """Value of computed_function(*arguments), computed in a process of the pool, or in this process if one of the pool
    has died."""
    if executor is None:
        return computed_function(*arguments)
    try:
        return executor.submit(computed_function, *arguments).result()
    except BrokenProcessPool:
        return computed_function(*arguments)


def _write_report(executor: Executor | None, output_folder: Path) -> Path:
    """Write the report's page and return its path; figures are drawn by the pool, or by this process if one of the pool
    has died."""
    from validation.report.page import write

    if executor is None:
        return write(output_folder)
    try:
        return write(output_folder.resolve(), executor.map)
    except BrokenProcessPool:
        return write(output_folder)


def seeds_of_rows() -> dict[str, int]:
    """Seeds of random numbers on which rows depend, by the name of the module; equal seeds and versions give equal
    counts and states."""
    modules = {name: import_module(name) for name in (*(f"validation.cases.{case}" for case in CASES), *SEEDED_MODULES)}
    drawn = {name.rpartition(".")[2].replace("_", " "): module for name, module in modules.items()}
    return {name: module.SEED for name, module in drawn.items() if hasattr(module, "SEED")}


def save(
    output_folder: Path, report_rows: list[Row], report_source: Saved, earlier_report: Saved | None = None
) -> None:
    """Write the rows and their provenance to results.json and results.csv, and print changes since an earlier
    report."""
    table = [row.as_dict() for row in report_rows]
    content: Saved = {"provenance": report_source, "rows": table}
    if earlier_report is not None:
        content["against"] = comparison_with_earlier(earlier_report, table, report_source)
        print("\n".join(change_lines(content["against"])))
    write_whole(output_folder / "results.json", json.dumps(content, indent=1).encode())
    with whole_file(output_folder / "results.csv") as partial_path, partial_path.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(Row.__dataclass_fields__))
        writer.writeheader()
        writer.writerows(table)


def print_summary(report_rows: list[Row], seconds: float | None, page_path: Path) -> int:
    """Print the number of rows by status, and each row that failed, missed its aim or was not run; returns the number
    of failed rows."""
    rows_of_status = {status: [row for row in report_rows if row.status == status] for status in STATUSES}
    counts = ", ".join(f"{len(rows_of_status[status])} {status}" for status in reversed(STATUSES))
    print(f"{len(report_rows)} rows: {counts}{'' if seconds is None else f'; {seconds:.0f} s'}")
    for row in (*rows_of_status["failed"], *rows_of_status["missed"], *rows_of_status["not run"]):
        print(f"  {row.status}: {row.id}: {row.quantity}: {row.reason}")
    print(f"report: {page_path}")
    return len(rows_of_status["failed"])
