"""One controller behind every kind of connection of the controller port, the cost of each connection, and the end of a
run whose controller fails.

Whole runs are compared bit by bit: times, motion, wheels, pressures, torques, forces. Costs are of one exchange, with
all connections in turn. A controller fails in a second process that knows the port by its documented bytes alone, or as
a Python class; the run must end with that fault's name, at its sample, in time, and hold what it recorded until then.
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
from models.brake.controller import SAMPLING_PERIOD, Controller, Sample
from models.brake.port.ask import ControllerFailed, checked_command
from models.brake.port.example import Example
from models.brake.port.setup import ControllerRunData, PortTable, controller_of_run
from models.machine.timing import bootstrap_median
from models.systems.braking.march import BrakingPath
from models.systems.braking.run import run
from models.systems.braking.scene import build
from validation.braking import misbehaving_client
from validation.common.grounds import allowing_breaches
from validation.common.rows import Observed, Row, System, Table, behaviour_row, not_run

TITLE = "The controller port: same bits on every way, and controllers that fail"
SYSTEM: System = "anti-lock"
EXAMPLE_CONTROLLER = "models.brake.port.example:Example"
SILENCE_TIMEOUT = 0.5
"""Time-out (s) for one command of a controller that falls silent. A run whose controller fails shall have ended within
twice that time."""
LONG_TIMEOUT = 600.0
"""Time-out (s) that a slow and busy machine does not reach."""
PROCESS_FAULTS = {
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
"""Misbehaviours of a controller in a second process, each with the name of the error with which the run must end."""
CLASS_FAULTS = {
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
"""Misbehaviours of a controller class, each with the name of the error with which the run must end, and the faulty
code."""
EXCHANGES_PER_ROUND = 100
"""Number of exchanges with a controller in one timing round."""
QUICK_PROCESS_FAULTS = ("NaN", "too few wheels", "silence", "died")


@allowing_breaches("both sides are cut off after the same few samples", "stop")
def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of equal bits, costs and faults; a quick run brakes for half a second and plants few faults."""
    tables_by_connection = _port_tables(work_folder, with_python_process=not quick)
    rows = _equal_bits_rows(tables_by_connection, work_folder, 0.5 if quick else 4.0)
    costs = _exchange_times(tables_by_connection, work_folder, 5 if quick else 40)
    rows += [
        Observed(
            f"braking_port.cost.{_name_in_row_id(name)}",
            SYSTEM,
            f"time of an exchange with a controller, {name}, 95 % interval {low:.1f} to {high:.1f}",
            cost,
            "us",
        ).beside("", f"median of rounds of {EXCHANGES_PER_ROUND} in which all ways have their turn", "none")
        for name, (cost, low, high) in costs.items()
    ]
    told = [_process_fault_outcome(kind, work_folder) for kind in (QUICK_PROCESS_FAULTS if quick else PROCESS_FAULTS)]
    told += [_class_fault_outcome(kind, work_folder) for kind in (("catches everything",) if quick else CLASS_FAULTS)]
    told += [] if quick else [_fmu_fault_outcome(kind, work_folder) for kind in FMU_FAULTS]
    return rows + [row for outcome in told for row in _controller_fault_rows(outcome)], {"costs": costs, "faults": told}


def _braking_scene_with_port(work_folder: Path, duration: float, port_table: dict[str, Any]) -> Any:
    """Scene of a straight stop whose controller is connected by a port table."""
    straight = {"straight": {"kind": "straight", "speed": 11.11}}
    return build(
        {
            "system": "braking",
            "title": "port",
            "procedures": straight,
            "run": {"duration": duration},
            "port": {"timeout": LONG_TIMEOUT, "start": LONG_TIMEOUT} | port_table,
        },
        "port.toml",
        work_folder,
    )


def _port_tables(work_folder: Path, with_python_process: bool) -> dict[str, dict[str, Any] | str]:
    """Scene tables of all kinds of connection of a controller, by name; for a kind that is not available, the reason as
    text."""
    tables_by_connection: dict[str, dict[str, Any] | str] = {"callable": {"callable": EXAMPLE_CONTROLLER}}
    if with_python_process:
        tables_by_connection["second process in Python"] = {
            "command": [sys.executable, "-m", "models.brake.port.client", EXAMPLE_CONTROLLER, "{port}"]
        }
    tables_by_connection["second process in C"] = _port_table_of_c_client(work_folder)
    tables_by_connection["FMU"] = _port_table_of_fmu(work_folder)
    return tables_by_connection


def _port_table_of_c_client(work_folder: Path) -> dict[str, Any] | str:
    """Compile the example client in C; its port table, or the reason why there is none."""
    compiler, source = shutil.which("cc"), Path(port.__path__[0]) / "client_example.c"
    if compiler is None:
        return "no C compiler here"
    subprocess.run([compiler, "-O2", "-ffp-contract=off", "-o", str(work_folder / "client"), str(source)], check=True)
    return {"command": [str(work_folder / "client"), "{port}"]}


