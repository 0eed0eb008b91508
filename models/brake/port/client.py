"""Client of the socket port for controllers in Python: ``python -m models.brake.port.client module:Name PORT``."""

import socket
import sys
from pathlib import Path

from models.brake.controller import Controller
from models.brake.port.callable import named_controller
from models.brake.port.frame import QUESTION_LAYOUT, answer_frame, sample_of_question
from models.brake.port.socket_port import LOOPBACK_ADDRESS


def serve_controller_at_port(controller: Controller, port_number: int) -> int:
    """Connect a controller to a port of this machine and answer every sample until the connection closes.

    Returns the number of answers.
    """
    count = 0
    with socket.create_connection((LOOPBACK_ADDRESS, port_number)) as link, link.makefile("rb") as reader:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while len(frame := reader.read(QUESTION_LAYOUT.size)) == QUESTION_LAYOUT.size:
            sample = sample_of_question(frame)
            link.sendall(answer_frame(sample.number, controller.sample(sample)))
            count += 1
    return count


def serve_named_controller(callable_path: str, port_number: str, wheel_count: str = "4") -> None:
    """Serve the controller ``callable_path`` at a port of this machine, for a number of wheels."""
    serve_controller_at_port(named_controller(callable_path, Path(), int(wheel_count), {}), int(port_number))


if __name__ == "__main__":
    serve_named_controller(*sys.argv[1:])
