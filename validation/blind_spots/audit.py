"""Audit for blind spots: runs scenes, cases and tests once, then plants a 1 % fault in each shared function in turn, in
a forked process, and runs again the cases and tests that call the function.

All processes run the same rewritten modules (``planting``), whose machine code is kept in the audit's folder: ready
after the first run, whichever function is spoiled. First judge the cases with independent rows and the tests on
independent grounds; all others are asked only about functions that no judge has noticed. A stopped audit goes on from
its folder: ``functions.json`` with the names of all functions, ``trace`` with what scenes, cases and tests ran,
``judges.csv`` and ``others.csv`` with a line for each function that is done, and ``blind_spots.csv``, the table made of
both.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from importlib import import_module
from pathlib import Path
from queue import Queue
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from models.core.errors import InputError
from models.core.result import provenance
from models.core.whole_files import write_whole
from validation.blind_spots import memory
from validation.blind_spots.rewriting import ROOT, can_be_spoiled
from validation.blind_spots.shared import candidate_functions, compiled_functions, shared_functions
from validation.blind_spots.sides import Run, engines_of_functions, runs_to_trace
from validation.blind_spots.table import (
    LIST_SEPARATOR,
    NOT_AUDITED,
    Line,
    is_independent,
    kind_of,
    read_table,
    uncovered_functions,
    write_table,
)
from validation.cases import CASES

STARTUP_SCRIPT = Path(__file__).with_name("startup")
TRACE, FUNCTIONS, TABLE = "trace", "functions.json", "blind_spots.csv"
JUDGES_FILE, OTHERS_FILE = "judges.csv", "others.csv"
SYSTEMS_WITHOUT_VALUES = ("cost", "effects")
"""Systems whose cases judge computing effort and choices; a wrong value is noticed by the cases of other systems."""
LAW_FOLDERS = ("tyre", "contact", "rail", "brake", "road", "sensors", "multibody", "vehicles", "ride")
"""Folders of ``models`` that are audited first: the laws of physics and the tables of their parameters."""
WORKER_COUNT = 2
SECONDS_BUDGETS = (8.0, 40.0)
"""Processor time (s), without compilation, after which no other case or test is run on a function's fault: where an
independent check has noticed the fault, and where none has."""
FAULT_SIZE = 0.01
LONGEST_SOUND_CASE = 1200
"""Processor time (s) after which a run of a case or test without a fault is stopped."""
LONGEST_FAULTY_CASE = 120
"""Processor time (s) after which a run of a case or test with a fault is stopped."""
LogLine = dict[str, Any]
NoticingChecks = tuple[str, str, str]
"""Ids of the rows, the tests and the independent checks among them that notice a fault."""
Progress = Callable[[str, float], None]


class Job(NamedTuple):
    """A job for a worker process: cases and tests to run, or scenes to run in engines."""

    cases: list[str]
    tests: list[str]
    runs: Sequence[Run] = ()

    @property
    def name(self) -> str:
        """Name of the job: its first case, test file, or run."""
        return (*self.cases, *self.tests, *(f"{scene} in {engine}" for scene, engine in self.runs))[0]

    @property
    def trace_file(self) -> str:
        """Name of the file for this job's trace."""
        return self.name.rpartition("/")[2].replace(".py", "").replace(".toml", "").replace(" ", "_") + ".jsonl"


@dataclass(frozen=True)
class FaultFreeTrace:
    """Record of all cases and tests that ran without a planted fault: name -> functions that it ran, its time, and how
    it ended.

    functions : names of all functions, by number; checks : cases and tests; the entry "numbers" contains the functions
    that gave numbers.
    """

    functions: list[str]
    checks: dict[str, LogLine]

    @cached_property
    def numbers(self) -> set[str]:
        """Functions that returned or wrote a number in any case or test."""
        return {name for item in self.checks.values() for name in item["numbers"]}

    def callers(self, function_name: str, by_judges: bool) -> list[str]:
        """Names of the judges (cases and tests with independent grounds), or of all other cases and tests, in which a
        function gave numbers; the quickest first."""
        names = (name for name, item in self.checks.items() if function_name in item["numbers"])
        return sorted(
            (name for name in names if self.is_judge(name) == by_judges), key=lambda name: self.checks[name]["seconds"]
        )

    def is_judge(self, check_name: str) -> bool:
        """Whether a case or test judges by independent grounds, such as a closed form or a published value."""
        item = self.checks[check_name]
        rows = item.get("rows", [{"id": check_name, "independence": item.get("grounds", "")}])
        return any(is_independent(row["id"], row["independence"]) for row in rows)

    @cached_property
    def failing_already(self) -> frozenset[str]:
        """Ids of rows and tests that fail already without a planted fault."""
        rows = (row["id"] for item in self.checks.values() for row in item.get("rows", ()) if row["status"] == "failed")
        return frozenset((*rows, *(name for name, item in self.checks.items() if item.get("failed"))))


