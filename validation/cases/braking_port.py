"""One controller behind every way through the port, what each costs, and what becomes of a run whose controller fails.

Bits are compared of whole runs: times, motion, wheels, pressures, torques, forces. Costs are those of one exchange, of
all ways in turn. A controller fails in a second process that knows the port by its documented bytes alone, or as a
Python class; the run must end with that fault's name, at its sample, in time, and hold what it recorded until then.
"""

import shutil
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

import models.brake.port as port
from models.brake.controller import SAMPLE, Controller, Sample
from models.brake.port.ask import ControllerFailed, ask
from models.brake.port.example import Example
from models.brake.port.setup import ControllerRun, PortTable, controller_of_run
from models.machine.timing import median
from models.systems.braking.march import BrakingPath as Driven
from models.systems.braking.run import run
from models.systems.braking.scene import build
from validation.braking import misbehaving_client
from validation.common.grounds import allowing_breaches
from validation.common.rows import Observed, Row, System, Table, behaviour_row, not_run

TITLE = "The controller port: same bits on every way, and controllers that fail"
SYSTEM: System = "anti-lock"
EXAMPLE = "models.brake.port.example:Example"
TIMEOUT = 0.5
"""s for one answer of a controller that falls silent; it shall have ended within twice that, as any that fails."""
PATIENT = 600.0
"""s for what a slow and busy machine does in time."""
FAULTS = {
    "NaN": "not a number",
    "infinite": "not a number",
    "NaN as a valve": "not a number",
    "negative pressure": "below zero",
    "valve in no state": "no state of a valve",
    "too few wheels": "wrong length",
    "too many bytes": "wrong length",
    "part of a frame": "silence",
    "another protocol": "wrong frame",
    "answer to another sample": "wrong number",
    "silence": "silence",
    "late": "silence",
    "died": "crash",
}
"""What a second process does wrong, and the name under which the run must end."""
CLASSES = {
    "raises": ("crash", "raise KeyError('speed')"),
    "never comes back": ("silence", "while True: pass"),
    "catches everything": (
        "silence",
        "while True:\n            try: time.sleep(0.05)\n            except BaseException: pass",
    ),
    "sleeps in C": ("silence", "ctypes.CDLL(None).sleep(1000)"),
    "stops its process": ("silence", "os.kill(os.getpid(), signal.SIGSTOP)"),
    "ends its process": ("crash", "os._exit(0)"),
    "crashes its process": ("crash", "ctypes.string_at(0)"),
    "leaves by sys.exit": ("crash", "raise SystemExit"),
    "presses more than the supply": ("too high", "return Command(pressures=np.full(4, 299.0))"),
    "answers complex numbers": ("wrong frame", "return Command(pressures=np.full(4, 1j))"),
    "returns nothing": ("wrong frame", "return None"),
    "returns NaN": ("not a number", "return Command(pressures=np.full(4, np.nan))"),
    "returns three": ("wrong length", "return Command(valves=np.ones(3))"),
}
"""The same of a class: its name, and what it does."""
ROUND = 100
"""Exchanges of a round."""
QUICK_FAULTS = ("NaN", "too few wheels", "silence", "died")


