"""The audit: runs cases and tests once, then spoils each shared function in a process of its own.

All processes run the same rewritten modules (``planting``), whose machine code is kept in the audit's folder: ready
after the first run, whichever function is spoiled. First judge the cases with independent rows and the tests on
independent grounds; all others are asked only about functions that no judge has noticed. A stopped audit goes on from
its folder: ``functions.json`` with the names of all functions, ``trace`` with what cases and tests ran, ``judges.csv``
and ``others.csv`` with a line for each function that is done, and ``blind_spots.csv``, the table made of both.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from models.core.errors import InputError
from models.core.result import provenance
from models.core.whole_files import write_whole
from validation.blind_spots import memory
from validation.blind_spots.rewriting import ROOT, can_be_spoiled
from validation.blind_spots.shared import candidates, compiled_functions, shared_functions
from validation.blind_spots.table import JOINED, Line, is_independent, read, uncovered, write
from validation.cases import CASES

STARTUP = Path(__file__).with_name("startup")
TRACE, FUNCTIONS, TABLE = "trace", "functions.json", "blind_spots.csv"
JUDGES, OTHERS = "judges.csv", "others.csv"
UNJUDGED = ("cost", "effects")
"""Systems whose cases judge effort and choices: what they see of a value, the others see before."""
LAWS = ("tyre", "contact", "rail", "brake", "road", "sensors", "multibody", "vehicles", "ride")
"""Folders whose functions come first: the laws of physics, and the tables that hold their numbers."""
WORKERS = 2
BUDGETS = (8.0, 40.0)
"""Seconds of the processor, without compiling, after which no other case or test is run for a function: if something
independent has noticed, and if not. How many are left is told."""
FAULT = 0.01
PATIENCE = 1200.0
"""Seconds after which a process has lost its way, as a search that never ends."""
Told = dict[str, Any]
Job = tuple[list[str], list[str]]
"""Cases and tests."""


@dataclass(frozen=True)
class Traced:
    """What cases and tests ran, how long they took and how they ended, by name.

    functions : all names, by place; items : each with "numbers", the functions that gave numbers in it.
    """

    folder: Path
    functions: list[str]
    items: dict[str, Told]

    @property
    def numbers(self) -> set[str]:
        """Functions that gave a number anywhere."""
        return {name for item in self.items.values() for name in item["numbers"]}

    def callers(self, function: str, judges: bool) -> list[str]:
        """Judges, or all others, in which a function gave numbers, the quickest first."""
        names = (name for name, item in self.items.items() if function in item["numbers"])
        return sorted(
            (name for name in names if self.is_judge(name) == judges), key=lambda name: self.items[name]["seconds"]
        )

    def is_judge(self, name: str) -> bool:
        """Whether a case or test has independent grounds."""
        item = self.items[name]
        rows = item.get("rows", [{"id": name, "independence": item.get("grounds", "")}])
        return any(is_independent(row["id"], row["independence"]) for row in rows)

    @property
    def sound(self) -> list[str]:
        """Ids of rows and tests that fail without a fault."""
        rows = (row["id"] for item in self.items.values() for row in item.get("rows", ()) if row["status"] == "failed")
        return [*rows, *(name for name, item in self.items.items() if item.get("failed"))]


def audit(folder: Path, progress: Callable[[str, float], None], wanted: list[str] | None = None) -> list[Line]:
    """Lines of all shared functions, or of the wanted; those that ``folder`` holds already are not run again.

    Raises InputError where the folder belongs to other functions than the sources have now.
    """
    functions = prepare(folder)
    traced = trace(folder, functions, jobs(with_grounds=True), progress)
    shared = wanted or in_order(shared_functions(traced.numbers))
    lines = measured(folder / JUDGES, shared, partial(line_of, traced=traced, judges=True), progress)
    write(lines.values(), folder / TABLE)
    traced = trace(folder, functions, jobs(with_grounds=False), progress)
    shared = wanted or in_order(shared_functions(traced.numbers))
    doubtful = [name for name in shared if name not in lines or not lines[name].is_covered]
    more = measured(folder / OTHERS, doubtful, partial(line_of, traced=traced, judges=False), progress)
    whole = [lines[name].with_others(more[name]) if name in lines else more[name] for name in doubtful]
    whole += [line for name, line in lines.items() if name not in doubtful]
    write(whole, folder / TABLE)
    return whole


def measured(
    path: Path, functions: list[str], line: Callable[[str], Line], progress: Callable[[str, float], None]
) -> dict[str, Line]:
    """Lines of some functions, by name: as the file keeps them, or measured now, and then kept."""
    done = {line.function: line for line in read(path)}
    left = [name for name in functions if name not in done]
    total = len(done) + len(left)
    with ThreadPoolExecutor(min(WORKERS, os.cpu_count() or 1)) as pool:
        for future in as_completed([pool.submit(line, name) for name in left]):
            made = future.result()
            done[made.function] = made
            write(done.values(), path)
            progress(made.function, len(done) / total)
    return done


def in_order(functions: list[str]) -> list[str]:
    """Compiled laws, then all other compiled functions, then those of Python, laws before others."""
    compiled = set(compiled_functions())

    def rank(function: str) -> tuple[bool, int]:
        folder = function.split(".")[1]
        return function not in compiled, LAWS.index(folder) if folder in LAWS else len(LAWS)

    return sorted(functions, key=rank)


def summary(lines: list[Line], folder: Path) -> list[str]:
    """What the command prints: counts, then each function that nothing independent notices."""
    text = [f"{len(lines)} functions, {sum(line.is_covered for line in lines)} noticed by something independent"]
    for kind, names in uncovered(lines, [line.function for line in lines]).items():
        text += [f"{kind}:", *(f"  {name}" for name in names)]
    return [*text, f"table: {folder / TABLE}"]


def judged_cases() -> list[str]:
    """Cases that judge values."""
    systems = {name: getattr(import_module(f"validation.cases.{name}"), "SYSTEM", "") for name in CASES}
    return [name for name, system in systems.items() if system not in UNJUDGED]


def prepare(folder: Path) -> list[str]:
    """The names of all functions, kept in the folder; raises InputError where it holds others."""
    (folder / TRACE).mkdir(parents=True, exist_ok=True)
    path, functions = folder / FUNCTIONS, candidates()
    if path.is_file() and json.loads(path.read_text()) != functions:
        raise InputError(str(path), "", "other functions", "an audit goes on with the sources that it began with")
    write_whole(path, json.dumps(functions))
    return functions


def jobs(with_grounds: bool) -> list[Job]:
    """What the trace runs, each in a process of its own: cases, and files of tests that name independent grounds, or
    those too that name none."""
    files = sorted((ROOT / "tests").glob("test_*.py"))
    chosen = [str(each.relative_to(ROOT)) for each in files if not with_grounds or "mark.grounds(" in each.read_text()]
    return [([name], []) for name in judged_cases()] + [([], [file]) for file in chosen]


def trace(folder: Path, functions: list[str], jobs: list[Job], progress: Callable[[str, float], None]) -> Traced:
    """What runs what: read from the folder, or traced now."""
    paths = [folder / TRACE / f"{Path(*cases, *tests).stem}.jsonl" for cases, tests in jobs]

    def run_once(job: Job, path: Path) -> str:
        if not path.is_file():
            run(folder, {}, job, [], path.with_suffix(".part"))
            path.with_suffix(".part").rename(path)
        return path.stem

    with ThreadPoolExecutor(min(WORKERS, os.cpu_count() or 1)) as pool:
        for count, name in enumerate(pool.map(run_once, jobs, paths)):
            progress(f"trace of {name}", count / len(jobs))
    return traced_of(folder, functions, paths)


def traced_of(folder: Path, functions: list[str], paths: list[Path]) -> Traced:
    """The trace as kept, with functions by name."""
    lines = [line for path in paths for line in lines_of(path)]
    for line in lines:
        for kind in ("ran", "numbers"):
            line[kind] = {functions[place] for place in line[kind]}
    return Traced(folder, functions, {line.get("case") or line["test"]: line for line in lines})


def lines_of(path: Path) -> list[Told]:
    """What a process has told; a last line that was cut off is not."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text().splitlines(keepends=True) if line.endswith("\n")]


