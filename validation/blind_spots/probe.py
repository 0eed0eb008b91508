"""A process of an audit: runs cases, tests and scenes, and tells what of each failed and which functions it ran.

It reads jobs from its standard input and imports the cases that they name, and what the named tests and runs import,
each once, without a fault. For each job it starts a fork of itself, in which nothing is left of an earlier fault, and
answers how that has ended. A job is a line of JSON: "cases", "tests" (what pytest is given) and "runs"
(``sides.Run``); "out", a file to which a line of JSON is added for each of them that has ended; "faults", by the place
of the function; "sound", ids that fail without a fault; "patience", seconds of the processor after which the fork is
stopped; and "budgets", seconds of the processor after which nothing more begins: if something independent has noticed,
and if not.
"""

import json
import os
import re
import signal
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from numba.core import event

from validation.blind_spots import memory
from validation.blind_spots.rewriting import ROOT
from validation.blind_spots.shared import all_modules
from validation.blind_spots.sides import Run, prepared_scene
from validation.blind_spots.table import is_independent

IMPORT_PATTERN = re.compile(r"^(?:from|import) ((?:models|validation|studies)[.\w]*)", re.MULTILINE)


def processor_time() -> float:
    """Processor time (s) of this process and of its ended child processes."""
    return sum(os.times()[:4])


class Compiling(event.Listener):
    """Timer of the processor time (s) that numba's compilation takes."""

    def __init__(self) -> None:
        self.seconds, self.depth, self.start = 0.0, 0, 0.0

    def on_start(self, event: Any) -> None:
        """numba starts to compile, perhaps within another compilation."""
        self.start = processor_time() if self.depth == 0 else self.start
        self.depth += 1

    def on_end(self, event: Any) -> None:
        """numba has finished a compilation."""
        self.depth -= 1
        self.seconds += processor_time() - self.start if self.depth == 0 else 0.0


class Told:
    """Log of a job: writes to its file how each case or test ended, the functions that it ran, and its time without
    compilation."""

    def __init__(self, job: dict[str, Any]) -> None:
        self.out, self.sound, self.budgets = Path(job["out"]), set(job["sound"]), job["budgets"]
        self.refused, self.noticed, self.start = False, False, 0.0
        self.compiling = Compiling()
        event.register("numba:compiler_lock", self.compiling)
        self.first = self.clock()

    def clock(self) -> float:
        """Processor time (s) so far without numba's compilations."""
        return processor_time() - self.compiling.seconds

    def is_enough(self) -> bool:
        """Whether the job has used up its budget of processor time."""
        return self.clock() - self.first > self.budgets[0 if self.noticed else 1]

    def begin(self) -> None:
        """Record that a case or test begins."""
        self.start, self.refused = self.clock(), False
        memory.forget()

    def end(self, line: dict[str, Any], failed: list[tuple[str, str]]) -> None:
        """Record that a case or test has ended; failed: ids and grounds of what failed."""
        self.noticed |= any(id not in self.sound and is_independent(id, grounds) for id, grounds in failed)
        line |= {
            "ran": memory.nonzero_functions(memory.FUNCTIONS_THAT_RAN),
            "numbers": memory.nonzero_functions(memory.FUNCTIONS_WITH_NUMBERS),
        }
        line |= {"seconds": self.clock() - self.start, "refused": self.refused}
        with self.out.open("a") as file:
            file.write(json.dumps(line) + "\n")


def run_case(name: str, log: Told) -> None:
    """Run the quick share of a case and log it; a case that raises an error counts as one failed row."""
    from validation.common.rows import rows_on_grounds

    log.begin()
    try:
        case = import_module(f"validation.cases.{name}")
        with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            rows, _ = rows_on_grounds(name, lambda: case.measure(True, Path(folder)))
        lines: list[dict[str, str]] = [
            {"id": row.id, "status": row.status, "independence": row.independence} for row in rows
        ]
    except Exception as error:
        lines = [{"id": f"{name}.broken", "status": "failed", "independence": "none"}]
        log.refused |= is_of_numba(error)
    failed = [(line["id"], line["independence"]) for line in lines if line["status"] == "failed"]
    log.end({"case": name, "rows": lines}, failed)