@allowing_breaches("both sides are cut off after the same few samples", "stop")
def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of bits, costs and faults; quick: half a second of braking, few faults."""
    tables_by_connection = _tables_of_ways(folder, with_second=not quick)
    rows = _bits(tables_by_connection, folder, 0.5 if quick else 4.0)
    costs = _costs(tables_by_connection, folder, 5 if quick else 40)
    rows += [
        Observed(
            f"braking_port.cost.{_id(name)}",
            SYSTEM,
            f"time of an exchange with a controller, {name}, 95 % interval {low:.1f} to {high:.1f}",
            cost,
            "us",
        ).beside("", f"median of rounds of {ROUND} in which all ways have their turn", "none")
        for name, (cost, low, high) in costs.items()
    ]
    told = [_process(kind, folder) for kind in (QUICK_FAULTS if quick else FAULTS)]
    told += [_class(kind, folder) for kind in (("catches everything",) if quick else CLASSES)]
    told += [] if quick else [_slave(kind, folder) for kind in SLAVES]
    return rows + [row for way_name in told for row in _fault_rows(way_name)], {"costs": costs, "faults": told}


def _scene(folder: Path, duration: float, table: dict[str, Any]) -> Any:
    straight = {"straight": {"kind": "straight", "speed": 11.11}}
    return build(
        {
            "system": "braking",
            "title": "port",
            "procedures": straight,
            "run": {"duration": duration},
            "port": {"timeout": PATIENT, "start": PATIENT} | table,
        },
        "port.toml",
        folder,
    )


def _tables_of_ways(folder: Path, with_second: bool) -> dict[str, dict[str, Any] | str]:
    """Scene tables of all ways to connect a controller, by name, and a text on those that are not available."""
    tables_by_connection: dict[str, dict[str, Any] | str] = {"callable": {"callable": EXAMPLE}}
    if with_second:
        tables_by_connection["second process in Python"] = {
            "command": [sys.executable, "-m", "models.brake.port.client", EXAMPLE, "{port}"]
        }
    tables_by_connection["second process in C"] = _built_c(folder)
    tables_by_connection["FMU"] = _built_fmu(folder)
    return tables_by_connection


def _built_c(folder: Path) -> dict[str, Any] | str:
    compiler, source = shutil.which("cc"), Path(port.__path__[0]) / "client_example.c"
    if compiler is None:
        return "no C compiler here"
    subprocess.run([compiler, "-O2", "-ffp-contract=off", "-o", str(folder / "client"), str(source)], check=True)
    return {"command": [str(folder / "client"), "{port}"]}


def _built_fmu(folder: Path) -> dict[str, Any] | str:
    try:
        from pythonfmu import FmuBuilder
    except ImportError:
        return "needs pythonfmu and fmpy: pip install 'twinrig[test]'"
    return {"fmu": FmuBuilder.build_FMU(Path(port.__path__[0]) / "example_slave.py", dest=folder).name}


def _bits(tables_by_connection: dict[str, dict[str, Any] | str], folder: Path, duration: float) -> list[Row]:
    """Rows: every way to connect a controller compared bit by bit with a direct call, and then the replay of its
    log."""
    first = run(_scene(folder, duration, {"callable": EXAMPLE, "log": "port.log"})).detail
    rows = []
    for name, table in {**tables_by_connection, "replay": {"replay": "port.log"}}.items():
        key, what = (
            f"braking_port.bits.{_id(name)}",
            f"a run through the {name} has the bits of the callable, {len(first.times) - 1} samples",
        )
        if isinstance(table, str):
            rows.append(not_run(key, SYSTEM, what, table))
            continue
        ended = _compare_bits(first, run(_scene(folder, duration, table)).detail)
        rows.append(behaviour_row(key, SYSTEM, what, ended, "same bits", "doubles pass every way whole", "none"))
    return [*rows, _pressures_move(first)]


def _pressures_move(path: Driven) -> Row:
    """Row: pressures change direction often, since a controller that does nothing would give equal bits in any case."""
    turns = int((np.diff(np.sign(np.diff(path.pressures, axis=0)), axis=0) != 0).sum())
    return behaviour_row(
        "braking_port.bits.alive",
        SYSTEM,
        f"the pressure changes direction often enough to tell controllers apart, here {turns} times",
        "yes" if turns > 8 else "no",
        "yes",
        "bits of a controller that does nothing prove nothing",
    )


def _compare_bits(path: Driven, other_run: Driven) -> str:
    names = ("times", "states", "turning", "pressures", "torques", "reports")
    apart = [name for name in names if not np.array_equal(getattr(path, name), getattr(other_run, name))]
    return f"other {', '.join(apart)}" if apart else "same bits"


def _costs(
    tables_by_connection: dict[str, dict[str, Any] | str], folder: Path, round_count: int
) -> dict[str, list[float]]:
    """Time of one exchange in microseconds for each way to connect a controller: median of the rounds with its 95 %
    interval."""
    facts, seconds = ControllerRun(np.full(4, 0.5), SAMPLE, folder=folder), dict[str, list[float]]()
    with ExitStack() as stack:
        tables = {
            name: PortTable(timeout=PATIENT, start=PATIENT, **table)
            for name, table in tables_by_connection.items()
            if isinstance(table, dict)
        }
        controllers = {
            name: stack.enter_context(controller_of_run(table, facts, Example(4)))[0] for name, table in tables.items()
        }
        for i in range(round_count):
            for name, controller in controllers.items():
                seconds.setdefault(name, []).append(_timed(controller, i * ROUND))
    return {name: list(median(1e6 * np.array(values) / ROUND)) for name, values in seconds.items()}


def _timed(controller: Controller, first: int) -> float:
    samples = [
        Sample(i, round(1e9 * SAMPLE * i), np.full(4, 10.0 + 0.01 * (i % 7)), True, 6.0, 11.0)
        for i in range(first, first + ROUND)
    ]
    start = time.perf_counter()
    for sample in samples:
        ask(controller, sample)
    return time.perf_counter() - start


def _process(misbehaviour: str, folder: Path) -> dict[str, Any]:
    words = [sys.executable, "-S", str(Path(misbehaving_client.__file__)), misbehaviour, "{port}"]
    return _failed(f"second process: {misbehaviour}", FAULTS[misbehaviour], {"command": words}, folder)


def _class(misbehaviour: str, folder: Path) -> dict[str, Any]:
    name, does = CLASSES[misbehaviour]
    well = f"        if given.number < {misbehaving_client.GOOD_SAMPLES}: return Command(valves=np.ones(4))\n"
    (folder / "fails.py").write_text(
        "import ctypes, os, signal, time\nimport numpy as np\nfrom models.brake.controller import Command\n"
        "class Fails:\n"
        "    def __init__(self, wheels): pass\n    def sample(self, given):\n" + well + f"        {does}\n"
    )
    return _failed(f"class that {misbehaviour}", name, {"callable": "fails.py:Fails"}, folder)


SLAVES = {
    "raises": ("crash", "raise ValueError('boom')"),
    "never comes back": ("silence", "while True: pass"),
    "ends its process": ("crash", "os._exit(0)"),
    "crashes its process": ("crash", "ctypes.string_at(0)"),
    "returns an error": ("crash", "return False"),
}
"""What an FMU does, and the name under which the run must end."""


def _slave(misbehaviour: str, folder: Path) -> dict[str, Any]:
    from pythonfmu import FmuBuilder

    name, does = SLAVES[misbehaviour]
    line = "        wheels = np.array"
    well = (
        f"        if self._number == {misbehaving_client.GOOD_SAMPLES}:\n            import ctypes, os\n   "
        f"         {does}\n"
    )
    source = (Path(port.__path__[0]) / "example_slave.py").read_text().replace(line, well + line)
    (folder / "fails_slave.py").write_text(source)
    return _failed(
        f"FMU that {misbehaviour}",
        name,
        {"fmu": FmuBuilder.build_FMU(folder / "fails_slave.py", dest=folder).name},
        folder,
    )


def _failed(misbehaviour: str, name: str, table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """How a run with a failing controller ends, and the time (s) since its last good sample."""
    watched, timeout = _Watch(), TIMEOUT if name == "silence" else PATIENT
    outcome = {"kind": misbehaviour, "expected": name, "name": "no error", "number": -1, "kept": 0, "message": ""}
    try:
        with watched:
            run(_scene(folder, 1.0, {**table, "timeout": timeout}))
    except ControllerFailed as error:
        samples_kept = 0 if error.partial is None else len(error.partial.times) - 1
        outcome |= {"name": error.name, "number": error.number, "kept": samples_kept, "message": str(error)}
    return {**outcome, "seconds": time.perf_counter() - watched.last}


class _Watch:
    """Wrapper of a controller that records when each exchange begins."""

    def __enter__(self) -> "_Watch":
        from models.systems.braking import march

        self.last, self._march, self._ask = time.perf_counter(), march, march.ask
        march.ask = self._noted  # type: ignore[assignment]
        return self

    def __exit__(self, *_: object) -> None:
        self._march.ask = self._ask

    def _noted(self, controller: Controller, sample: Sample, *arguments: Any) -> Any:
        self.last = time.perf_counter()
        return self._ask(controller, sample, *arguments)


def _fault_rows(fault: dict[str, Any]) -> list[Row]:
    well = misbehaving_client.GOOD_SAMPLES
    slow = fault["name"] == fault["expected"] == "silence" and fault["number"] <= well  # a busy machine is silent, too
    is_complete = fault["kept"] == fault["number"] and (fault["number"] == well or slow)
    ended = fault["name"] if is_complete else f"{fault['name']} at {fault['number']}, {fault['kept']} samples kept"
    key = f"braking_port.fault.{_id(fault['kind'])}"
    return [
        behaviour_row(
            key,
            SYSTEM,
            f"end of a run whose controller fails, {fault['kind']}, after {well} samples that are kept",
            ended,
            fault["expected"],
            "named, at its sample, with the path until then",
        ),
        Observed(
            f"{key}.seconds",
            SYSTEM,
            f"time until a run whose controller fails has ended, {fault['kind']}, measured once",
            fault["seconds"],
            "s",
        ).aim(2.0 * TIMEOUT, f"twice the time-out of {TIMEOUT:g} s"),
    ]


def _id(name: str) -> str:
    return name.replace(": ", ".").replace(" ", "-")


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Costs, and every fault with its message."""
    costs = tuple(
        (name, f"{cost:.1f} ({low:.1f} to {high:.1f})") for name, (cost, low, high) in case_data["costs"].items()
    )
    faults = tuple(
        (fault_record["kind"], fault_record["message"], f"{fault_record['seconds']:.3f}")
        for fault_record in case_data["faults"]
    )
    return [
        Table(
            "Cost of one exchange",
            f"Of {1e6 * SAMPLE:g} us between two samples; median with its 95 % interval.",
            ("way", "us"),
            costs,
        ),
        Table("Controllers that fail", f"Time-out {TIMEOUT:g} s.", ("what it does", "message", "s, once"), faults),
    ]