def _port_table_of_fmu(work_folder: Path) -> dict[str, Any] | str:
    """Build the example FMU; its port table, or the reason why there is none."""
    try:
        from pythonfmu import FmuBuilder
    except ImportError:
        return "needs pythonfmu and fmpy: pip install 'twinrig[test]'"
    return {"fmu": FmuBuilder.build_FMU(Path(port.__path__[0]) / "example_slave.py", dest=work_folder).name}


def _equal_bits_rows(
    port_tables_by_connection: dict[str, dict[str, Any] | str], work_folder: Path, duration: float
) -> list[Row]:
    """Rows: runs with every kind of connection, and a replay of the log, compared bit by bit with a run that calls the
    controller directly."""
    first = run(
        _braking_scene_with_port(work_folder, duration, {"callable": EXAMPLE_CONTROLLER, "log": "port.log"})
    ).detail
    rows = []
    for name, table in {**port_tables_by_connection, "replay": {"replay": "port.log"}}.items():
        key, what = (
            f"braking_port.bits.{_name_in_row_id(name)}",
            f"a run through the {name} has the bits of the callable, {len(first.times) - 1} samples",
        )
        if isinstance(table, str):
            rows.append(not_run(key, SYSTEM, what, table))
            continue
        ended = _differing_fields(first, run(_braking_scene_with_port(work_folder, duration, table)).detail)
        rows.append(behaviour_row(key, SYSTEM, what, ended, "same bits", "doubles pass every way whole", "none"))
    return [*rows, _pressure_changes_row(first)]


def _pressure_changes_row(braking_path: BrakingPath) -> Row:
    """Row: brake pressures change direction often; a controller that does nothing would give equal bits in any case."""
    turns = int((np.diff(np.sign(np.diff(braking_path.pressures, axis=0)), axis=0) != 0).sum())
    return behaviour_row(
        "braking_port.bits.alive",
        SYSTEM,
        f"the pressure changes direction often enough to tell controllers apart, here {turns} times",
        "yes" if turns > 8 else "no",
        "yes",
        "bits of a controller that does nothing prove nothing",
    )


def _differing_fields(first_run: BrakingPath, other_run: BrakingPath) -> str:
    """Names of the arrays in which two runs differ, as text; "same bits" if they are equal."""
    names = ("times", "states", "turning", "pressures", "torques", "reports")
    apart = [name for name in names if not np.array_equal(getattr(first_run, name), getattr(other_run, name))]
    return f"other {', '.join(apart)}" if apart else "same bits"


def _exchange_times(
    port_tables_by_connection: dict[str, dict[str, Any] | str], work_folder: Path, round_count: int
) -> dict[str, list[float]]:
    """Time of one exchange in microseconds for each kind of connection: median of the rounds with its 95 % interval."""
    facts, seconds = ControllerRunData(np.full(4, 0.5), SAMPLING_PERIOD, folder=work_folder), dict[str, list[float]]()
    with ExitStack() as stack:
        tables = {
            name: PortTable(timeout=LONG_TIMEOUT, start=LONG_TIMEOUT, **table)
            for name, table in port_tables_by_connection.items()
            if isinstance(table, dict)
        }
        controllers = {
            name: stack.enter_context(controller_of_run(table, facts, Example(4)))[0] for name, table in tables.items()
        }
        for i in range(round_count):
            for name, controller in controllers.items():
                seconds.setdefault(name, []).append(_seconds_of_exchange_round(controller, i * EXCHANGES_PER_ROUND))
    return {
        name: list(bootstrap_median(1e6 * np.array(values) / EXCHANGES_PER_ROUND)) for name, values in seconds.items()
    }


def _seconds_of_exchange_round(controller: Controller, first_sample_number: int) -> float:
    """Times (s) of the exchanges with a controller in one round."""
    samples = [
        Sample(i, round(1e9 * SAMPLING_PERIOD * i), np.full(4, 10.0 + 0.01 * (i % 7)), True, 6.0, 11.0)
        for i in range(first_sample_number, first_sample_number + EXCHANGES_PER_ROUND)
    ]
    start = time.perf_counter()
    for sample in samples:
        checked_command(controller, sample)
    return time.perf_counter() - start


def _process_fault_outcome(misbehaviour: str, work_folder: Path) -> dict[str, Any]:
    """How a run ends whose controller misbehaves in a second process."""
    words = [sys.executable, "-S", str(Path(misbehaving_client.__file__)), misbehaviour, "{port}"]
    return _outcome_of_faulty_run(
        f"second process: {misbehaviour}", PROCESS_FAULTS[misbehaviour], {"command": words}, work_folder
    )


def _class_fault_outcome(misbehaviour: str, work_folder: Path) -> dict[str, Any]:
    """How a run ends whose controller class misbehaves."""
    name, does = CLASS_FAULTS[misbehaviour]
    well = f"        if given.number < {misbehaving_client.GOOD_SAMPLES}: return Command(valves=np.ones(4))\n"
    (work_folder / "fails.py").write_text(
        "import ctypes, os, signal, time\nimport numpy as np\nfrom models.brake.controller import Command\n"
        "class Fails:\n"
        "    def __init__(self, wheels): pass\n    def sample(self, given):\n" + well + f"        {does}\n"
    )
    return _outcome_of_faulty_run(f"class that {misbehaviour}", name, {"callable": "fails.py:Fails"}, work_folder)


