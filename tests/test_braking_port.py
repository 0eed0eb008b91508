"""The port: one controller behind every way gives the same bits, and whatever it does wrong ends in a named error."""

import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from contextlib import chdir, contextmanager
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import models.brake.port as port
from models.brake.brake import PAPER_FRONT_BRAKE, PAPER_REAR_BRAKE, brakes_of_wheels
from models.brake.controller import SAMPLING_PERIOD, Command, Sample
from models.brake.plane_vehicle import PAPER_TRUCK, plane_of_truck
from models.brake.port import frame, socket_port
from models.brake.port.ask import ControllerFailed, checked_command
from models.brake.port.callable import named_controller
from models.brake.port.client import serve_controller_at_port
from models.brake.port.example import Example
from models.brake.port.faults import ControllerFault, FaultyController
from models.brake.port.pace import WallClockController
from models.brake.port.sensors import SensorConversion, controller_behind_sensors
from models.brake.port.setup import ControllerRunData, PortTable, controller_of_run
from models.brake.port.socket_port import controller_behind_socket
from models.brake.port.teeth import ToothCounter, ToothedWheel
from models.brake.pressure import BrakeChambers
from models.brake.surfaces import RoadStretch, road_of_stretches
from models.core.errors import InputError, RunFailed
from models.core.strict import read
from models.systems.braking.march import BrakedVehicle
from models.systems.braking.run import run as drive
from models.systems.braking.scene import build
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import stacked_tables

HERE = Path(port.__path__[0])
SHORT = 0.2
"""Seconds of braking."""
RADIUS = np.full(4, 0.5)
PATIENT = 120.0
"""Seconds for what a slow and busy machine does in time; nothing here waits for them to pass."""


class Says:
    """Answers what a function makes of the sample."""

    def __init__(self, answer):
        self.answer, self.seen = answer, []

    def sample(self, given):
        self.seen.append(given)
        return self.answer(given)


def held(given):
    return Command(valves=np.zeros(4, dtype=np.int64))


@pytest.fixture(scope="module")
def vehicle():
    chambers = BrakeChambers(np.full(4, 0.05), np.full(4, 0.05), 6.0)
    ice = table_of_surface("ice")
    brakes = brakes_of_wheels(PAPER_FRONT_BRAKE, PAPER_FRONT_BRAKE, PAPER_REAR_BRAKE, PAPER_REAR_BRAKE)
    return BrakedVehicle(
        plane=plane_of_truck(PAPER_TRUCK),
        kind=np.zeros(4, dtype=np.int64),
        tables=stacked_tables([ice]),
        slope=ice.cornering,
        road=road_of_stretches([RoadStretch(0.0, 0, 0)]),
        brakes=brakes,
        chambers=chambers,
        steer=np.zeros(4),
    )


def of(number=0, wheels=(11.0, 10.0, 9.0, 8.0), speed=11.0):
    return Sample(number, round(number * SAMPLING_PERIOD * 1e9), np.array(wheels), True, 6.0, speed)


def time_out(name, silent):
    """s for an answer: so few where silence is the fault, and else so many that no slow machine is taken for it."""
    return silent if name.startswith("silence") else PATIENT


def same(path, other):
    names = ("times", "states", "turning", "pressures", "torques", "reports")
    return all(np.array_equal(getattr(path, name), getattr(other, name)) for name in names)


@contextmanager
def client(behave, timeout=0.1):
    """A connection whose other end is a thread that does ``behave(link)``."""

    def act(number):
        with socket.create_connection(("127.0.0.1", number)) as link:
            behave(link)

    with socket_port.listening_socket() as server:
        thread = threading.Thread(target=act, args=(server.getsockname()[1],))
        thread.start()
        link = server.accept()[0]
        try:
            with link:
                yield socket_port.SocketPort(link, timeout)
        finally:
            thread.join(PATIENT)
    assert not thread.is_alive()


