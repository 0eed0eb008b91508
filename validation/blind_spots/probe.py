"""Worker process of an audit: runs cases, tests and scenes, and logs what failed and which functions ran.

It reads jobs from its standard input and imports the cases that they name, and the modules that the named tests and
runs import, each once, without a fault. For each job it forks, so that no earlier fault remains, and prints how the
fork ended. A job is a line of JSON: "cases", "tests" (pytest's arguments) and "runs" (``sides.Run``); "out", a log file
to which a line of JSON is added for each case, test or run that has ended; "faults" by the number of the function;
"sound", ids that fail without a fault; "patience", processor time (s) after which the fork is stopped; and "budgets",
processor times (s) after which no other check begins: where an independent check has noticed the fault, and where none
has.
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


class CompilationTimer(event.Listener):
    """Timer that sums up the processor time (s) of numba's compilations."""

    def __init__(self) -> None:
        self.seconds, self.depth, self.start = 0.0, 0, 0.0

    def on_start(self, event: Any) -> None:
        """Called when numba starts a compilation, perhaps within another compilation; starts the timer."""
        self.start = processor_time() if self.depth == 0 else self.start
        self.depth += 1

    def on_end(self, event: Any) -> None:
        """Called when numba has finished a compilation; stops the timer after the outermost compilation."""
        self.depth -= 1
        self.seconds += processor_time() - self.start if self.depth == 0 else 0.0


class JobLog:
    """Log of a job: writes to a file how each case or test ended, which functions it ran, and its processor time
    without compilation."""

    def __init__(self, job_table: dict[str, Any]) -> None:
        self.out, self.failing_already, self.budgets = (
            Path(job_table["out"]),
            set(job_table["sound"]),
            job_table["budgets"],
        )
        self.refused, self.is_noticed, self.start = False, False, 0.0
        self.compilation_timer = CompilationTimer()
        event.register("numba:compiler_lock", self.compilation_timer)
        self.job_start = self.clock()

    def clock(self) -> float:
        """Processor time (s) of this process until now, without numba's compilations."""
        return processor_time() - self.compilation_timer.seconds

    def budget_is_used(self) -> bool:
        """Whether the job has used up its budget of processor time."""
        return self.clock() - self.job_start > self.budgets[0 if self.is_noticed else 1]

    def begin(self) -> None:
        """Start the log of a case or test."""
        self.start, self.refused = self.clock(), False
        memory.clear_marks()

    def end(self, log_line: dict[str, Any], failed_checks: list[tuple[str, str]]) -> None:
        """Write the log line of a case or test that has ended. failed_checks: ids and grounds of its failed rows or
        tests."""
        self.is_noticed |= any(
            id not in self.failing_already and is_independent(id, grounds) for id, grounds in failed_checks
        )
        log_line |= {
            "ran": memory.nonzero_functions(memory.FUNCTIONS_THAT_RAN),
            "numbers": memory.nonzero_functions(memory.FUNCTIONS_WITH_NUMBERS),
        }
        log_line |= {"seconds": self.clock() - self.start, "refused": self.refused}
        with self.out.open("a") as file:
            file.write(json.dumps(log_line) + "\n")


def run_case(case_name: str, job_log: JobLog) -> None:
    """Run the quick rows of a validation case and log them; a case that raises an error counts as a failed row."""
    from validation.common.rows import rows_on_grounds

    job_log.begin()
    try:
        case = import_module(f"validation.cases.{case_name}")
        with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            rows, _ = rows_on_grounds(case_name, lambda: case.measure(True, Path(folder)))
        lines: list[dict[str, str]] = [
            {"id": row.id, "status": row.status, "independence": row.independence} for row in rows
        ]
    except Exception as error:
        lines = [{"id": f"{case_name}.broken", "status": "failed", "independence": "none"}]
        job_log.refused |= is_numba_error(error)
    failed = [(line["id"], line["independence"]) for line in lines if line["status"] == "failed"]
    job_log.end({"case": case_name, "rows": lines}, failed)


