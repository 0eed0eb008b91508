"""Cases measured by processes of this machine, each kept as it ends: a report that was killed goes on with the others.

Cases are an ensemble (``models.ensemble.runner``) of which path i is case i. Its blocks lie in ``cases`` of the
report's folder until the report is written, and beyond.
"""

import json
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.core.whole_files import write_whole
from models.ensemble.runner import AHEAD, run_paths
from models.ensemble.store import Arrays, code
from validation.common.rows import Row
from validation.common.scenes import data_folder

KEPT = "cases"
"""Folder of finished cases."""

Outcomes = dict[str, tuple[list[Row], float]]
"""Rows and seconds of cases by their names."""


@dataclass(frozen=True)
class Cases:
    """Job (see ``models.ensemble.runner``): path i is the case ``names[i]``, whose data go into ``folder``."""

    names: tuple[str, ...]
    quick: bool
    folder: Path

    def __call__(self, paths: range) -> Arrays:
        """``record`` (n,): rows and seconds of each case as JSON."""
        return _array([self.record(self.names[i]) for i in paths])

    def record(self, name: str) -> dict[str, Any]:
        """Measure one case; raises what the case raises."""
        start = time.perf_counter()
        case = import_module(f"validation.cases.{name}")
        with TemporaryDirectory(ignore_cleanup_errors=True) as own:  # what cases write to run is no part of the report
            rows, data = case.measure(self.quick, Path(own))
        write_whole(self.folder / "data" / f"{name}.json", json.dumps(data).encode())
        return {"rows": [row.as_dict() for row in rows], "seconds": time.perf_counter() - start}

    def facts(self) -> dict[str, Any]:
        """The share, the code, and which measured files there are, without which rows are not run."""
        root, own = data_folder(), Path(__file__).parents[1]
        sizes = (
            {str(path.relative_to(root)): path.stat().st_size for path in sorted(root.rglob("*")) if path.is_file()}
            if root
            else {}
        )
        return {
            "cases": list(self.names),
            "quick": self.quick,
            "measured files": sizes,
            "code of validation": code(own),
            "code of studies": code(own.parent / "studies"),
        }


def _array(records: list[dict[str, Any]]) -> Arrays:
    return {"record": np.array([json.dumps(record) for record in records])}


def measured(job: Cases, pool: Executor, progress: Callable[[int], None], alone: bool = False) -> Outcomes:
    """Rows and seconds of all cases; those that an earlier go has finished are taken from there.

    alone : one after the other; progress : told how many are done. A case that breaks, or whose process dies
    again and again, is a failed row and is measured again by the next go. Raises InputError for a folder of another
    version or share, RunFailed for a full disk.
    """

    def lost(cases: range, reason: str) -> Arrays:
        return _array([{"rows": [_broken(job.names[i], reason).as_dict()], "seconds": 0.0} for i in cases])

    store, ahead = job.folder / KEPT / ("alone" if alone else "together"), 1 if alone else AHEAD
    found = run_paths(job, len(job.names), store, pool, 1, lambda done: progress(done.done), lost, ahead)["record"]
    records = (json.loads(str(one)) for one in found)
    return {
        name: ([Row(**row) for row in record["rows"]], record["seconds"])
        for name, record in zip(job.names, records, strict=True)
    }


def _broken(name: str, reason: str) -> Row:
    """The failed row of a case that gave none."""
    return Row(f"{name}.broken", "pitch-plane", f"case {name}", None, "", "", None, "", "none", "failed", reason)