def test_frames_are_as_documented():
    raw = frame.question_frame(of(3))
    assert len(raw) == 104 and raw[:4] == b"TRQ1" and raw[16:18] == b"\x04\x03" and not any(raw[18:24])
    assert int.from_bytes(raw[4:8], "little") == 3 and int.from_bytes(raw[8:16], "little") == 16_500_000
    assert np.frombuffer(raw, "<f8", offset=24).tolist() == [6.0, 11.0, 11.0, 10.0, 9.0, 8.0, 0.0, 0.0, 0.0, 0.0]
    back = frame.sample_of_question(raw)
    assert (back.number, back.time, back.brake, back.wheels.tolist()) == (3, 16_500_000, True, [11.0, 10.0, 9.0, 8.0])
    said = frame.answer_frame(3, Command(pressures=np.array([0.1, 0.2, 0.3, 1e-300])))
    assert len(said) == 80 and said[:4] == b"TRA1" and said[8:10] == b"P\x04"
    assert frame.command_of_answer(said, 3).pressures.tolist() == [0.1, 0.2, 0.3, 1e-300]


def test_a_speed_that_is_not_given_is_told_so():
    raw = frame.question_frame(of(speed=np.nan))
    assert raw[17] == frame.SWITCH and np.isnan(frame.sample_of_question(raw).speed)


def test_a_thread_at_the_socket_gives_the_same_bits(vehicle):
    answered = []
    with socket_port.listening_socket() as server:
        number = server.getsockname()[1]
        thread = threading.Thread(target=lambda: answered.append(serve_controller_at_port(Example(4), number)))
        thread.start()
        link = server.accept()[0]
        with link:
            path = vehicle.run(socket_port.SocketPort(link, PATIENT), 11.0, SHORT)
        thread.join(PATIENT)
    assert same(path, vehicle.run(Example(4), 11.0, SHORT)) and answered == [len(path.times) - 1]
    assert (path.pressures[1:] < path.pressures[:-1]).any()  # it did release


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_the_client_in_c_gives_the_same_bits(vehicle, tmp_path):
    program = tmp_path / "client"
    source = HERE / "client_example.c"
    words = ["cc", "-O2", "-Wall", "-Werror", "-ffp-contract=off", "-o", str(program), str(source)]
    subprocess.run(words, check=True)
    with controller_behind_socket([str(program), "{port}"], 0, PATIENT, PATIENT) as other:
        path = vehicle.run(other, 11.0, SHORT)
    assert same(path, vehicle.run(Example(4), 11.0, SHORT))


def test_an_fmu_gives_the_same_bits(vehicle, tmp_path):
    builder = pytest.importorskip("pythonfmu").FmuBuilder
    file = builder.build_FMU(HERE / "example_slave.py", dest=tmp_path)
    table = PortTable(fmu=Path(file).name, timeout=PATIENT, start=PATIENT)
    with controller_of_run(table, ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path), Example(4)) as (
        other,
        _,
    ):
        path = vehicle.run(other, 11.0, SHORT)
    assert same(path, vehicle.run(Example(4), 11.0, SHORT))


@pytest.mark.parametrize(
    ("does", "name"),
    [
        ("raise ValueError", "crash"),
        ("while True: pass", "silence"),
        ("os._exit(5)", "crash: .* status 5"),
        ("ctypes.string_at(0)", "crash: .* SIGSEGV"),
        ("return False", "crash"),
    ],
)
def test_a_hostile_fmu_ends_by_name_and_in_time(does, name, tmp_path):
    builder = pytest.importorskip("pythonfmu").FmuBuilder
    source = (HERE / "example_slave.py").read_text()
    line = "        wheels = np.array"
    source = source.replace(line, f"        import ctypes, os\n        {does}\n{line}")
    (tmp_path / "slave.py").write_text(source)
    file = builder.build_FMU(tmp_path / "slave.py", dest=tmp_path)
    table = PortTable(fmu=Path(file).name, timeout=time_out(name, 0.5), start=PATIENT)
    run = ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path)
    with pytest.raises(ControllerFailed, match=name), controller_of_run(table, run, Example(4)) as (other, _):
        begun = time.perf_counter()
        checked_command(other, of())
    assert time.perf_counter() - begun < PATIENT


def test_an_fmu_without_fmpy_names_the_extra(monkeypatch, tmp_path):
    (tmp_path / "a.fmu").touch()
    monkeypatch.setitem(sys.modules, "fmpy", None)
    table, run = PortTable(fmu="a.fmu"), ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path)
    with pytest.raises(InputError, match=r"twinrig\[fmi\]"), controller_of_run(table, run, Example(4)):
        pass