def run(folder: Path, faults: dict[int, float], job: Job, sound: list[str], out: Path) -> str:
    """Run cases and tests in a process with some faults, by place; returns how it ended."""
    with TemporaryDirectory() as place:
        doubles, told = Path(place) / "memory", Path(place) / "job.json"
        shared = memory.shared(doubles)
        for function, fault in faults.items():
            shared[function] = fault
        budgets = BUDGETS if faults else (PATIENCE, PATIENCE)
        told.write_text(
            json.dumps({"cases": job[0], "tests": job[1], "out": str(out), "sound": sound, "budgets": budgets})
        )
        command = [sys.executable, "-m", "validation.blind_spots.probe", str(told)]
        variables = environment(folder, doubles)
        out.write_text("")
        try:
            ended = subprocess.run(command, cwd=ROOT, env=variables, capture_output=True, timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            return "out of time"
    return "whole" if ended.returncode == 0 else "crashed"


def environment(folder: Path, doubles: Path) -> dict[str, str]:
    """Variables of a process whose functions can be spoiled: machine code and bytecode stay in the audit's folder."""
    order = {"functions": str(folder.absolute() / FUNCTIONS), "memory": str(doubles)}
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(STARTUP), str(ROOT)]),
        "PYTHONPYCACHEPREFIX": str(folder.absolute() / "bytecode"),
        "NUMBA_CACHE_DIR": str(folder.absolute() / "machine_code"),
        memory.VARIABLE: json.dumps(order),
    }


