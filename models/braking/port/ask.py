"""One exchange with a controller: whatever it does wrong ends the run in one named error."""

import math
from dataclasses import dataclass

import numpy as np

from models.braking.controller import LARGEST_PRESSURE, Command, Controller, Sample
from models.braking.pressure import APPLY, HOLD, RELEASE
from models.errors import RunFailed

NAMES = ("crash", "silence", "wrong length", "wrong frame", "wrong number", "not a number", "no state of a valve",
         "below zero", "too high")  # fmt: skip
"""What a controller can do wrong: it raised, died or closed; did not answer in time; answered with too little or too
much; what is no answer frame; to another sample; with what is no finite number; with a valve in none of
-1, 0, 1; with a pressure below none, or above what any brake holds."""

STATES = frozenset((RELEASE, HOLD, APPLY))


class ControllerFailed(RunFailed):
    """A controller did not answer, or not with what can be done. name : one of ``NAMES``; number : of the sample."""

    def __init__(self, given: Sample, name: str, reason: str) -> None:
        self.name, self.number = name, given.number
        super().__init__("controller", f"sample {given.number}: {name}: {reason}", 1e-9 * given.time)


def ask(controller: Controller, given: Sample) -> Command:
    """A controller's answer, checked. Raises ControllerFailed, whatever the controller raises."""
    try:
        command = controller.sample(given)
    except RunFailed:
        raise
    except (Exception, SystemExit) as error:
        raise ControllerFailed(given, "crash", f"{type(error).__name__}: {error}") from error
    return checked(command, given)


@dataclass
class Asked:
    """A controller whose answers are checked before anything is done with them."""

    inner: Controller

    def sample(self, given: Sample) -> Command:
        """Its answer; raises ControllerFailed."""
        return ask(self.inner, given)


def checked(command: Command, given: Sample) -> Command:
    """The same answer if each wheel has one state of its valve or one pressure; raises ControllerFailed."""
    if not isinstance(command, Command) or (command.valves is None) == (command.pressures is None):
        raise ControllerFailed(given, "wrong frame", "needs either valves or pressures")
    valves = command.valves
    whole = valves if isinstance(valves, np.ndarray) and valves.dtype == np.int64 else None
    if whole is not None and whole.shape == given.wheels.shape and STATES.issuperset(whole.tolist()):
        return command
    values = _array(command.pressures if command.valves is None else command.valves, given)
    for value in values.tolist():
        if not math.isfinite(value):
            raise ControllerFailed(given, "not a number", f"{value:g} for a wheel")
        if command.pressures is not None and value < 0.0:
            raise ControllerFailed(given, "below zero", f"a pressure of {value:g} bar")
        if command.pressures is not None and value > LARGEST_PRESSURE:
            raise ControllerFailed(given, "too high", f"a pressure of {value:g} bar, above {LARGEST_PRESSURE:g} bar")
        if command.valves is not None and value not in STATES:
            raise ControllerFailed(given, "no state of a valve", f"{value:g} is none of -1, 0, 1")
    return Command(pressures=values) if command.valves is None else Command(valves=values.astype(np.int64))


def _array(values: object, given: Sample) -> np.ndarray:
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise ControllerFailed(given, "wrong frame", str(error)) from None
    if array.shape != given.wheels.shape:
        size = " x ".join(map(str, array.shape)) or "one"
        raise ControllerFailed(given, "wrong length", f"{size} values for {given.wheels.size} wheels")
    return array