def test_a_file_that_is_no_fmu(tmp_path):
    (tmp_path / "a.fmu").write_text("no")
    table = PortTable(fmu="a.fmu")
    with (
        pytest.raises(InputError, match="no FMU"),
        controller_of_run(table, ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path), Example(4)),
    ):
        pass


def _said(**changes):
    """What a client does that answers with a changed frame."""

    def behave(link):
        number = int.from_bytes(link.recv(104)[4:8], "little")
        raw = bytearray(frame.answer_frame(number, Command(pressures=np.array([1.0, 1.0, 1.0, 1.0]))))
        for place, value in changes.get("bytes", {}).items():
            raw[place : place + len(value)] = value
        link.sendall(bytes(raw)[: changes.get("cut", 80)] + b"x" * changes.get("more", 0))
        if changes.get("stay"):
            link.recv(1)

    return behave


def _double(value):
    return np.array([value]).tobytes()


NONSENSE = {
    "not a number": _said(bytes={16: _double(np.nan)}),
    "below zero": _said(bytes={24: _double(-1.0)}),
    "too high": _said(bytes={24: _double(1e300)}),
    "no state of a valve": _said(bytes={8: b"V", 16: _double(0.5)}),
    "wrong length": _said(bytes={9: b"\x03"}),
    "wrong length: an answer of more than 80 bytes": _said(more=1),
    "wrong frame": _said(bytes={0: b"HTTP"}),
    "wrong number": _said(bytes={4: b"\x07"}),
    "crash: the connection was closed after 10 of 80 bytes": _said(cut=10),
    "crash: the connection was closed after no answer": _said(cut=0),
    "silence: 10 of 80 bytes within 0.1 s": _said(cut=10, stay=True),
    "silence: no answer within 0.1 s": _said(cut=0, stay=True),
}


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_at_the_socket_is_named_in_time(name):
    begun = time.perf_counter()
    with client(NONSENSE[name], time_out(name, 0.1)) as other, pytest.raises(ControllerFailed, match=name) as told:
        checked_command(other, of(2))
    assert time.perf_counter() - begun < PATIENT
    assert (
        told.value.number == 2
        and told.value.time == pytest.approx(2 * SAMPLING_PERIOD)
        and "sample 2" in str(told.value)
    )


def test_a_drip_of_bytes_is_no_answer():
    def drip(link):
        link.recv(104)
        for _ in range(10):
            time.sleep(0.02)
            try:
                link.sendall(b"T")
            except OSError:
                return

    with client(drip, 0.05) as other, pytest.raises(ControllerFailed, match="of 80 bytes within"):
        checked_command(other, of())


def _raises(given):
    raise ValueError("no idea")


def _exits(given):
    raise SystemExit(0)


@pytest.mark.parametrize(
    ("answer", "name"),
    [
        (_raises, "crash: ValueError: no idea"),
        (_exits, "crash: SystemExit: 0"),
        (lambda given: None, "wrong frame"),
        (lambda given: Command(), "wrong frame"),
        (lambda given: Command(valves=np.ones(3)), "wrong length: 3 values for 4 wheels"),
        (lambda given: Command(valves=np.ones((2, 2))), "wrong length: 2 x 2 values for 4 wheels"),
        (lambda given: Command(valves=np.array([1, 1, 1, 2])), "no state of a valve: 2 is none"),
        (lambda given: Command(pressures=np.array([1, 1, np.inf, 1])), "not a number: inf"),
        (lambda given: Command(pressures=np.array([1, -1e-9, 1, 1])), "below zero"),
        (lambda given: Command(pressures=["a"] * 4), "wrong frame"),
        (lambda given: Command(valves=np.ma.array(np.ones(4), mask=[0, 1, 0, 0])), "not a number: a masked value"),
    ],
)
def test_nonsense_of_a_callable_is_named(answer, name):
    with pytest.raises(ControllerFailed, match=name):
        checked_command(Says(answer), of(), maximum_pressure=6.0)


