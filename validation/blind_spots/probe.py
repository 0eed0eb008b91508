"""A process of an audit: runs cases and tests, and tells what of each failed or, where it traces, called what.

``python -m validation.blind_spots.probe JOB``: a JSON file with "cases" and "tests" (what pytest is given), and "out",
to which a line of JSON is added for each case and test that has ended.
"""

import json
import os
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from validation.blind_spots import planting


def label_of(name: str) -> str:
    """A case or test as the name of a file."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)[:120]


class Told:
    """Adds what ended to the file, and what it called."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.uncompiled, self.numbers, self.start = False, set[str](), 0.0
        self.order = json.loads(os.environ.get(planting.VARIABLE, "{}"))

    def begin(self, label: str) -> None:
        """A case or test begins."""
        self.start = time.perf_counter() - self.compiling()
        if planting.recorder is not None:
            planting.recorder.reset()
            os.environ[planting.VARIABLE] = json.dumps(self.order | {"label": label})

    def compiling(self) -> float:
        """Seconds that numba took so far, where this process traces; they are not told again."""
        return 0.0 if planting.recorder is None else float(planting.recorder.compiling)

    def end(self, line: dict[str, Any]) -> None:
        """A case or test has ended."""
        if planting.recorder is not None:
            new = planting.recorder.numbers - self.numbers
            self.numbers |= new
            line |= {"names": sorted(planting.recorder.names), "numbers": sorted(new)}
        line |= {"seconds": time.perf_counter() - self.compiling() - self.start}
        line |= {"uncompiled": self.uncompiled}
        with self.out.open("a") as file:
            file.write(json.dumps(line) + "\n")


def run_case(name: str, told: Told) -> None:
    """Measure the quick share of a case; a case that breaks has one row, which failed."""
    from importlib import import_module

    from validation.common.rows import rested

    told.begin(label_of(name))
    try:
        case = import_module(f"validation.cases.{name}")
        with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            rows, _ = rested(name, lambda: case.measure(True, Path(folder)))
        lines = [{"id": row.id, "status": row.status, "independence": row.independence} for row in rows]
    except Exception as error:
        lines = [{"id": f"{name}.broken", "status": "failed", "independence": "none"}]
        told.uncompiled |= is_of_numba(error)
    told.end({"case": name, "rows": lines})


def is_of_numba(error: BaseException) -> bool:
    """Whether numba refuses a function: the fault is then the audit's, and no row has noticed anything."""
    return type(error).__module__.startswith("numba.")


class Watching:
    """Plug-in of pytest: tells how each test ended."""

    def __init__(self, told: Told) -> None:
        self.told, self.failed = told, False

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """A test begins."""
        self.failed = False
        self.told.begin(label_of(nodeid))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """A part of a test has ended."""
        self.failed |= report.failed
        if report.when == "teardown":
            marked = dict(report.user_properties).get("grounds", "")
            self.told.end({"test": report.nodeid, "failed": self.failed, "grounds": marked})

    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo) -> None:
        """Note that numba refused a function."""
        if call.excinfo is not None:
            self.told.uncompiled |= is_of_numba(call.excinfo.value)

    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Note what grounds a test names."""
        marker = item.get_closest_marker("grounds")
        if marker:
            item.user_properties.append(("grounds", marker.args[0]))


def main(job: dict[str, Any]) -> None:
    """Cases first, and then tests."""
    told = Told(Path(job["out"]))
    for name in job["cases"]:
        run_case(name, told)
    if job["tests"]:
        pytest.main(["-q", "-p", "no:cacheprovider", "--tb=no", *job["tests"]], plugins=[Watching(told)])


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text()))
