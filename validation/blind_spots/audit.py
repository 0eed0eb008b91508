"""The audit: runs scenes, cases and tests once, then spoils each shared function in a process that is forked for it.

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
    read,
    uncovered_functions,
    write,
)
from validation.cases import CASES

STARTUP_SCRIPT = Path(__file__).with_name("startup")
TRACE, FUNCTIONS, TABLE = "trace", "functions.json", "blind_spots.csv"
JUDGES_FILE, OTHERS_FILE = "judges.csv", "others.csv"
UNJUDGING_SYSTEMS = ("cost", "effects")
"""Systems whose cases judge effort and choices: what they see of a value, the others see before."""
LAW_FOLDERS = ("tyre", "contact", "rail", "brake", "road", "sensors", "multibody", "vehicles", "ride")
"""Folders whose functions come first: the laws of physics, and the tables that hold their numbers."""
WORKER_COUNT = 2
SECONDS_BUDGETS = (8.0, 40.0)
"""Seconds of the processor, without compiling, after which no other case or test is run for a function: if something
independent has noticed, and if not. How many are left is told."""
FAULT_SIZE = 0.01
LONGEST_SOUND_CASE = 1200
"""Seconds of the processor after which a case or test without a fault has lost its way."""
LONGEST_FAULTY_CASE = 120
"""Seconds of the processor after which one with a fault has, as a stop whose wheels never come to rest."""
Told = dict[str, Any]
Noticed = tuple[str, str, str]
"""Ids of rows, of tests, and of those that are independent."""
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
    def trace(self) -> str:
        """Name of the file for this job's trace."""
        return self.name.rpartition("/")[2].replace(".py", "").replace(".toml", "").replace(" ", "_") + ".jsonl"


@dataclass(frozen=True)
class Traced:
    """Record of all cases and tests that ran without a fault: for each by name, the functions that it ran, its time,
    and how it ended.

    functions : all names, by place; items : each with "numbers", the functions that gave numbers in it.
    """

    functions: list[str]
    items: dict[str, Told]

    @cached_property
    def numbers(self) -> set[str]:
        """Functions that returned or wrote a number in any case or test."""
        return {name for item in self.items.values() for name in item["numbers"]}

    def callers(self, function: str, judges: bool) -> list[str]:
        """Names of the judges (cases and tests with independent grounds), or of all others, in which a function gave
        numbers; the quickest first."""
        names = (name for name, item in self.items.items() if function in item["numbers"])
        return sorted(
            (name for name in names if self.is_judge(name) == judges), key=lambda name: self.items[name]["seconds"]
        )

    def is_judge(self, name: str) -> bool:
        """Whether a case or test has independent grounds."""
        item = self.items[name]
        rows = item.get("rows", [{"id": name, "independence": item.get("grounds", "")}])
        return any(is_independent(row["id"], row["independence"]) for row in rows)

    @cached_property
    def sound(self) -> frozenset[str]:
        """Ids of rows and tests that fail already without a planted fault."""
        rows = (row["id"] for item in self.items.values() for row in item.get("rows", ()) if row["status"] == "failed")
        return frozenset((*rows, *(name for name, item in self.items.items() if item.get("failed"))))


