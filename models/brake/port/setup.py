"""Set-up of the controller port from a scene: the controller behind it, its signals, faults, log and clock; opened for
one run.
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from models.brake.controller import Controller
from models.brake.port import socket_port
from models.brake.port.ask import STATES_WITH_SLOW_APPLY, VALVE_STATES, CheckedController
from models.brake.port.faults import ControllerFault, FaultyController, missing_teeth
from models.brake.port.host import HostedController
from models.brake.port.hosted import controller_in_process
from models.brake.port.log import ReplayedController, log_refusal, logged_controller, scene_hash
from models.brake.port.pace import WallClockController
from models.brake.port.sensors import SensorConversion, controller_behind_sensors
from models.brake.port.teeth import ToothCounter, ToothedWheel
from models.core.errors import InputError
from models.core.strict import Strict, quantity

PORT_KEYS = ("callable", "command", "port", "fmu", "replay")
"""Keys for what can stand behind the port in place of the scene's controller; at most one is given."""
MANUAL_CONNECTION_SECONDS = 20.0
"""Time (s) within which a process that somebody starts by hand must connect to a port, where the scene does not say."""


class PortTable(Strict):
    """[port]: the controller behind the port, its signals, faults and log. Paths start from the scene's folder;
    {procedure} in them is the name of the simulated procedure, {engine} that of the engine.
    """

    callable: str | None = Field(default=None, description="module:Name or file.py:Name, a class")
    parameters: dict[str, Any] = Field(
        default_factory=dict, description="keyword arguments with which the callable is made"
    )
    command: list[str] | None = Field(default=None, min_length=1, description="starts a process that connects")
    port: int | None = Field(default=None, ge=1, le=65535, description="of this machine, at which a process connects")
    fmu: str | None = Field(default=None, description="an FMU file, FMI 2 co-simulation")
    replay: str | None = Field(default=None, description="a log of this scene")
    timeout: float = quantity("s", "for one answer", default=1.0)
    start: float | None = quantity(
        "s", "for a command to connect, for a callable or an FMU to be made; as timeout if not given", default=None
    )
    pace: Literal["simulated", "wall"] = Field(default="simulated", description="simulated, or wall: the clock's")
    log: str | None = Field(default=None, description="file to which every exchange is written")
    signals: SensorConversion = SensorConversion()
    pressures: SensorConversion = SensorConversion()
    teeth: ToothedWheel | None = Field(
        default=None, description="signals are counted from teeth; not named, they are known"
    )
    faults: list[ControllerFault] = Field(default_factory=list, description="on demand")

    @property
    def patience(self) -> float:
        """Time (s) within which the controller must be ready."""
        if self.start is not None:
            return self.start
        return self.timeout if self.port is None else MANUAL_CONNECTION_SECONDS

    @model_validator(mode="after")
    def _one_behind(self) -> "PortTable":
        named = [key for key in PORT_KEYS if getattr(self, key) is not None]
        if len(named) > 1:
            raise ValueError(f"at most one of {', '.join(PORT_KEYS)} can be there, not {' and '.join(named)}")
        if self.parameters and self.callable is None:
            raise ValueError("parameters has no meaning without callable")
        if self.teeth is None and any(fault.kind == "tooth" for fault in self.faults):
            raise ValueError("a missing tooth needs signals that are counted from teeth")
        return self


@dataclass(frozen=True)
class ControllerRunData:
    """Data of a run that the port needs. radius (W,): of the wheels, m; sample: s; scene: its text, which identifies
    logs; folder: from which paths start; file: name of the scene, for messages; procedure, engine: names that file
    names may contain; slow: whether valves can apply slowly.
    """

    radius: np.ndarray
    sample: float
    scene: str = ""
    folder: Path = Path()
    file: str = ""
    procedure: str = ""
    engine: str = ""
    slow: bool = False

    def path(self, file_name: str) -> Path:
        """Path of a file that the scene's port table names."""
        return self.folder / file_name.replace("{procedure}", self.procedure).replace("{engine}", self.engine)


