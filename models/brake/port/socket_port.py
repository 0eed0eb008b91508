"""Controllers in a second process, over a TCP socket of this machine alone; ``frame`` defines the frames."""

import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from models.brake.controller import Command, Sample
from models.brake.port.ask import ControllerFailed
from models.brake.port.frame import ANSWER_LAYOUT, WrongFrame, command_of_answer, question_frame
from models.core.errors import InputError, RunFailed

LOOPBACK_ADDRESS = "127.0.0.1"
"""The only address at which the port listens: this machine."""
STANDARD_ERROR = 2
"""File number of standard error, to which a controller's prints go: standard output is for the results alone."""
START_REMEDY = "if it needs longer, give start (s) under [port]"
"""Text on the remedy where a controller does not connect in time."""
PROCESS_END_SECONDS = 0.5
"""Time (s) for a process to end by itself once its connection is closed at the end of a run."""


@dataclass
class SocketPort:
    """The controller at the other end of a connection; each answer must arrive completely within ``timeout`` seconds.

    process : that answers, if it was started here.
    """

    link: socket.socket
    timeout: float
    process: subprocess.Popen[bytes] | None = None

    def sample(self, sample: Sample) -> Command:
        """The command of the controller behind the socket for a sample; raises ControllerFailed."""
        end = time.perf_counter() + self.timeout
        try:
            self.link.settimeout(self.timeout)
            self.link.sendall(question_frame(sample))
            return command_of_answer(self._frame(sample, end), sample.number)
        except WrongFrame as error:
            raise ControllerFailed(sample, error.name, str(error)) from None
        except TimeoutError:
            raise ControllerFailed(sample, "silence", f"it does not read within {self.timeout:g} s") from None
        except OSError as error:
            raise ControllerFailed(
                sample,
                "crash",
                f"the connection broke: {error.strerror or error}{process_end_phrase(self.process, self.timeout)}",
            ) from None

    def _frame(self, sample: Sample, deadline: float) -> bytes:
        """Exactly one answer frame, received by a deadline; further bytes would answer a sample that has not been sent
        yet.
        """
        got = b""
        while len(got) < ANSWER_LAYOUT.size:
            try:
                received_part = self.link.recv(ANSWER_LAYOUT.size + 1 - len(got))
            except TimeoutError:
                received_part = None
            if received_part is None or time.perf_counter() > deadline:
                raise ControllerFailed(sample, "silence", f"{_received_bytes(got)} within {self.timeout:g} s")
            if not received_part:
                raise ControllerFailed(
                    sample,
                    "crash",
                    "the connection was closed after "
                    f"{_received_bytes(got)}{process_end_phrase(self.process, self.timeout)}",
                )
            got += received_part
            if len(got) < ANSWER_LAYOUT.size:
                self.link.settimeout(max(deadline - time.perf_counter(), 1e-6))
        if len(got) > ANSWER_LAYOUT.size:
            raise WrongFrame("wrong length", f"an answer of more than {ANSWER_LAYOUT.size} bytes")
        return got


def process_end_phrase(process: subprocess.Popen[bytes] | None, waiting_time: float) -> str:
    """Phrase on how a process with a closed connection ended; "" if it did not end within some tenths of a second."""
    if process is None:
        return ""
    with suppress(subprocess.TimeoutExpired):
        status = process.wait(min(waiting_time, PROCESS_END_SECONDS))
        return (
            f", its process ended with status {status}" if status >= 0 else f", its process got {_signal_name(-status)}"
        )
    return ""


def _signal_name(signal_number: int) -> str:
    with suppress(ValueError):
        return signal.Signals(signal_number).name
    return f"signal {signal_number}"


def _received_bytes(received: bytes) -> str:
    return f"{len(received)} of {ANSWER_LAYOUT.size} bytes" if received else "no answer"


@contextmanager
def listening_socket(port_number: int = 0) -> Iterator[socket.socket]:
    """A socket that waits for a controller at a port of this machine (0 for any free port); raises InputError."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as server:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            server.bind((LOOPBACK_ADDRESS, port_number))
        except OSError as error:
            raise InputError("", "port", port_number, f"cannot be listened on: {error.strerror}") from None
        server.listen(1)
        yield server


@contextmanager
def controller_behind_socket(
    command_words: Sequence[str] | None,
    port_number: int,
    timeout: float,
    start_seconds: float,
    working_folder: Path = Path(),
) -> Iterator[SocketPort]:
    """A controller behind a socket, as a context manager: started by a command, or connecting by itself.

    command_words : the command, in which "{port}" stands for the number of the port; None waits for a controller that
    somebody else starts; start_seconds : seconds until it must have connected; working_folder : in which the command
    runs. However the block ends, no process of it stays. Raises InputError for a command that cannot be started,
    RunFailed where none connects.
    """
    with (
        listening_socket(port_number) as server,
        _started_process(command_words, server.getsockname()[1], working_folder) as process,
    ):
        link = _accepted_connection(server, process, start_seconds)
        with link:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            yield SocketPort(link, timeout, process)


def _accepted_connection(
    server_socket: socket.socket, process: subprocess.Popen[bytes] | None, start_seconds: float
) -> socket.socket:
    """The first connection to ``server_socket`` within ``start_seconds`` seconds, while the process runs."""
    end = time.perf_counter() + start_seconds
    server_socket.settimeout(min(0.05, start_seconds))
    while time.perf_counter() < end:
        with suppress(TimeoutError):
            return server_socket.accept()[0]
        status = None if process is None else process.poll()
        if status is not None:
            raise RunFailed("controller", f"crash: its command ended with status {status} before it connected")
    address = f"{LOOPBACK_ADDRESS}:{server_socket.getsockname()[1]}"
    raise RunFailed("controller", f"silence: nobody connected to {address} within {start_seconds:g} s; {START_REMEDY}")


@contextmanager
def _started_process(
    command: Sequence[str] | None, port_number: int, working_folder: Path
) -> Iterator[subprocess.Popen[bytes] | None]:
    """The running process of a command, as a context manager that ends the process."""
    if command is None:
        yield None
        return
    command_words = [word.replace("{port}", str(port_number)) for word in command]
    try:
        process = subprocess.Popen(
            command_words, cwd=working_folder, stdin=subprocess.DEVNULL, stdout=STANDARD_ERROR, start_new_session=True
        )
    except OSError as error:
        raise InputError("", "command", list(command), f"cannot be started: {error.strerror}") from None
    grace = 0.0
    try:
        yield process
        grace = PROCESS_END_SECONDS
    finally:
        _wait_for_end(process, grace)


def _wait_for_end(process: subprocess.Popen[bytes], waiting_time: float) -> None:
    """Wait ``waiting_time`` seconds for the process to end; then kill it and all processes that it started."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(waiting_time)
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
    process.wait()
