"""The audit: traces once what calls what, then spoils each shared function in a process of its own.

Everything lies in a folder, so that a stopped audit goes on: ``trace.jsonl`` with what cases and tests called,
``blind_spots.csv`` with a line for each function that is done.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from models.core.result import provenance
from validation.blind_spots import planting
from validation.blind_spots.probe import label_of
from validation.blind_spots.rewriting import ROOT, can_be_spoiled
from validation.blind_spots.shared import shared_functions
from validation.blind_spots.table import JOINED, Line, is_independent, read, uncovered, write
from validation.cases import CASES

STARTUP = Path(__file__).with_name("startup")
TRACE, TABLE, CHILDREN = "trace.jsonl", "blind_spots.csv", "workers"
UNJUDGED = ("cost", "effects")
"""Systems whose cases judge effort and choices: what they see of a value, the others see before."""
WORKERS = 2
BUDGET = 40.0
"""Seconds, as traced and without compiling, of the cases, and of the tests, that are run for one function, the quickest
first; how many are left is told."""
PATIENCE = 600.0
"""Seconds after which a spoiled process has lost its way, as a search that never ends."""
Told = dict[str, Any]


@dataclass(frozen=True)
class Traced:
    """What cases and tests called, how long they took and how they ended, by name; functions that give numbers."""

    items: dict[str, Told]
    numbers: set[str]

    def callers(self, function: str) -> list[str]:
        """Names of cases and tests that call a function, the quickest first."""
        names = (name for name, item in self.items.items() if function in item["names"])
        return sorted(names, key=lambda name: (self.items[name]["seconds"], name))


def audit(folder: Path, progress: Callable[[str, float], None], wanted: list[str] | None = None) -> list[Line]:
    """Lines of all shared functions, or of the wanted; those that ``folder`` holds already are not run again."""
    folder.mkdir(parents=True, exist_ok=True)
    traced = trace(folder)
    done = {line.function: line for line in read(folder / TABLE)}
    left = [name for name in wanted or shared_functions(traced.numbers) if name not in done]
    total = len(done) + len(left)
    commit = str(provenance("")["commit"])
    with ThreadPoolExecutor(min(WORKERS, os.cpu_count() or 1)) as pool:
        for future in as_completed([pool.submit(line_of, name, traced, commit) for name in left]):
            line = future.result()
            done[line.function] = line
            write(done.values(), folder / TABLE)
            progress(line.function, len(done) / total)
    return list(done.values())


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


def trace(folder: Path) -> Traced:
    """What calls what: read from the folder, or traced now by running every case and test once."""
    path, children = folder / TRACE, folder / CHILDREN
    children.mkdir(exist_ok=True)
    known = {line.get("case") or line.get("test", "").partition("::")[0] for line in lines_of(path)}
    files = [str(each.relative_to(ROOT)) for each in sorted((ROOT / "tests").glob("test_*.py"))]
    jobs = [([name], list[str]()) for name in judged_cases()] + [(list[str](), [file]) for file in files]
    for cases, tests in jobs:
        if not known.issuperset((*cases, *tests)):
            run({"trace": str(children)}, cases, tests, path, PATIENCE)
    return traced_of(lines_of(path), children)


def traced_of(lines: list[Told], children: Path) -> Traced:
    """The trace as kept; workers' calls count to the work that started them."""
    numbers = {name for line in lines for name in line.get("numbers", ())}
    items = {line.get("case") or line["test"]: line for line in lines if "case" in line or "test" in line}
    of_label = {label_of(name): item for name, item in items.items()}
    for path in children.glob("*.json"):
        told = json.loads(path.read_text())
        numbers |= set(told["numbers"])
        item = of_label.get(path.name.partition(".")[0])
        if item is not None:
            item["names"] = sorted({*item["names"], *told["names"]})
    return Traced({name: {**item, "names": set(item["names"])} for name, item in items.items()}, numbers)


def lines_of(path: Path) -> list[Told]:
    """What processes have told; a last line that was cut off is not."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text().splitlines(keepends=True) if line.endswith("\n")]


def run(order: Told, cases: list[str], tests: list[str], out: Path, patience: float) -> str:
    """Run cases and tests in a process that is spoiled or watched; returns how it ended."""
    job = out.with_suffix(f".{os.getpid()}.job")
    job.write_text(json.dumps({"cases": cases, "tests": tests, "out": str(out)}))
    paths = os.pathsep.join([str(STARTUP), str(ROOT)])
    environment = {**os.environ, "PYTHONPATH": paths, planting.VARIABLE: json.dumps(order)}
    command = [sys.executable, "-m", "validation.blind_spots.probe", str(job)]
    try:
        ended = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=patience)
    except subprocess.TimeoutExpired:
        return "out of time"
    finally:
        job.unlink()
    return "whole" if ended.returncode == 0 else "crashed"


def within_budget(names: list[str], traced: Traced, budget: float = BUDGET) -> list[str]:
    """The first of some cases and tests that together took no more than so many seconds, and at least one."""
    chosen, seconds = list[str](), 0.0
    for name in names:
        seconds += traced.items[name]["seconds"]
        if chosen and seconds > budget:
            break
        chosen.append(name)
    return chosen


def line_of(function: str, traced: Traced, commit: str) -> Line:
    """Spoil one function, run what calls it and tell what notices."""
    callers = traced.callers(function)
    cases = within_budget([name for name in callers if name in CASES], traced)
    tests = within_budget([name for name in callers if name not in CASES], traced)
    if not callers or not can_be_spoiled(*function.split(":")):
        ended = "not spoiled" if callers else "whole"
        return Line(function, ended, len(callers), len(callers), "", "", "", commit)
    with TemporaryDirectory() as place:
        out = Path(place) / "told.jsonl"
        ended = run({"spoil": function}, cases, tests, out, PATIENCE)
        told = lines_of(out)
    if any(line["uncompiled"] for line in told):
        ended = "not compiled"
    rows = sorted(set(_rows(told, traced)))
    failed = sorted(set(_tests(told, traced)))
    independent = [id for id, grounds in (*rows, *failed) if is_independent(id, grounds)]
    left = len(callers) - len(told)
    return Line(function, ended, len(callers), left, _joined(rows), _joined(failed), JOINED.join(independent), commit)


def _joined(noticed: list[tuple[str, str]]) -> str:
    return JOINED.join(id for id, _ in noticed)


def _rows(told: list[Told], traced: Traced) -> Iterator[tuple[str, str]]:
    """Rows that fail and did not before: id and grounds."""
    for line in told:
        if "case" in line:
            before = {row["id"] for row in traced.items[line["case"]]["rows"] if row["status"] == "failed"}
            for row in line["rows"]:
                if row["status"] == "failed" and row["id"] not in before:
                    yield row["id"], row["independence"]


def _tests(told: list[Told], traced: Traced) -> Iterator[tuple[str, str]]:
    """Tests that fail and did not before: id and grounds."""
    for line in told:
        if "test" in line and line["failed"] and not traced.items[line["test"]]["failed"]:
            yield line["test"], line["grounds"]