class WorkerPool:
    """Pool of worker processes that run jobs (``validation.blind_spots.probe``). Their compiled code is saved in
    ``folder``."""

    def __init__(self, code_folder: Path, worker_count: int = WORKER_COUNT) -> None:
        self.workers = min(worker_count, os.cpu_count() or 1)
        self.folder, self.idle = code_folder, Queue[subprocess.Popen[str]]()
        self._memory_folder = TemporaryDirectory()
        command = [sys.executable, "-m", "validation.blind_spots.probe"]
        for worker in range(self.workers):
            doubles = Path(self._memory_folder.name) / f"memory{worker}"
            variables, pipe = worker_environment(code_folder, doubles), subprocess.PIPE
            self.idle.put(subprocess.Popen(command, cwd=ROOT, env=variables, stdin=pipe, stdout=pipe, text=True))

    def __enter__(self) -> "WorkerPool":
        return self

    def __exit__(self, *exception_details: object) -> None:
        """End the worker processes, which are all idle unless an error occurred."""
        while not self.idle.empty():
            self.idle.get().communicate()
        self._memory_folder.cleanup()

    def map(self, work_on_item: Callable[[Any], Any], work_items: Iterable[Any]) -> Iterator[Any]:
        """Apply ``work_on_item`` to each item in as many threads as there are worker processes; yields the results in
        the order in which they are ready."""
        with ThreadPoolExecutor(self.workers) as pool:
            for future in as_completed([pool.submit(work_on_item, item) for item in work_items]):
                yield future.result()

    def run(self, job: Job, log_path: Path, faults: dict[int, float], failing_already: Collection[str]) -> str:
        """Run the cases and tests of a job in a worker process, with ``faults`` planted (number of the function ->
        relative error). Returns "whole", "out of time" or "crashed"."""
        log_path.write_text("")
        told: LogLine = {**job._asdict(), "out": str(log_path), "faults": faults, "sound": sorted(failing_already)}
        told |= (
            {"patience": LONGEST_FAULTY_CASE, "budgets": SECONDS_BUDGETS}
            if faults
            else {"patience": LONGEST_SOUND_CASE, "budgets": [LONGEST_SOUND_CASE] * 2}
        )
        probe = self.idle.get()
        assert probe.stdin and probe.stdout
        probe.stdin.write(json.dumps(told) + "\n")
        probe.stdin.flush()
        ended = probe.stdout.readline().strip()
        self.idle.put(probe)
        return ended or "crashed"


@dataclass(frozen=True)
class FaultChecks:
    """Checks that are run on functions with planted faults: either the judges (cases and tests with independent
    grounds), or all other cases and tests.

    engines : name of a Python function -> engines that share it.
    """

    pool: WorkerPool
    fault_free_trace: FaultFreeTrace
    by_judges: bool
    engines: Mapping[str, tuple[str, ...]]

    def audited_line(self, function_name: str) -> Line:
        """Plant a fault in a function, run the checks in which it gives numbers, and return the table line with the
        checks that notice the fault."""
        traced, sound = self.fault_free_trace, self.fault_free_trace.failing_already
        callers, ended = traced.callers(function_name, self.by_judges), unspoiled_reason(function_name, traced)
        if ended or not callers:
            return self.line(function_name, ended or "whole", len(callers), len(callers))
        job = Job([name for name in callers if name in CASES], [name for name in callers if name not in CASES])
        with TemporaryDirectory() as folder:
            log_file = Path(folder) / "log.jsonl"
            ended = self.pool.run(job, log_file, {traced.functions.index(function_name): FAULT_SIZE}, sound)
            told = logged_lines(log_file)
        rows, tests = (
            [each for each in failed_checks(told) if each[0] not in sound]
            for failed_checks in (_failed_rows, _failed_tests)
        )
        independent = [id for id, grounds in (*rows, *tests) if is_independent(id, grounds)]
        ids = ({id for id, _ in rows}, {id for id, _ in tests}, {*independent})
        noticed, failed, grounded = (LIST_SEPARATOR.join(sorted(each)) for each in ids)
        left = len(callers) - len(told)
        return self.line(function_name, ended, len(callers), left, (noticed, failed, grounded))

    def line(
        self, function: str, ended: str, calling: int = 0, not_run: int = 0, noticing: NoticingChecks = ("", "", "")
    ) -> Line:
        """Table line of a function at the present commit. noticing: ids of the rows, tests and independent
        checks that notice its fault; calling, not_run: numbers of checks."""
        commit = str(provenance("")["commit"])
        return Line(function, ended, calling, not_run, *noticing, commit, kind_of(function, self.engines))