class Probes:
    """Pool of worker processes that run jobs (``validation.blind_spots.probe``). ``folder`` keeps their compiled
    code."""

    def __init__(self, folder: Path, workers: int = WORKER_COUNT) -> None:
        self.workers = min(workers, os.cpu_count() or 1)
        self.folder, self.idle = folder, Queue[subprocess.Popen[str]]()
        self._place = TemporaryDirectory()
        command = [sys.executable, "-m", "validation.blind_spots.probe"]
        for worker in range(self.workers):
            doubles = Path(self._place.name) / f"memory{worker}"
            variables, pipe = environment(folder, doubles), subprocess.PIPE
            self.idle.put(subprocess.Popen(command, cwd=ROOT, env=variables, stdin=pipe, stdout=pipe, text=True))

    def __enter__(self) -> "Probes":
        return self

    def __exit__(self, *error: object) -> None:
        """End the worker processes, which are all idle unless an error occurred."""
        while not self.idle.empty():
            self.idle.get().communicate()
        self._place.cleanup()

    def map(self, work: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[Any]:
        """Apply ``work`` to each item in as many threads as there are worker processes; yields the results in the order
        in which they are ready."""
        with ThreadPoolExecutor(self.workers) as pool:
            for future in as_completed([pool.submit(work, item) for item in items]):
                yield future.result()

    def run(self, job: Job, out: Path, faults: dict[int, float], sound: Collection[str]) -> str:
        """Run the cases and tests of a job in a worker process, with ``faults`` planted (function's number: relative
        error). Returns how the job ended."""
        out.write_text("")
        told: Told = {**job._asdict(), "out": str(out), "faults": faults, "sound": sorted(sound)}
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
class Asked:
    """Checks that are run on functions with planted faults: either the judges of a trace, or all its other cases and
    tests.

    engines : that share a function of Python, by its name.
    """

    probes: Probes
    traced: Traced
    judges: bool
    engines: Mapping[str, tuple[str, ...]]

    def line_of(self, function: str) -> Line:
        """Plant a fault in one function, run the checks in which it gives numbers, and return the line that says which
        of them notice the fault."""
        traced = self.traced
        callers, ended = traced.callers(function, self.judges), unspoiled_reason(function, traced)
        if ended or not callers:
            return self.line(function, ended or "whole", len(callers), len(callers))
        job = Job([name for name in callers if name in CASES], [name for name in callers if name not in CASES])
        with TemporaryDirectory() as place:
            out = Path(place) / "told.jsonl"
            ended = self.probes.run(job, out, {traced.functions.index(function): FAULT_SIZE}, traced.sound)
            told = lines_of(out)
        rows, tests = (
            [each for each in kind(told) if each[0] not in traced.sound] for kind in (_failed_rows, _failed_tests)
        )
        independent = [id for id, grounds in (*rows, *tests) if is_independent(id, grounds)]
        ids = ({id for id, _ in rows}, {id for id, _ in tests}, {*independent})
        noticed, failed, grounded = (LIST_SEPARATOR.join(sorted(each)) for each in ids)
        left = len(callers) - len(told)
        return self.line(function, ended, len(callers), left, (noticed, failed, grounded))

    def line(self, function: str, ended: str, calling: int = 0, left: int = 0, noticed: Noticed = ("", "", "")) -> Line:
        """Table line of a function at the present commit; noticed: ids of the rows, tests and independent checks that
        notice its fault."""
        commit = str(provenance("")["commit"])
        return Line(function, ended, calling, left, *noticed, commit, kind_of(function, self.engines))


def audit(folder: Path, progress: Progress) -> list[Line]:
    """Audit all shared functions and return a line for each; lines that ``folder`` has already are kept.

    Raises InputError where the folder belongs to other functions than the sources have now.
    """
    functions = prepare(folder)
    with Probes(folder) as probes:
        engines = trace_of_sides(probes, functions, progress)
        traced = trace(probes, functions, jobs(with_grounds=True), progress)
        shared = in_order(shared_functions(engines))
        lines = measured(folder / JUDGES_FILE, shared, Asked(probes, traced, True, engines), progress)
        write(lines.values(), folder / TABLE)
        traced = trace(probes, functions, jobs(with_grounds=False), progress)
        doubtful = [name for name in shared if not lines[name].is_covered]
        more = measured(folder / OTHERS_FILE, doubtful, Asked(probes, traced, False, engines), progress)
    whole = [lines[name].with_others(more[name]) for name in doubtful]
    whole += [line for name, line in lines.items() if name not in doubtful]
    write(whole, folder / TABLE)
    return whole


def audit_of(only: str, folder: Path, progress: Progress, by: str = "*", workers: int = WORKER_COUNT) -> list[Line]:
    """Audit the shared functions whose ``module:name`` matches ``only``, by judges alone; returns their lines.

    by : what the names of the cases and test files that are asked are like; the fewer, the shorter the trace. Raises
    InputError where no function or judge is like that, or as ``audit`` does.
    """
    functions = prepare(folder, only)
    asked = [job for job in jobs(with_grounds=True) if fnmatchcase(job.name, by)]
    if not asked:
        raise InputError("", "by", by, "no case, and no test file that names independent grounds, is called so")
    with Probes(folder, workers) as probes:
        engines = trace_of_sides(probes, functions, progress)
        traced = trace(probes, functions, asked, progress)
        run = [name for name in shared_functions(engines) if by == "*" or traced.callers(name, judges=True)]
        wanted = [name for name in in_order(run) if name in functions]
        lines = measured(folder / TABLE, wanted, Asked(probes, traced, True, engines), progress)
    return list(lines.values())


def measured(path: Path, functions: list[str], asked: Asked, progress: Progress) -> dict[str, Line]:
    """Lines of the given functions, by name: read from the file if it has them, else measured now and added to it.

    The file has a line for each of them from the start on, which says that it is not audited until it is.
    """
    lines = {name: asked.line(name, NOT_AUDITED) for name in functions} | {line.function: line for line in read(path)}
    left = [name for name, line in lines.items() if line.ended == NOT_AUDITED]
    write(lines.values(), path)
    for done, line in enumerate(asked.probes.map(asked.line_of, left), len(lines) - len(left) + 1):
        lines[line.function] = line
        write(lines.values(), path)
        progress(line.function, done / len(lines))
    return lines


def in_order(functions: list[str]) -> list[str]:
    """Functions sorted for the audit: compiled ones before those in Python, and in each group physical laws before
    others."""
    compiled = set(compiled_functions())

    def rank(function: str) -> tuple[bool, int]:
        folder = function.split(".")[1]
        return function not in compiled, LAW_FOLDERS.index(folder) if folder in LAW_FOLDERS else len(LAW_FOLDERS)

    return sorted(functions, key=rank)


def audit_summary(lines: list[Line], folder: Path) -> list[str]:
    """Printed summary of an audit: counts, then each function whose fault no independent check notices."""
    text = [f"{len(lines)} functions, {sum(line.is_covered for line in lines)} noticed by something independent"]
    for kind, names in uncovered_functions(lines, [line.function for line in lines]).items():
        text += [f"{kind}:", *(f"  {name}" for name in names)]
    return [*text, f"table: {folder / TABLE}"]


def judged_cases() -> list[str]:
    """Names of the cases whose rows judge values."""
    systems = {name: getattr(import_module(f"validation.cases.{name}"), "SYSTEM", "") for name in CASES}
    return [name for name, system in systems.items() if system not in UNJUDGING_SYSTEMS]


def prepare(folder: Path, only: str = "*") -> list[str]:
    """Functions whose ``module:name`` matches ``only``. They are saved in the folder, since the worker processes can
    plant faults in these functions alone.

    Raises InputError where there are none, or where the folder holds others.
    """
    (folder / TRACE).mkdir(parents=True, exist_ok=True)
    path, functions = folder / FUNCTIONS, [name for name in candidate_functions() if fnmatchcase(name, only)]
    if not functions:
        raise InputError("--only", "", only, "no shared function is called so: module:name, as in 'models.tyre.*'")
    if path.is_file() and json.loads(path.read_text()) != functions:
        raise InputError(str(path), "", "other functions", "an audit goes on with the functions that it began with")
    write_whole(path, json.dumps(functions))
    return functions


def jobs(with_grounds: bool) -> list[Job]:
    """Jobs of the trace, each in a process of its own: cases, and test files that name independent grounds; or also
    test files that name none."""
    files = sorted((ROOT / "tests").glob("test_*.py"))
    chosen = [str(each.relative_to(ROOT)) for each in files if not with_grounds or "mark.grounds(" in each.read_text()]
    return [Job([name], []) for name in judged_cases()] + [Job([], [file]) for file in chosen]


def trace(probes: Probes, functions: list[str], jobs: list[Job], progress: Progress) -> Traced:
    """Trace of cases and tests: read from the folder where it is there, else made now."""
    lines = traced_lines(probes, functions, jobs, progress)
    return Traced(functions, {line.get("case") or line["test"]: line for line in lines})


def trace_of_sides(probes: Probes, functions: list[str], progress: Progress) -> dict[str, tuple[str, ...]]:
    """Engines that share each Python function, by its name. Nothing is run where all functions are compiled."""
    if {*functions} <= {*compiled_functions()}:
        return {}
    return engines_of_functions(
        traced_lines(probes, functions, [Job([], [], [run]) for run in runs_to_trace()], progress)
    )


def traced_lines(probes: Probes, functions: list[str], jobs: list[Job], progress: Progress) -> list[Told]:
    """Trace lines of jobs, with the names of the functions that they ran. Traces are read from the folder, and made
    where they are missing."""

    def run_once(job: Job) -> Path:
        path = probes.folder / TRACE / job.trace
        if not path.is_file():
            probes.run(job, path.with_suffix(".part"), {}, ())
            path.with_suffix(".part").rename(path)
        return path

    paths = list[Path]()
    for path in probes.map(run_once, jobs):
        paths.append(path)
        progress(f"trace of {path.stem}", len(paths) / len(jobs))
    lines = [line for path in sorted(paths) for line in lines_of(path)]
    for line in lines:
        line |= {kind: {functions[place] for place in line[kind]} for kind in ("ran", "numbers")}
    return lines


def lines_of(path: Path) -> list[Told]:
    """Lines that a process has written; a last line that was cut off is not."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text().splitlines(keepends=True) if line.endswith("\n")]


def environment(folder: Path, doubles: Path) -> dict[str, str]:
    """Environment variables for a worker process. They keep its machine code and bytecode in the audit's folder."""
    place = folder.absolute()
    order = {"functions": str(place / FUNCTIONS), "bytecode": str(place / "bytecode"), "memory": str(doubles)}
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(STARTUP_SCRIPT), str(ROOT)]),
        "NUMBA_CACHE_DIR": str(place / "machine_code"),
        memory.ENVIRONMENT_VARIABLE: json.dumps(order),
    }


def unspoiled_reason(function: str, traced: Traced) -> str:
    """Reason why no 1 % fault can be planted in a function, in the words of ``Line.ended``; "" where it can."""
    if not can_be_spoiled(*function.split(":")):
        return "not spoiled"
    if function in traced.numbers:
        return ""
    return "no numbers" if any(function in item["ran"] for item in traced.items.values()) else "not run"


def _failed_rows(told: list[Told]) -> Iterator[tuple[str, str]]:
    """Failed rows of the log: id and grounds of each."""
    for line in told:
        for row in line.get("rows", ()):
            if row["status"] == "failed":
                yield row["id"], row["independence"]


def _failed_tests(told: list[Told]) -> Iterator[tuple[str, str]]:
    """Failed tests of the log: id and grounds of each."""
    return ((line["test"], line["grounds"]) for line in told if line.get("failed"))
