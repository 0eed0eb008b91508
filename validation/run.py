"""Measure the cases and save what they found; the report is then written from the saved files alone."""

import csv
import json
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from models.result import provenance
from validation.rows import REPORTED, Row

CASES = ("audit", "twin", "order", "tight", "enforced_moment", "guards", "roads", "drift_paper", "point_mass",
         "inertial_unit", "hard_cases", "planted_faults", "absent", "price")  # fmt: skip
"""Case modules in the order of the report."""


def validate(folder: Path, quick: bool, command: str) -> int:
    """Measure all cases into ``folder``; returns the number of failed rows."""
    from rich.console import Console
    from rich.progress import Progress

    rows: list[Row] = []
    seconds: dict[str, float] = {}
    (folder / "data").mkdir(exist_ok=True)
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("validate", total=len(CASES))
        for name in CASES:
            bar.update(task, description=name)
            start = time.perf_counter()
            rows += _measure(name, quick, folder)
            seconds[name] = time.perf_counter() - start
            bar.advance(task)
    _save(folder, rows, {**provenance(command), "seeds": seeds(), "quick": quick, "seconds": seconds})
    from validation.report.page import write

    page = write(folder)
    return _say(rows, sum(seconds.values()), page)


def _measure(name: str, quick: bool, folder: Path) -> list[Row]:
    """Rows of one case; a case that breaks is a failed row, not the end of the report."""
    try:
        case = import_module(f"validation.cases.{name}")
        rows, data = case.measure(quick, folder)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        return [Row(f"{name}.broken", "pitch-plane", f"case {name}", None, "", "", None, "", "none", "failed", reason)]
    (folder / "data" / f"{name}.json").write_text(json.dumps(data))
    return rows


def seeds() -> dict[str, int]:
    """Every seed that the rows depend on; with them and the versions all counts and states repeat exactly."""
    from studies.six_runs import Options
    from validation import checks, timing
    from validation.cases import inertial_unit, point_mass, roads

    return {"random states": checks.SEED, "class C road": roads.SEED, "six runs": Options.model_fields["seed"].default,
            "order of timing": timing.SEED, "point mass": point_mass.SEED,
            "inertial unit": inertial_unit.SEED}  # fmt: skip


def _save(folder: Path, rows: list[Row], source: dict[str, Any]) -> None:
    """results.json and results.csv."""
    table = [row.as_dict() for row in rows]
    (folder / "results.json").write_text(json.dumps({"provenance": source, "rows": table}, indent=1))
    with (folder / "results.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(Row.__dataclass_fields__))
        writer.writeheader()
        writer.writerows(table)


def _say(rows: list[Row], seconds: float, page: Path) -> int:
    """Print the verdict and every row that did not pass."""
    failed = [row for row in rows if row.status == "failed"]
    skipped = [row for row in rows if row.status == "not run"]
    told = [row for row in rows if row.reason == REPORTED]
    passed = len(rows) - len(failed) - len(skipped) - len(told)
    print(
        f"{len(rows)} rows: {passed} passed, {len(told)} reported without being judged, {len(failed)} failed, "
        f"{len(skipped)} not run, {seconds:.0f} s"
    )
    for row in failed + skipped:
        print(f"  {row.status}: {row.id}: {row.quantity}: {row.reason}")
    print(f"report: {page}")
    return len(failed)