HOSTILE = {
    "sleeps, whatever is raised": (
        "silence: no answer within 0.3 s",
        "while True:\n            try: time.sleep(0.05)\n            except BaseException: pass",
    ),
    "sleeps in C": ("silence", "ctypes.CDLL(None).sleep(1000)"),
    "works in C": ("silence", "sum(iter(int, 1))"),
    "hears no signal": (
        "silence",
        "[signal.signal(s, signal.SIG_IGN) for s in range(1, 32) if s not in (9, 19)]\n        while True: pass",
    ),
    "stops itself": ("silence", "os.kill(os.getpid(), signal.SIGSTOP)"),
    "leaves a thread": (
        r"crash: ValueError: boom \(hostile.py, line 7\)",
        "threading.Thread(target=time.sleep, args=(1000,)).start(); raise ValueError('boom')",
    ),
    "ends its process": ("crash: .* ended with status 3", "os._exit(3)"),
    "leaves by sys.exit": ("crash: SystemExit: 0", "sys.exit(0)"),
    "crashes": ("crash: .* SIGSEGV", "ctypes.string_at(0)"),
    "is killed": ("crash: .* SIGKILL", "os.kill(os.getpid(), signal.SIGKILL)"),
    "closes everything": ("crash", "os.closerange(3, 256); time.sleep(1000)"),
    "is late": ("silence", "time.sleep(0.4); return Command(valves=np.ones(4))"),
    "is no array": (
        "silence",
        "class A:\n            def __array__(self, *a, **k):\n                while True: pass\n"
        "        return Command(pressures=A())",
    ),
    "answers complex numbers": ("wrong frame: complex", "return Command(pressures=np.full(4, 1j))"),
    "presses more than there is": (
        "too high: a pressure of 299 bar, above the 6 bar",
        "return Command(pressures=np.full(4, 299.0))",
    ),
}


def test_prints_of_a_controller_leave_standard_output_to_the_results(tmp_path, capfd):
    """JSON of a run could not be read behind them."""
    (tmp_path / "talks.py").write_text(
        "import numpy as np\nfrom models.brake.controller import Command\nclass Talks:\n"
        "    def __init__(self, wheels): pass\n    def sample(self, given):\n        print('noise', flush=True)\n"
        "        return Command(valves=np.ones(4))\n"
    )
    run = ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path)
    with controller_of_run(PortTable(callable="talks.py:Talks", start=PATIENT), run, Example(4)) as (other, _):
        checked_command(other, of())
    said = capfd.readouterr()
    assert said.out == "" and "noise" in said.err


def test_what_a_controller_says_of_its_failure_is_a_line_that_can_be_printed():
    error = ControllerFailed(of(), "crash", "ValueError: \ud800 \n\n\t boom" + 10_000 * "x")
    assert str(error).splitlines() == [str(error)] and r"\ud800 boom" in str(error) and len(str(error)) < 1000
    str(error).encode()


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_callable_ends_by_name_and_in_time(kind, tmp_path):
    name, does = HOSTILE[kind]
    (tmp_path / "hostile.py").write_text(
        "import ctypes, os, signal, sys, threading, time\nimport numpy as np\n"
        "from models.brake.controller import Command\nclass Hostile:\n    def __init__(self, wheels): pass\n"
        f"    def sample(self, given):\n        {does}\n"
    )
    table = PortTable(callable="hostile.py:Hostile", timeout=time_out(name, 0.3), start=PATIENT)
    run = ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path)
    with pytest.raises(ControllerFailed, match=name), controller_of_run(table, run, Example(4)) as (other, _):
        begun = time.perf_counter()
        checked_command(other, of())
    assert time.perf_counter() - begun < PATIENT


def test_a_callable_that_is_not_made_in_time_or_crashes_as_it_is_made(tmp_path):
    for does, start, told in (
        ("while True: pass", 3.0, "silence: (it was not made|nobody connected)"),
        ("import os; os._exit(4)", PATIENT, "status 4"),
    ):
        (tmp_path / "made.py").write_text(
            f"class Made:\n    def __init__(self, wheels):\n        {does}\n    def sample(self, given): pass\n"
        )
        table = PortTable(callable="made.py:Made", start=start)
        with (
            pytest.raises(RunFailed, match=told),
            controller_of_run(table, ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path), Example(4)),
        ):
            pass


NEVER = {
    "callable": "class Made:\n    def __init__(self, wheels):\n        while True: pass\n",
    "module": "while True: pass\n",
    "parameters": "class Made:\n    def __init__(self, wheels, size):\n        while True: pass\n",
}