@contextmanager
def controller_of_run(
    port_table: PortTable, controller_run: ControllerRunData, controller: Controller
) -> Iterator[tuple[Controller, WallClockController | None]]:
    """The controller of one run as a context manager, and its wall clock if it is paced by one.

    controller : stands behind the port if the table names nothing else. Raises InputError, RunFailed.
    """
    check_port(port_table, controller_run)
    with ExitStack() as stack:
        inner = CheckedController(
            stack.enter_context(_possible_controllers(port_table, controller_run, controller)),
            STATES_WITH_SLOW_APPLY if controller_run.slow else VALVE_STATES,
        )
        clock = WallClockController(inner, controller_run.sample) if port_table.pace == "wall" else None
        watched: Controller = inner if clock is None else clock
        if port_table.log is not None:
            watched = stack.enter_context(
                logged_controller(watched, controller_run.path(port_table.log), scene_hash(controller_run.scene))
            )
        faulty = FaultyController(watched, port_table.faults) if port_table.faults else watched
        teeth = (
            None
            if port_table.teeth is None
            else ToothCounter(port_table.teeth, controller_run.radius, partial(missing_teeth, port_table.faults))
        )
        plain = teeth is None and port_table.signals == port_table.pressures == SensorConversion()
        wheels = controller_run.radius.size
        yield (
            faulty
            if plain
            else controller_behind_sensors(
                faulty, wheels, port_table.signals, port_table.pressures, tooth_counter=teeth
            ),
            clock,
        )


@contextmanager
def _possible_controllers(
    port_table: PortTable, controller_run: ControllerRunData, controller: Controller
) -> Iterator[Controller]:
    """The controller that the table names, as a context manager: behind a socket, in a hosted process or a replayed
    log; else ``controller``.
    """
    with ExitStack() as stack:
        if port_table.command is not None or port_table.port is not None:
            with _errors_of_scene_key(port_table, controller_run):
                link = socket_port.controller_behind_socket(
                    port_table.command,
                    port_table.port or 0,
                    port_table.timeout,
                    port_table.patience,
                    controller_run.folder,
                )
                entered = stack.enter_context(link)
            yield entered
        elif port_table.replay is not None:
            with _errors_of_scene_key(port_table, controller_run):
                replay = ReplayedController(controller_run.path(port_table.replay), scene_hash(controller_run.scene))
            yield replay
        elif port_table.callable is not None or port_table.fmu is not None:
            folder = (
                controller_run.folder if port_table.fmu is None else Path(stack.enter_context(TemporaryDirectory()))
            )
            fmu = None if port_table.fmu is None else controller_run.path(port_table.fmu).absolute()
            guest = HostedController(
                port_table.callable,
                fmu,
                folder,
                controller_run.radius.size,
                controller_run.sample,
                port_table.parameters,
                controller_run.file,
            )
            with _errors_of_scene_key(port_table, controller_run):
                made = stack.enter_context(controller_in_process(guest, port_table.timeout, port_table.patience))
            yield made
        else:
            yield controller


@contextmanager
def _errors_of_scene_key(port_table: PortTable, controller_run: ControllerRunData) -> Iterator[None]:
    """Context that converts errors about a named controller into errors about the scene's key; errors inside a file
    name that file.
    """
    try:
        yield
    except InputError as error:
        if error.place not in PORT_KEYS:
            raise
        raise InputError(
            controller_run.file, f"port.{error.place}", getattr(port_table, error.place), error.allowed
        ) from None


def check_port(port_table: PortTable, controller_run: ControllerRunData) -> None:
    """Refuse files that do not exist or would be overwritten, and faults of wheels or teeth that do not exist."""
    for key in ("fmu", "replay"):
        name = getattr(port_table, key)
        if name is not None and not controller_run.path(name).is_file():
            raise InputError(
                controller_run.file,
                f"port.{key}",
                name,
                f"no such file, looked for as {str(controller_run.path(name))!r}",
            )
    if port_table.fmu is not None and find_spec("fmpy") is None:
        raise InputError(controller_run.file, "port.fmu", port_table.fmu, "needs fmpy: pip install 'twinrig[fmi]'")
    reason = "" if port_table.log is None else log_refusal(controller_run.path(port_table.log))
    if reason:
        raise InputError(controller_run.file, "port.log", port_table.log, reason)
    wheels = controller_run.radius.size
    for i, fault in enumerate(port_table.faults):
        for wheel in fault.affected_wheels(wheels):
            if not 0 <= wheel < wheels:
                raise InputError(
                    controller_run.file, f"port.faults.{i}.wheels", wheel, f"must be from 0 to {wheels - 1}"
                )
        if fault.tooth is not None and port_table.teeth is not None and fault.tooth >= port_table.teeth.teeth:
            raise InputError(
                controller_run.file, f"port.faults.{i}.tooth", fault.tooth, f"must be below {port_table.teeth.teeth}"
            )
