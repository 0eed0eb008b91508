"""Controllers, a callable or an FMU, in a separate process, which is ended after a time limit whatever the controller
does.

So a controller that never returns, whatever it catches, or that takes its process with it, ends the run in one named
error. The process is started once per run, before anything of the controller is timed: its start-up is our own. An
exchange costs the way there and back.
"""

import json
import pickle
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from socket import socket
from typing import Any

from models.brake.controller import Command, Sample
from models.brake.port.ask import FAULT_NAMES, ControllerFailed
from models.brake.port.frame import ANSWER_LAYOUT, WrongFrame, command_of_answer, question_frame
from models.brake.port.host import FAILURE_MARK, HEAD_LAYOUT, LENGTH_LAYOUT, READY_MARK, HostedController
from models.brake.port.socket_port import START_REMEDY, controller_behind_socket, process_end_phrase
from models.core.errors import InputError, RunFailed

FAILURE_TEXT_BYTES = 100_000
"""Largest number of bytes of a process's report on its failure."""
STARTUP_SECONDS = 30.0
"""Time (s) within which the process must be ready, before it touches the controller."""


class ProcessFailed(Exception):
    """Failure reported by the controller's process; what : its details as a table."""

    def __init__(self, failure_report: dict[str, Any]) -> None:
        self.what = failure_report
        super().__init__()


@dataclass
class ProcessController:
    """A controller in a separate process; each answer must arrive within ``timeout`` seconds."""

    link: socket
    process: subprocess.Popen[bytes] | None
    timeout: float

    def begin(self, hosted_controller: HostedController, start_seconds: float) -> None:
        """Let the process make the controller within ``start_seconds`` seconds; raises InputError, RunFailed."""
        text = pickle.dumps(hosted_controller)
        try:
            self._receive(LENGTH_LAYOUT.pack(len(text)) + text, HEAD_LAYOUT.size, READY_MARK, STARTUP_SECONDS)
            self._receive(b"", HEAD_LAYOUT.size, READY_MARK, start_seconds)
        except ProcessFailed as error:
            raise _error_of_failure(error.what) from None
        except TimeoutError:
            raise RunFailed(
                "controller", f"silence: it was not made within {start_seconds:g} s; {START_REMEDY}"
            ) from None
        except (OSError, EOFError):
            raise RunFailed(
                "controller", f"crash: it ended as it was made{process_end_phrase(self.process, self.timeout)}"
            ) from None

    def sample(self, sample: Sample) -> Command:
        """The command of the controller in the other process for a sample; raises ControllerFailed."""
        try:
            return command_of_answer(
                self._receive(question_frame(sample), ANSWER_LAYOUT.size, b"", self.timeout), sample.number
            )
        except WrongFrame as error:
            raise ControllerFailed(sample, error.name, str(error)) from None
        except ProcessFailed as error:
            name = str(error.what.get("name"))
            raise ControllerFailed(
                sample, name if name in FAULT_NAMES else "crash", str(error.what.get("reason"))
            ) from None
        except TimeoutError:
            raise ControllerFailed(sample, "silence", f"no answer within {self.timeout:g} s") from None
        except (OSError, EOFError):
            lost = f"the controller was lost{process_end_phrase(self.process, self.timeout)}"
            raise ControllerFailed(sample, "crash", lost) from None

    def _receive(self, question_bytes: bytes, byte_count: int, expected_start: bytes, time_limit: float) -> bytes:
        """Bytes that the process sends back within ``time_limit`` (s); raises ProcessFailed, TimeoutError, OSError,
        EOFError.
        """
        end = time.perf_counter() + time_limit
        self.link.settimeout(time_limit)
        self.link.sendall(question_bytes)
        got = self._receive_more(b"", byte_count, end)
        if got[:4] == FAILURE_MARK:
            length = HEAD_LAYOUT.unpack_from(got)[1]
            raise ProcessFailed(
                json.loads(
                    self._receive_more(got, min(HEAD_LAYOUT.size + length, FAILURE_TEXT_BYTES), end)[HEAD_LAYOUT.size :]
                )
            )
        if not got.startswith(expected_start):
            raise EOFError
        return got

    def _receive_more(self, bytes_so_far: bytes, byte_count: int, deadline: float) -> bytes:
        """All bytes received until ``byte_count`` bytes are there, or until a complete, shorter frame reports a
        failure.
        """
        while len(bytes_so_far) < byte_count and not (
            bytes_so_far[:4] == FAILURE_MARK and HEAD_LAYOUT.size <= len(bytes_so_far) == _failure_length(bytes_so_far)
        ):
            received_part = self.link.recv(byte_count - len(bytes_so_far))
            left = deadline - time.perf_counter()
            if left <= 0.0:
                raise TimeoutError
            if not received_part:
                raise EOFError
            bytes_so_far += received_part
            if len(bytes_so_far) < byte_count:
                self.link.settimeout(left)
        return bytes_so_far


def _failure_length(received: bytes) -> int:
    """Length (bytes) of the frame that reports a failure, read from its head."""
    return HEAD_LAYOUT.size + int(HEAD_LAYOUT.unpack_from(received)[1])


def _error_of_failure(failure_report: dict[str, Any]) -> InputError | RunFailed:
    """The failure that a process reports, as the error to raise."""
    if "place" not in failure_report:
        return RunFailed("controller", f"{failure_report.get('name')}: {failure_report.get('reason')}")
    return InputError(
        failure_report["file"],
        failure_report["place"],
        failure_report["value"],
        failure_report["allowed"],
        tuple(failure_report["choices"]),
    )


@contextmanager
def controller_in_process(
    hosted_controller: HostedController, timeout: float, start_seconds: float
) -> Iterator[ProcessController]:
    """The controller of a ``HostedController`` in a separate process, as a context manager; start_seconds : time (s)
    allowed for making it.

    However the block ends, no process of it stays. Raises InputError, RunFailed.
    """
    code = f"import sys; sys.path[:] = {sys.path!r}; from models.brake.port.host import main; main(int(sys.argv[1]))"
    with controller_behind_socket([sys.executable, "-c", code, "{port}"], 0, timeout, STARTUP_SECONDS) as port:
        host = ProcessController(port.link, port.process, timeout)
        host.begin(hosted_controller, start_seconds)
        yield host