@pytest.mark.parametrize("kind", NEVER)
def test_making_a_controller_may_take_as_long_as_an_answer(kind, tmp_path):
    """The time that our own process needs to start is not part of it."""
    (tmp_path / "made.py").write_text(f"import time\nopen('begun', 'w').write(repr(time.time()))\n{NEVER[kind]}")
    given = {"size": 3} if kind == "parameters" else {}
    table = PortTable(callable="made.py:Made", timeout=0.4, parameters=given)
    with (
        chdir(tmp_path),
        pytest.raises(RunFailed, match=r"not made within 0.4 s; .* give start"),
        controller_of_run(table, ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path), Example(4)),
    ):
        pass
    assert time.time() - float((tmp_path / "begun").read_text()) < 2 * table.timeout


def test_an_fmu_that_is_never_ready_ends_as_an_answer_does(tmp_path):
    builder = pytest.importorskip("pythonfmu").FmuBuilder
    lines = (HERE / "example_slave.py").read_text().replace("import", f"import os, time\n{WAITS}import", 1)
    (tmp_path / "slave.py").write_text(lines.replace("super().__init__(", "waits()\n        super().__init__("))
    file = builder.build_FMU(tmp_path / "slave.py", dest=tmp_path)
    table, run = (
        PortTable(fmu=Path(file).name, timeout=0.8),
        ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path),
    )
    (tmp_path / "begun").touch()
    with (
        chdir(tmp_path),
        pytest.raises(RunFailed, match=r"not made within 0.8 s"),
        controller_of_run(table, run, Example(4)),
    ):
        pass
    assert time.time() - float((tmp_path / "begun").read_text()) < 2 * table.timeout


WAITS = """
def waits():
    if os.path.exists("begun"):  # not yet as it is built
        open("begun", "w").write(repr(time.time()))
        while True: pass
"""


def test_a_command_has_as_long_to_connect_and_a_process_started_by_hand_longer(tmp_path):
    table = PortTable(command=["sleep", "30"], timeout=0.2)
    begun = time.perf_counter()
    with pytest.raises(RunFailed, match=r"nobody connected to .* within 0.2 s; .* give start"):
        controller_of_run(table, ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path), Example(4)).__enter__()
    assert time.perf_counter() - begun < 2 * table.timeout
    assert PortTable(port=5000).patience > 10 and PortTable(port=5000, start=3.0).patience == 3.0


@pytest.mark.parametrize("table", [{"signals": {"gain": 0.9}}, {"faults": [{"kind": "stuck"}]}, {"log": "a.log"}, {}])
@pytest.mark.parametrize(
    ("answer", "name"),
    [(lambda given: None, "wrong frame"), (lambda given: Command(pressures=np.full(4, -1.0)), "below zero")],
)
def test_nonsense_is_named_before_sensors_faults_and_log_can_hide_it(table, answer, name, tmp_path):
    run = ControllerRunData(RADIUS, SAMPLING_PERIOD, folder=tmp_path)
    failing = Says(answer)
    with (
        controller_of_run(read(PortTable, table, ""), run, failing) as (other, _),
        pytest.raises(ControllerFailed, match=name),
    ):
        checked_command(other, of())


def test_a_failed_run_keeps_what_it_recorded(vehicle):
    def dies(given):
        return held(given) if given.number < 5 else _raises(given)

    with pytest.raises(ControllerFailed, match="sample 5: crash") as told:
        vehicle.run(Says(dies), 11.0, SHORT)
    partial = told.value.partial
    assert len(partial.times) == 6 and not partial.ended_at_rest and partial.reports.load.shape == (5, 4)
    assert np.array_equal(partial.states, vehicle.run(Says(held), 11.0, 5 * SAMPLING_PERIOD).states)


def test_a_command_that_ends_at_once_and_one_that_never_connects(monkeypatch):
    monkeypatch.setattr(socket_port, "PROCESS_END_SECONDS", 0.01)
    early = controller_behind_socket(["sh", "-c", "exit 3"], 0, 1.0, PATIENT)
    with pytest.raises(RunFailed, match="status 3 before it connected"), early:
        pass
    with pytest.raises(RunFailed, match="nobody connected to"), controller_behind_socket(["sleep", "30"], 0, 1.0, 0.1):
        pass
    with (
        pytest.raises(InputError, match="cannot be started"),
        controller_behind_socket(["/no/such/program"], 0, 1.0, 0.1),
    ):
        pass