def run_scene(scene: str, engine: str, log: Told) -> None:
    """Run a scene in an engine and log it; functions of a refused or failed run do not count as shared."""
    from models.systems import run

    read = prepared_scene(scene)
    log.begin()
    with suppress(Exception):
        run(read, engine)
        log.end({"run": [scene, engine]}, [])


def is_of_numba(error: BaseException) -> bool:
    """Whether the error is numba's refusal to compile a function. The planted fault then caused it, and no row has
    noticed anything."""
    return type(error).__module__.startswith("numba.")


class Watching:
    """Plug-in for pytest that logs how each test ended."""

    def __init__(self, log: Told) -> None:
        self.told, self.failed = log, False
        self.session: pytest.Session | None = None

    def pytest_sessionstart(self, session: pytest.Session) -> None:
        """Keep pytest's session, which is stopped when the budget is used up."""
        self.session = session

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """A test begins."""
        self.failed = False
        self.told.begin()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record whether the set-up, call or tear-down of a test failed."""
        self.failed |= report.failed
        if report.when == "teardown":
            marked = str(dict(report.user_properties).get("grounds", ""))
            line = {"test": report.nodeid, "failed": self.failed, "grounds": marked}
            self.told.end(line, [(report.nodeid, marked)] if self.failed else [])
            if self.session is not None and self.told.is_enough():
                self.session.shouldstop = "the budget is used"

    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo) -> None:
        """Note that numba refused a function."""
        if call.excinfo is not None:
            self.told.refused |= is_of_numba(call.excinfo.value)

    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Record the independent grounds that a test names."""
        marker = item.get_closest_marker("grounds")
        if marker:
            item.user_properties.append(("grounds", marker.args[0]))


def work(job: dict[str, Any]) -> None:
    """Plant the faults of a job, then run its scenes or its tests, and then its cases as long as its budget lasts.
    Scene runs form jobs of their own."""
    signal.setitimer(signal.ITIMER_PROF, job["patience"])
    for place, fault in job["faults"].items():
        memory.FAULTS[int(place)] = fault
    told = Told(job)
    for scene, engine in job["runs"]:
        run_scene(scene, engine, told)
    if job["tests"]:
        pytest.main(["-q", "-p", "no:cacheprovider", "--tb=no", *job["tests"]], plugins=[Watching(told)])
    for name in job["cases"]:
        if not told.is_enough():
            run_case(name, told)


def imported_by(tests: list[str]) -> list[str]:
    """Modules that test files import at their top level; the tests are given as pytest's arguments."""
    files = dict.fromkeys(test.partition("::")[0] for test in tests)
    return list(
        dict.fromkeys(name for file in files for name in IMPORT_PATTERN.findall((ROOT / file).read_text("utf-8")))
    )


def imported_by_runs(runs: list[Run]) -> list[str]:
    """Modules to import before scenes are run: all systems and engines; none if the job has no runs."""
    return (
        sorted(name for name in all_modules() if name.startswith(("models.systems.", "models.engines.")))
        if runs
        else []
    )


def run_in_fork(job: dict[str, Any]) -> str:
    """Run a job in a forked process; returns how it ended, in the words of ``Line.run_in_fork``."""
    memory.clear(memory.FAULTS)
    named = [f"validation.cases.{name}" for name in job["cases"]]
    for module in [*named, *imported_by(job["tests"]), *imported_by_runs(job["runs"])]:
        with suppress(Exception):  # a module that breaks as it is imported breaks again where its case or test is run
            import_module(module)
    child = os.fork()
    if child == 0:
        with suppress(BaseException):
            work(job)
            os._exit(0)
        os._exit(1)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return {0: "whole", -signal.SIGPROF: "out of time"}.get(status, "crashed")


def main() -> None:
    """Run one job after the other until there are no more; their printed output is discarded."""
    answers = os.fdopen(os.dup(1), "w")
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    for line in sys.stdin:
        print(run_in_fork(json.loads(line)), file=answers, flush=True)


if __name__ == "__main__":
    main()