def audit(folder: Path, on_progress: Progress) -> list[Line]:
    """Audit all shared functions and return a table line for each. Functions that ``folder`` already has lines
    for are not audited again.

    Raises InputError where the folder belongs to other functions than the sources have now.
    """
    functions = save_functions(folder)
    with WorkerPool(folder) as probes:
        engines = engines_by_function(probes, functions, on_progress)
        traced = trace(probes, functions, jobs(grounded_only=True), on_progress)
        shared = audit_order(shared_functions(engines))
        lines = audited_lines(folder / JUDGES_FILE, shared, FaultChecks(probes, traced, True, engines), on_progress)
        write_table(lines.values(), folder / TABLE)
        traced = trace(probes, functions, jobs(grounded_only=False), on_progress)
        doubtful = [name for name in shared if not lines[name].is_covered]
        more = audited_lines(folder / OTHERS_FILE, doubtful, FaultChecks(probes, traced, False, engines), on_progress)
    whole = [lines[name].joined_with(more[name]) for name in doubtful]
    whole += [line for name, line in lines.items() if name not in doubtful]
    write_table(whole, folder / TABLE)
    return whole


def audit_of(
    pattern: str, folder: Path, on_progress: Progress, check_pattern: str = "*", workers: int = WORKER_COUNT
) -> list[Line]:
    """Audit the shared functions whose ``module:name`` matches a pattern, by judges (checks with independent grounds)
    alone; returns their table lines.

    check_pattern : pattern for the names of the cases and test files to run; fewer make the trace shorter. Raises
    InputError where no function or no judge matches, or as ``audit`` does.
    """
    functions = save_functions(folder, pattern)
    asked = [job for job in jobs(grounded_only=True) if fnmatchcase(job.name, check_pattern)]
    if not asked:
        allowed = "no case, and no test file that names independent grounds, is called so"
        raise InputError("", "check_pattern", check_pattern, allowed)
    with WorkerPool(folder, workers) as probes:
        engines = engines_by_function(probes, functions, on_progress)
        traced = trace(probes, functions, asked, on_progress)
        run = [name for name in shared_functions(engines) if check_pattern == "*" or traced.callers(name, True)]
        wanted = [name for name in audit_order(run) if name in functions]
        lines = audited_lines(folder / TABLE, wanted, FaultChecks(probes, traced, True, engines), on_progress)
    return list(lines.values())


def audited_lines(csv_file: Path, functions: list[str], checks: FaultChecks, on_progress: Progress) -> dict[str, Line]:
    """Function -> table line: read from the file where it has the line, else audited now and added to the file.

    The file has a line for each function from the start; functions not yet audited are marked so.
    """
    lines = {name: checks.line(name, NOT_AUDITED) for name in functions}
    lines |= {line.function: line for line in read_table(csv_file)}
    left = [name for name, line in lines.items() if line.ended == NOT_AUDITED]
    write_table(lines.values(), csv_file)
    for done, line in enumerate(checks.pool.map(checks.audited_line, left), len(lines) - len(left) + 1):
        lines[line.function] = line
        write_table(lines.values(), csv_file)
        on_progress(line.function, done / len(lines))
    return lines


def audit_order(functions: list[str]) -> list[str]:
    """Functions in audit order: compiled functions before Python ones, and in each group physical laws first."""
    compiled = set(compiled_functions())

    def rank(function_name: str) -> tuple[bool, int]:
        folder = function_name.split(".")[1]
        return function_name not in compiled, LAW_FOLDERS.index(folder) if folder in LAW_FOLDERS else len(LAW_FOLDERS)

    return sorted(functions, key=rank)


def audit_summary(lines: list[Line], folder: Path) -> list[str]:
    """Lines of text that summarise an audit: counts, then each function whose fault no independent check notices."""
    text = [f"{len(lines)} functions, {sum(line.is_covered for line in lines)} noticed by something independent"]
    for kind, names in uncovered_functions(lines, [line.function for line in lines]).items():
        text += [f"{kind}:", *(f"  {name}" for name in names)]
    return [*text, f"table: {folder / TABLE}"]


def cases_that_judge_values() -> list[str]:
    """Names of the validation cases whose rows judge computed values, not effort or choices."""
    systems = {name: getattr(import_module(f"validation.cases.{name}"), "SYSTEM", "") for name in CASES}
    return [name for name, system in systems.items() if system not in SYSTEMS_WITHOUT_VALUES]