def line_of(function: str, traced: Traced, judges: bool) -> Line:
    """Spoil one function, run judges or all others in which it gives numbers, and tell what notices."""
    callers, commit = traced.callers(function, judges), str(provenance("")["commit"])
    ended = unspoiled(function, traced)
    if ended or not callers:
        return Line(function, ended or "whole", len(callers), len(callers), "", "", "", commit)
    job = ([name for name in callers if name in CASES], [name for name in callers if name not in CASES])
    with TemporaryDirectory() as place:
        out = Path(place) / "told.jsonl"
        ended = run(traced.folder, {traced.functions.index(function): FAULT}, job, traced.sound, out)
        told = lines_of(out)
    failed = [sorted({each for each in failures(told) if each[0] not in traced.sound}) for failures in (_rows, _tests)]
    independent = [id for id, grounds in (*failed[0], *failed[1]) if is_independent(id, grounds)]
    rows, tests = (JOINED.join(id for id, _ in each) for each in failed)
    return Line(function, ended, len(callers), len(callers) - len(told), rows, tests, JOINED.join(independent), commit)


def unspoiled(function: str, traced: Traced) -> str:
    """Why a function cannot be 1 % off, as ``Line.ended`` tells it; "" where it can."""
    if not can_be_spoiled(*function.split(":")):
        return "not spoiled"
    if function in traced.numbers:
        return ""
    return "no numbers" if any(function in item["ran"] for item in traced.items.values()) else "not run"


def _rows(told: list[Told]) -> Iterator[tuple[str, str]]:
    """Rows that failed: id and grounds."""
    for line in told:
        for row in line.get("rows", ()):
            if row["status"] == "failed":
                yield row["id"], row["independence"]


def _tests(told: list[Told]) -> Iterator[tuple[str, str]]:
    """Tests that failed: id and grounds."""
    return ((line["test"], line["grounds"]) for line in told if line.get("failed"))