def test_no_process_stays(monkeypatch, tmp_path):
    monkeypatch.setattr(socket_port, "PROCESS_END_SECONDS", 0.01)
    code = (
        "import os, socket, subprocess, sys\n"
        "open('parent', 'w').write(str(os.getpid()))\n"
        "open('child', 'w').write(str(subprocess.Popen(['sleep', '600']).pid))\n"
        "link = socket.create_connection(('127.0.0.1', int(sys.argv[1])))\nos.wait()\n"
    )
    with controller_behind_socket([sys.executable, "-S", "-c", code, "{port}"], 0, PATIENT, PATIENT, tmp_path):
        pass
    for name in ("parent", "child"):
        number = int((tmp_path / name).read_text())
        with pytest.raises(OSError):
            for _ in range(3000):  # an orphan is collected by its new parent, soon
                os.kill(number, 0)
                if "Z" in Path(f"/proc/{number}/stat").read_text().split()[2]:
                    raise OSError("collected soon")
                time.sleep(0.01)


def test_the_socket_listens_on_this_machine_alone():
    with socket_port.listening_socket() as server:
        assert server.getsockname()[0] == "127.0.0.1"


def test_a_log_replays_bit_for_bit_and_knows_its_scene(vehicle, tmp_path):
    run = ControllerRunData(RADIUS, SAMPLING_PERIOD, "a scene", tmp_path)
    with controller_of_run(PortTable(log="a.log"), run, Example(4)) as (own, _):
        path = vehicle.run(own, 11.0, SHORT)
    with controller_of_run(PortTable(replay="a.log"), run, Says(_raises)) as (replayed, _):
        assert same(path, vehicle.run(replayed, 11.0, SHORT))
    with (
        controller_of_run(PortTable(replay="a.log"), run, Example(4)) as (replayed, _),
        pytest.raises(RunFailed, match="was asked something else"),
    ):
        vehicle.run(replayed, np.nextafter(11.0, 12.0), SHORT)
    with (
        controller_of_run(PortTable(replay="a.log"), run, Example(4)) as (replayed, _),
        pytest.raises(RunFailed, match=f"sample {len(path.times) - 1}: a.log has ended"),
    ):
        vehicle.run(replayed, 11.0, SHORT + 0.1)
    with (
        pytest.raises(InputError, match="another scene"),
        controller_of_run(
            PortTable(replay="a.log"), ControllerRunData(RADIUS, SAMPLING_PERIOD, "another", tmp_path), Example(4)
        ),
    ):
        pass
    (tmp_path / "no.log").write_bytes(b"no")
    with pytest.raises(InputError, match="no log"), controller_of_run(PortTable(replay="no.log"), run, Example(4)):
        pass


def test_the_wall_clock_changes_no_number_and_counts_overruns(vehicle):
    clock = WallClockController(Example(4), SAMPLING_PERIOD)
    begun = time.perf_counter()
    path = vehicle.run(clock, 11.0, 0.1)
    assert time.perf_counter() - begun >= 0.1 - 2 * SAMPLING_PERIOD
    assert same(path, vehicle.run(Example(4), 11.0, 0.1))

    def slow(given):
        time.sleep(0.02 if given.number == 1 else 0.0)
        return held(given)

    late = WallClockController(Says(slow), SAMPLING_PERIOD)
    vehicle.run(late, 11.0, 4 * SAMPLING_PERIOD)
    assert late.overruns >= 1 and late.worst >= 0.02 - SAMPLING_PERIOD - 1e-4
    assert "overruns, the worst by" in late.report()


def test_the_switch_closes_in_time(vehicle):
    from dataclasses import replace

    seen = Says(lambda given: Command(valves=np.ones(4)))
    path = replace(vehicle, switch_time=0.05).run(seen, 11.0, 0.1)
    closed = [given.brake for given in seen.seen]
    assert closed == [SAMPLING_PERIOD * i >= 0.05 - 1e-9 for i in range(len(closed))]
    assert not path.pressures[: closed.index(True) + 1].any() and path.pressures[closed.index(True) + 1].all()