def save_functions(folder: Path, pattern: str = "*") -> list[str]:
    """Returns the functions whose ``module:name`` matches a pattern, and saves their names in the folder. The worker
    processes can plant faults in these functions alone.

    Raises InputError where no function matches, or where the folder has other functions saved.
    """
    (folder / TRACE).mkdir(parents=True, exist_ok=True)
    path, functions = folder / FUNCTIONS, [name for name in candidate_functions() if fnmatchcase(name, pattern)]
    if not functions:
        raise InputError("--only", "", pattern, "no shared function is called so: module:name, as in 'models.tyre.*'")
    if path.is_file() and json.loads(path.read_text()) != functions:
        raise InputError(str(path), "", "other functions", "an audit goes on with the functions that it began with")
    write_whole(path, json.dumps(functions))
    return functions


def jobs(grounded_only: bool) -> list[Job]:
    """Jobs of the trace without faults: all cases, and the test files that name independent grounds, or all test files
    without ``grounded_only``. Each job runs in a separate process."""
    files = sorted((ROOT / "tests").glob("test_*.py"))
    chosen = [str(each.relative_to(ROOT)) for each in files if not grounded_only or "mark.grounds(" in each.read_text()]
    return [Job([name], []) for name in cases_that_judge_values()] + [Job([], [file]) for file in chosen]


def trace(pool: WorkerPool, functions: list[str], trace_jobs: list[Job], on_progress: Progress) -> FaultFreeTrace:
    """Trace of cases and tests without faults: read from the audit's folder, or made now where it is missing."""
    lines = traced_lines(pool, functions, trace_jobs, on_progress)
    return FaultFreeTrace(functions, {line.get("case") or line["test"]: line for line in lines})


def engines_by_function(pool: WorkerPool, functions: list[str], on_progress: Progress) -> dict[str, tuple[str, ...]]:
    """Python function -> engines that share it, by a trace of scenes; empty where all functions are compiled."""
    if {*functions} <= {*compiled_functions()}:
        return {}
    return engines_of_functions(
        traced_lines(pool, functions, [Job([], [], [run]) for run in runs_to_trace()], on_progress)
    )


def traced_lines(pool: WorkerPool, functions: list[str], trace_jobs: list[Job], on_progress: Progress) -> list[LogLine]:
    """Trace lines of jobs with the functions that they ran, read from the audit's folder or made now."""

    def run_once(trace_job: Job) -> Path:
        path = pool.folder / TRACE / trace_job.trace_file
        if not path.is_file():
            pool.run(trace_job, path.with_suffix(".part"), {}, ())
            path.with_suffix(".part").rename(path)
        return path

    paths = list[Path]()
    for path in pool.map(run_once, trace_jobs):
        paths.append(path)
        on_progress(f"trace of {path.stem}", len(paths) / len(trace_jobs))
    lines = [line for path in sorted(paths) for line in logged_lines(path)]
    for line in lines:
        line |= {kind: {functions[number] for number in line[kind]} for kind in ("ran", "numbers")}
    return lines


def logged_lines(log_path: Path) -> list[LogLine]:
    """Complete JSON lines that a worker process has written to its log."""
    if not log_path.is_file():
        return []
    return [json.loads(line) for line in log_path.read_text().splitlines(keepends=True) if line.endswith("\n")]


def worker_environment(folder: Path, memory_path: Path) -> dict[str, str]:
    """Environment variables of a worker process; its machine code and bytecode go to the audit's folder."""
    home = folder.absolute()
    order = {"functions": str(home / FUNCTIONS), "bytecode": str(home / "bytecode"), "memory": str(memory_path)}
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(STARTUP_SCRIPT), str(ROOT)]),
        "NUMBA_CACHE_DIR": str(home / "machine_code"),
        memory.ENVIRONMENT_VARIABLE: json.dumps(order),
    }


def unspoiled_reason(function_name: str, fault_free_trace: FaultFreeTrace) -> str:
    """Reason, as in ``Line.ended``, why no fault can be planted in a function; "" where a fault can be planted."""
    if not can_be_spoiled(*function_name.split(":")):
        return "not spoiled"
    if function_name in fault_free_trace.numbers:
        return ""
    return "no numbers" if any(function_name in item["ran"] for item in fault_free_trace.checks.values()) else "not run"


def _failed_rows(log_lines: list[LogLine]) -> Iterator[tuple[str, str]]:
    """Id and grounds (independence) of each failed report row in a worker's log."""
    for line in log_lines:
        for row in line.get("rows", ()):
            if row["status"] == "failed":
                yield row["id"], row["independence"]


def _failed_tests(log_lines: list[LogLine]) -> Iterator[tuple[str, str]]:
    """Id and grounds (independence) of each failed test in a worker's log."""
    return ((line["test"], line["grounds"]) for line in log_lines if line.get("failed"))
