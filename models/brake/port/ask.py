"""One exchange with a controller: its command is checked, and any fault of the controller ends the run with one named
error.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from traceback import extract_tb

import numpy as np

from models.brake.controller import APPLY, HOLD, LARGEST_PRESSURE, RELEASE, SLOW, Command, Controller, Sample
from models.core.errors import RunFailed

FAULT_NAMES = (
    "crash",
    "silence",
    "wrong length",
    "wrong frame",
    "wrong number",
    "not a number",
    "no state of a valve",
    "below zero",
    "too high",
)
"""Names of what a controller can do wrong: it raised, died or closed; did not answer in time; answered with too little
or too much; with what is no answer frame; to another sample; with a value that is no finite number; with a valve in
none of -1, 0, 1, or 2 where there are such valves; with a pressure below zero, or above the supply pressure.
"""

VALVE_STATES = frozenset((RELEASE, HOLD, APPLY))
STATES_WITH_SLOW_APPLY = VALVE_STATES | {SLOW}
"""Allowed states of valves that can also apply slowly."""


SUPPLY_ROUNDING = 1e-9
"""Share by which a pressure may exceed the supply pressure."""
PORT_FOLDER = Path(__file__).parent
LONGEST_ERROR_TEXT = 500
"""Largest number of characters of an error's text that are reported."""


class ControllerFailed(RunFailed):
    """Error of a controller that gave no command, or one that cannot be used. name : one of ``FAULT_NAMES``; number :
    of the sample; why : the fault, as a phrase.
    """

    def __init__(self, sample: Sample, fault_name: str, reason: str) -> None:
        reason = " ".join(reason.encode(errors="backslashreplace").decode().split())[:LONGEST_ERROR_TEXT]
        self.name, self.number, self.why = fault_name, sample.number, reason
        super().__init__("controller", f"sample {sample.number}: {fault_name}: {reason}", 1e-9 * sample.time)


def checked_command(
    controller: Controller,
    sample: Sample,
    allowed_states: frozenset[int] = VALVE_STATES,
    maximum_pressure: float = LARGEST_PRESSURE,
) -> Command:
    """A controller's command for a sample, after checks; maximum_pressure : largest pressure (bar) allowed.

    Raises ControllerFailed, whatever the controller raises.
    """
    try:
        command = controller.sample(sample)
    except RunFailed:
        raise
    except (Exception, SystemExit) as error:
        raise ControllerFailed(sample, "crash", exception_text(error)) from error
    return usable_command(command, sample, allowed_states, maximum_pressure)


def exception_text(exception: BaseException) -> str:
    """Type and text of an exception, and the line of the user's file in which it was raised, or which called the code
    that raised it.
    """
    lines = [
        frame
        for frame in extract_tb(exception.__traceback__)
        if "site-packages" not in frame.filename and Path(frame.filename).parent != PORT_FOLDER
    ]
    source_line = f" ({Path(lines[-1].filename).name}, line {lines[-1].lineno})" if lines else ""
    return f"{type(exception).__name__}: {exception}"[: LONGEST_ERROR_TEXT - len(source_line)] + source_line


@dataclass
class CheckedController:
    """A controller whose commands are checked before they are used."""

    controller: Controller
    states: frozenset[int] = VALVE_STATES

    def sample(self, sample: Sample) -> Command:
        """The controller's checked command for a sample; raises ControllerFailed."""
        return checked_command(self.controller, sample, self.states, sample.supply)


def usable_command(
    command: Command,
    sample: Sample,
    allowed_states: frozenset[int] = VALVE_STATES,
    maximum_pressure: float = LARGEST_PRESSURE,
) -> Command:
    """The controller's command, if it has exactly one valve state or one pressure per wheel; else raises
    ControllerFailed.
    """
    if not isinstance(command, Command) or (command.valves is None) == (command.pressures is None):
        raise ControllerFailed(sample, "wrong frame", "needs either valves or pressures")
    valves = command.valves
    valve_states = valves if isinstance(valves, np.ndarray) and valves.dtype == np.int64 else None
    if (
        valve_states is not None
        and valve_states.shape == sample.wheels.shape
        and allowed_states.issuperset(valve_states.tolist())
    ):
        return command
    values = _command_array(command.pressures if command.valves is None else command.valves, sample)
    for value in values.tolist():
        if not math.isfinite(value):
            raise ControllerFailed(sample, "not a number", f"{value:g} for a wheel")
        if command.pressures is not None and value < 0.0:
            raise ControllerFailed(sample, "below zero", f"a pressure of {value:g} bar")
        if command.pressures is not None and value > maximum_pressure * (1.0 + SUPPLY_ROUNDING):
            raise ControllerFailed(
                sample, "too high", f"a pressure of {value:g} bar, above the {maximum_pressure:g} bar that there are"
            )
        if command.valves is not None and value not in allowed_states:
            raise ControllerFailed(
                sample, "no state of a valve", f"{value:g} is none of {_states_text(allowed_states)}"
            )
    return Command(pressures=values) if command.valves is None else Command(valves=values.astype(np.int64))


def _states_text(allowed_states: frozenset[int]) -> str:
    return ", ".join(map(str, sorted(allowed_states)))


def _command_array(command_values: object, sample: Sample) -> np.ndarray:
    """Values (W,) of a command as numbers; raises ControllerFailed where they are not one number per wheel."""
    if np.ma.is_masked(command_values):
        raise ControllerFailed(sample, "not a number", "a masked value for a wheel")
    try:
        array = np.asarray(command_values)
        if array.dtype.kind == "c":
            raise TypeError("complex numbers")
        array = array.astype(float)
    except (TypeError, ValueError) as error:
        raise ControllerFailed(sample, "wrong frame", str(error)) from None
    if array.shape != sample.wheels.shape:
        size = " x ".join(map(str, array.shape)) or "one"
        raise ControllerFailed(sample, "wrong length", f"{size} values for {sample.wheels.size} wheels")
    return array