def test_conversion_to_bits_and_nothing_without_it():
    says = Says(held)
    controller_behind_sensors(says, 4, SensorConversion(), SensorConversion()).sample(of())
    assert says.seen[0].wheels.tolist() == [11.0, 10.0, 9.0, 8.0]
    converted = controller_behind_sensors(says, 4, SensorConversion(bits=3, range=14.0), SensorConversion())
    converted.sample(of(wheels=(0.9, 1.1, 99.0, -1.0)))  # codes of 2 m/s: 0, 1, the last, 0
    assert says.seen[1].wheels.tolist() == [0.0, 2.0, 14.0, 0.0]


def test_noise_gain_and_offset_of_signals_and_pressures():
    says = Says(lambda given: Command(pressures=np.full(4, 2.0)))
    own = SensorConversion(gain=2.0, offset=1.0, noise=0.5, seed=7)
    one, other = (controller_behind_sensors(says, 4, own, own) for _ in range(2))
    back = np.array([one.sample(of(i)).pressures for i in range(2500)])
    seen = np.array([given.wheels for given in says.seen])
    assert np.array_equal(back[2000], other.sample(of(2000)).pressures)  # noise is that of the sample, in any order
    assert np.array_equal(says.seen[-1].wheels, seen[2000])
    for off in (back - 5.0, seen - 2.0 * of().wheels - 1.0):
        # 10 000 numbers: mean within 4 sigma / 100, deviation within 4 sigma / sqrt(20 000)
        assert abs(off.mean()) < 4 * 0.5 / 100 and abs(off.std() - 0.5) < 4 * 0.5 / 141
    assert abs(np.corrcoef(back[:, 0], seen[:, 0])[0, 1]) < 0.08  # not the same noise; 4 / sqrt(2500)


def test_a_counted_wheel_of_steady_speed_is_exact_to_a_tick():
    counted, way = ToothCounter(ToothedWheel(teeth=100, tick=1e-6), RADIUS), 2 * np.pi * 0.5 / 100
    speeds = (20.0, 7.0, 3.0, 0.0)
    for i in range(40):
        shown = counted(of(i, speeds))
    # one tick in the time of the edges of one sample, or in that of one tooth where it takes longer
    for got, speed in zip(shown[:3], speeds[:3], strict=True):
        assert abs(got - speed) <= speed * 2e-6 / max(way / speed, SAMPLING_PERIOD - way / speed)
    assert counted(of(40, (20.0, 7.0, 3.0, 0.0)))[3] == 0.0


def test_a_wheel_that_stops_is_seen_to_fall_and_one_that_slows_is_followed():
    counted, way = ToothCounter(ToothedWheel(teeth=50), RADIUS), 2 * np.pi * 0.5 / 50
    shown = [counted(of(i, (10.0 if i < 4 else 0.0,) * 4))[0] for i in range(40)]
    assert all(b <= a for a, b in pairwise(shown[3:]))
    assert shown[-1] <= way / (34 * SAMPLING_PERIOD)  # at most one tooth since
    slowing = ToothCounter(ToothedWheel(teeth=100), RADIUS)
    for i in range(60):
        true = 20.0 - 8.0 * SAMPLING_PERIOD * i
        got = slowing(of(i, (true,) * 4))[0]
        # the mean since the edge before: at most a sample and two teeth old
        assert i < 2 or -1e-3 <= got - true <= 8.0 * (SAMPLING_PERIOD + 2 * way / true)


def test_a_missing_tooth_makes_one_dip_per_turn():
    teeth, turn = 20, 2 * np.pi * 0.5
    speed = turn / (20 * SAMPLING_PERIOD)  # one tooth per sample
    whole = ToothCounter(ToothedWheel(teeth=teeth), RADIUS)
    less = ToothCounter(ToothedWheel(teeth=teeth), RADIUS, lambda wheel, tooth, time: wheel == 1 and tooth == 5)
    rows = np.array([[*whole(of(i, (speed,) * 4))[:2], *less(of(i, (speed,) * 4))[:2]] for i in range(61)])[3:]
    assert np.allclose(rows[:, :3], speed, rtol=1e-3)
    assert (rows[:, 3] < 0.6 * speed).sum() in (3, 6)  # at the gap, and while it waits, in each of three turns