FMU_FAULTS = {
    "raises": ("crash", "raise ValueError('boom')"),
    "never comes back": ("silence", "while True: pass"),
    "ends its process": ("crash", "os._exit(0)"),
    "crashes its process": ("crash", "ctypes.string_at(0)"),
    "returns an error": ("crash", "return False"),
}
"""Misbehaviours of a controller in an FMU, each with the name of the error with which the run must end, and the faulty
code."""


def _fmu_fault_outcome(misbehaviour: str, work_folder: Path) -> dict[str, Any]:
    """How a run ends whose controller misbehaves in an FMU."""
    from pythonfmu import FmuBuilder

    name, does = FMU_FAULTS[misbehaviour]
    line = "        wheels = np.array"
    well = (
        f"        if self._number == {misbehaving_client.GOOD_SAMPLES}:\n            import ctypes, os\n   "
        f"         {does}\n"
    )
    source = (Path(port.__path__[0]) / "example_slave.py").read_text().replace(line, well + line)
    (work_folder / "fails_slave.py").write_text(source)
    return _outcome_of_faulty_run(
        f"FMU that {misbehaviour}",
        name,
        {"fmu": FmuBuilder.build_FMU(work_folder / "fails_slave.py", dest=work_folder).name},
        work_folder,
    )


def _outcome_of_faulty_run(
    misbehaviour: str, expected_error: str, port_table: dict[str, Any], work_folder: Path
) -> dict[str, Any]:
    """How a run with a failing controller ends, and the time (s) from the start of the last exchange to that end."""
    watched, timeout = _ExchangeClock(), SILENCE_TIMEOUT if expected_error == "silence" else LONG_TIMEOUT
    outcome = {
        "kind": misbehaviour,
        "expected": expected_error,
        "name": "no error",
        "number": -1,
        "kept": 0,
        "message": "",
    }
    try:
        with watched:
            run(_braking_scene_with_port(work_folder, 1.0, {**port_table, "timeout": timeout}))
    except ControllerFailed as error:
        samples_kept = 0 if error.partial is None else len(error.partial.times) - 1
        outcome |= {"name": error.name, "number": error.number, "kept": samples_kept, "message": str(error)}
    return {**outcome, "seconds": time.perf_counter() - watched.last_start}


class _ExchangeClock:
    """Context manager that records the time at which each exchange with a controller begins."""

    def __enter__(self) -> "_ExchangeClock":
        from models.systems.braking import march

        self.last_start, self._march, self._ask = time.perf_counter(), march, march.checked_command
        march.checked_command = self._timed_ask  # type: ignore[assignment]
        return self

    def __exit__(self, *_: object) -> None:
        self._march.checked_command = self._ask

    def _timed_ask(self, controller: Controller, controller_input: Sample, *arguments: Any) -> Any:
        self.last_start = time.perf_counter()
        return self._ask(controller, controller_input, *arguments)


def _controller_fault_rows(fault_outcome: dict[str, Any]) -> list[Row]:
    """Rows: name of the error with which a faulty controller ends the run, and the time until the run ends."""
    well = misbehaving_client.GOOD_SAMPLES
    slow = (
        fault_outcome["name"] == fault_outcome["expected"] == "silence" and fault_outcome["number"] <= well
    )  # a busy machine is silent, too
    is_complete = fault_outcome["kept"] == fault_outcome["number"] and (fault_outcome["number"] == well or slow)
    ended = (
        fault_outcome["name"]
        if is_complete
        else f"{fault_outcome['name']} at {fault_outcome['number']}, {fault_outcome['kept']} samples kept"
    )
    key = f"braking_port.fault.{_name_in_row_id(fault_outcome['kind'])}"
    return [
        behaviour_row(
            key,
            SYSTEM,
            f"end of a run whose controller fails, {fault_outcome['kind']}, after {well} samples that are kept",
            ended,
            fault_outcome["expected"],
            "named, at its sample, with the path until then",
        ),
        Observed(
            f"{key}.seconds",
            SYSTEM,
            f"time until a run whose controller fails has ended, {fault_outcome['kind']}, measured once",
            fault_outcome["seconds"],
            "s",
        ).aim(2.0 * SILENCE_TIMEOUT, f"twice the time-out of {SILENCE_TIMEOUT:g} s"),
    ]


def _name_in_row_id(connection_or_fault: str) -> str:
    """Part of a row id for a kind of connection or a fault."""
    return connection_or_fault.replace(": ", ".").replace(" ", "-")


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the cost of each connection, and of the message of every fault."""
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
            f"Of {1e6 * SAMPLING_PERIOD:g} us between two samples; median with its 95 % interval.",
            ("way", "us"),
            costs,
        ),
        Table(
            "Controllers that fail", f"Time-out {SILENCE_TIMEOUT:g} s.", ("what it does", "message", "s, once"), faults
        ),
    ]
