"""Program of the separate process in which a controller, a callable or an FMU, runs alone.

It connects, receives the description of the controller, reports that it is ready to make it, reports that the
controller is made, and answers frame by frame as ``frame`` documents. A failure is reported as a frame with a text.
"""

import json
import pickle
import socket
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from models.brake.controller import Controller
from models.brake.port.ask import STATES_WITH_SLOW_APPLY, ControllerFailed, checked_command, exception_text
from models.brake.port.frame import QUESTION_LAYOUT, answer_frame, sample_of_question
from models.brake.port.socket_port import LOOPBACK_ADDRESS
from models.core.errors import InputError

LENGTH_LAYOUT, READY_MARK, FAILURE_MARK = struct.Struct("<Q"), b"TRR1", b"TRE1"
HEAD_LAYOUT = struct.Struct("<4sI")


class HostedController(NamedTuple):
    """Description of a controller that a separate process creates: "module:Name" or "file.py:Name" of a callable, or
    the path of an FMU.

    folder : of the callable's path, or to which the FMU is unpacked; wheels : their number; sample : s; parameters : of
    the callable; file : of the scene, for messages.
    """

    callable: str | None
    fmu: Path | None
    folder: Path
    wheels: int
    sample: float
    parameters: dict[str, Any]
    file: str


@contextmanager
def controller_from_description(hosted_controller: HostedController) -> Iterator[Controller]:
    """The controller that ``hosted_controller`` describes, as a context manager; raises InputError."""
    if hosted_controller.fmu is not None:
        from models.brake.port.fmu_port import opened_fmu

        with opened_fmu(
            hosted_controller.fmu, hosted_controller.folder, hosted_controller.wheels, hosted_controller.sample
        ) as fmu:
            yield fmu
    else:
        from models.brake.port.callable import named_controller

        yield named_controller(
            str(hosted_controller.callable),
            hosted_controller.folder,
            hosted_controller.wheels,
            hosted_controller.parameters,
            hosted_controller.file,
        )


def failure_frame(**failure: Any) -> bytes:
    """Frame that reports a failure, with its details as JSON."""
    text = json.dumps(failure, default=str).encode()
    return HEAD_LAYOUT.pack(FAILURE_MARK, len(text)) + text


def serve_hosted_controller(connection: socket.socket) -> None:
    """Make the controller that the simulation's process describes, and answer samples until the connection closes."""
    with connection.makefile("rb") as reader:
        guest = pickle.loads(reader.read(LENGTH_LAYOUT.unpack(reader.read(LENGTH_LAYOUT.size))[0]))
        if guest.fmu is not None:
            import fmpy.fmi2  # noqa: F401 the library's time is none of the FMU's
        connection.sendall(HEAD_LAYOUT.pack(READY_MARK, 0))
        with controller_from_description(guest) as controller:
            connection.sendall(HEAD_LAYOUT.pack(READY_MARK, 0))
            while len(frame := reader.read(QUESTION_LAYOUT.size)) == QUESTION_LAYOUT.size:
                sample = sample_of_question(frame)
                connection.sendall(
                    answer_frame(sample.number, checked_command(controller, sample, STATES_WITH_SLOW_APPLY))
                )


def main(port_number: int) -> None:
    """Serve a controller at a port of this machine; any exception is reported to the simulation's process if
    possible.
    """
    with socket.create_connection((LOOPBACK_ADDRESS, port_number)) as link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            serve_hosted_controller(link)
            return
        except ControllerFailed as error:
            failure = failure_frame(name=error.name, reason=error.why)
        except InputError as error:
            failure = failure_frame(
                file=error.file, place=error.place, value=error.value, allowed=error.allowed, choices=error.choices
            )
        except BaseException as error:
            failure = failure_frame(name="crash", reason=exception_text(error))
        with suppress(OSError):  # nobody is left to hear it
            link.sendall(failure)


if __name__ == "__main__":
    main(int(sys.argv[1]))