def test_lost_and_delayed_samples_and_stuck_valves():
    says = Says(lambda given: Command(valves=np.full(4, 1 if given.number < 5 else -1)))
    faults = [
        ControllerFault(kind="lost", start=2 * SAMPLING_PERIOD, end=4 * SAMPLING_PERIOD, wheels=[0]),
        ControllerFault(kind="delayed", start=3 * SAMPLING_PERIOD, samples=2, wheels=[1]),
        ControllerFault(kind="stuck", start=5 * SAMPLING_PERIOD, wheels=[2]),
        ControllerFault(kind="stuck", start=2 * SAMPLING_PERIOD, end=3 * SAMPLING_PERIOD, wheels=[3], state=0),
    ]
    faulty = FaultyController(says, faults)
    valves = np.array([faulty.sample(of(i, (float(i),) * 4)).valves for i in range(8)])
    seen = np.array([given.wheels for given in says.seen])
    assert seen[:, 0].tolist() == [0, 1, 1, 1, 4, 5, 6, 7]
    assert seen[:, 1].tolist() == [0, 1, 2, 1, 2, 3, 4, 5]
    assert seen[:, 2].tolist() == list(range(8))
    assert valves[:, 2].tolist() == [1] * 8 and valves[:, 1].tolist() == [1] * 5 + [-1] * 3
    assert valves[:, 3].tolist() == [1, 1, 0, 1, 1, -1, -1, -1]


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ({"callable": "a:B", "fmu": "c.fmu"}, "at most one of"),
        ({"callabel": "a:B"}, "callable"),
        ({"faults": [{"kind": "delayed"}]}, "needs samples"),
        ({"faults": [{"kind": "lost", "state": 1}]}, "no meaning"),
        ({"faults": [{"kind": "tooth", "tooth": 1}]}, "counted from teeth"),
        ({"signals": {"bits": 12}}, "together"),
        ({"timeout": 0.0}, "above 0"),
    ],
)
def test_a_table_that_cannot_be(table, told):
    with pytest.raises(InputError, match=told):
        read(PortTable, table, "scene.toml", "port")


def test_a_fault_of_a_wheel_that_is_not_there():
    table = PortTable(faults=[ControllerFault(kind="lost", wheels=[4])])
    with (
        pytest.raises(InputError, match="from 0 to 3"),
        controller_of_run(table, ControllerRunData(RADIUS, SAMPLING_PERIOD), Example(4)),
    ):
        pass


def test_a_callable_by_its_name(tmp_path):
    (tmp_path / "mine.py").write_text(
        "class Mine:\n    def __init__(self, wheels, x=1):\n        self.x = x\n"
        "    def sample(self, given):\n        return None\nNOT = 1\n"
    )
    assert named_controller("mine.py:Mine", tmp_path, 4, {"x": 3}).x == 3
    for name, told in (
        ("mine.py:Min", "did you mean 'Mine'"),
        ("mine.py", "must be"),
        ("no.py:A", "not loaded"),
        ("mine.py:NOT", "not made"),
        ("types:SimpleNamespace", "not made|no method"),
    ):
        with pytest.raises(InputError, match=told):
            named_controller(name, tmp_path, 4, {})


def test_a_controller_that_writes_into_its_question_does_not_change_the_log(tmp_path):
    def writes(given):
        given.wheels[:] = 0.0
        return Command(valves=np.ones(4, dtype=np.int64))

    with controller_of_run(
        PortTable(log="a.log"), ControllerRunData(RADIUS, SAMPLING_PERIOD, "s", tmp_path), Says(writes)
    ) as (own, _):
        own.sample(of())
    with controller_of_run(
        PortTable(replay="a.log"), ControllerRunData(RADIUS, SAMPLING_PERIOD, "s", tmp_path), Says(_raises)
    ) as (replayed, _):
        assert (replayed.sample(of()).valves == 1).all()


def test_a_scene_logs_and_replays_what_it_drives(tmp_path):
    base = {"system": "braking", "title": "t", "run": {"duration": 0.1}, "procedures": {"one": {"speed": 11.0}}}

    def driven(port, **more):
        return drive(build({**base, **more, "port": port}, "scene.toml", tmp_path), procedure="one").detail

    path = driven({"log": "{procedure}.log"}, controller={"kind": "slip_bang_bang"})
    again = driven({"replay": "one.log", "pace": "wall"})  # whatever controller the scene names: the log answers
    assert same(path, again) and "overruns" in again.clock and not path.clock
    with pytest.raises(InputError, match="another scene"):
        driven({"replay": "one.log"}, run={"duration": 0.2})