def run_scene(scene_path: str, engine: str, job_log: JobLog) -> None:
    """Run a scene in an engine and log the functions that it called; a refused or failed run is not logged."""
    from models.systems import run

    read = prepared_scene(scene_path)
    job_log.begin()
    with suppress(Exception):
        run(read, engine)
        job_log.end({"run": [scene_path, engine]}, [])


def is_numba_error(exception: BaseException) -> bool:
    """Whether an error is numba's refusal to compile a function. The rewriting then caused the failure, and no check
    has noticed the fault."""
    return type(exception).__module__.startswith("numba.")


class TestLogger:
    """Plug-in for pytest that writes to a job's log how each test ended."""

    def __init__(self, job_log: JobLog) -> None:
        self.log, self.failed = job_log, False
        self.session: pytest.Session | None = None

    def pytest_sessionstart(self, session: pytest.Session) -> None:
        """Store pytest's session, which is stopped when the job's budget is used up."""
        self.session = session

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Start the log of a test."""
        self.failed = False
        self.log.begin()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record whether the set-up, call or tear-down of a test failed, and log the test after its tear-down."""
        self.failed |= report.failed
        if report.when == "teardown":
            marked = str(dict(report.user_properties).get("grounds", ""))
            line = {"test": report.nodeid, "failed": self.failed, "grounds": marked}
            self.log.end(line, [(report.nodeid, marked)] if self.failed else [])
            if self.session is not None and self.log.budget_is_used():
                self.session.shouldstop = "the budget is used"

    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo) -> None:
        """Record whether a test failed because numba refused to compile a function."""
        if call.excinfo is not None:
            self.log.refused |= is_numba_error(call.excinfo.value)

    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Record the independent grounds that a test states by its mark ``grounds``."""
        marker = item.get_closest_marker("grounds")
        if marker:
            item.user_properties.append(("grounds", marker.args[0]))


def run_job(job_table: dict[str, Any]) -> None:
    """Plant the faults of a job, then run its scenes, its tests, and its cases as long as its budget lasts."""
    signal.setitimer(signal.ITIMER_PROF, job_table["patience"])
    for number, fault in job_table["faults"].items():
        memory.FAULTS[int(number)] = fault
    log = JobLog(job_table)
    for scene, engine in job_table["runs"]:
        run_scene(scene, engine, log)
    if job_table["tests"]:
        pytest.main(["-q", "-p", "no:cacheprovider", "--tb=no", *job_table["tests"]], plugins=[TestLogger(log)])
    for name in job_table["cases"]:
        if not log.budget_is_used():
            run_case(name, log)


def modules_of_tests(test_files: list[str]) -> list[str]:
    """Modules of the project that test files import; the tests are given as pytest's arguments."""
    files = dict.fromkeys(test.partition("::")[0] for test in test_files)
    return list(
        dict.fromkeys(name for file in files for name in IMPORT_PATTERN.findall((ROOT / file).read_text("utf-8")))
    )


def modules_of_runs(scene_runs: list[Run]) -> list[str]:
    """Modules to import before scenes are run: those of all systems and engines; none if the job runs no scene."""
    return (
        sorted(name for name in all_modules() if name.startswith(("models.systems.", "models.engines.")))
        if scene_runs
        else []
    )


def run_in_fork(job_table: dict[str, Any]) -> str:
    """Run a job in a forked process. Returns how the process ended: "whole", "out of time" or "crashed"."""
    memory.clear(memory.FAULTS)
    named = [f"validation.cases.{name}" for name in job_table["cases"]]
    for module in [*named, *modules_of_tests(job_table["tests"]), *modules_of_runs(job_table["runs"])]:
        with suppress(Exception):  # a module that breaks as it is imported breaks again where its case or test is run
            import_module(module)
    child = os.fork()
    if child == 0:
        with suppress(BaseException):
            run_job(job_table)
            os._exit(0)
        os._exit(1)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return {0: "whole", -signal.SIGPROF: "out of time"}.get(status, "crashed")


def main() -> None:
    """Run jobs, read from standard input, one after the other, and print how each ended; output of the jobs is
    discarded."""
    answers = os.fdopen(os.dup(1), "w")
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    for line in sys.stdin:
        print(run_in_fork(json.loads(line)), file=answers, flush=True)


if __name__ == "__main__":
    main()
