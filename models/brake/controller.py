"""The port between a vehicle and a brake controller, which is asked once per sample and answers with commands to
valves."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

SAMPLE = 0.0055
"""Time between two samples (s): the paper's, 182 a second."""
RELEASE, HOLD, APPLY, SLOW = -1, 0, 1, 2
"""States of a valve; the last, apply slowly, only where the scene has such valves."""
LARGEST_PRESSURE = 300.0
"""bar; no brake of a road vehicle holds more, by air some 10 and by fluid 200."""


class Sample(NamedTuple):
    """The signals that a controller receives at a sample.

    number : of the sample, from 0; time : ns since the start; wheels (W,) : wheel-speed signals times the wheel's
    radius (m/s), never negative, as a toothed wheel does not tell which way it turns; brake : whether the switch at the
    pedal is closed; supply : pressure (bar); speed : of the vehicle (m/s) if the scene gives it away, else not a
    number.
    """

    number: int
    time: int
    wheels: np.ndarray
    brake: bool
    supply: float
    speed: float


class Command(NamedTuple):
    """A controller's answer to a sample: states (W,) of the valves, or instead pressures (W,) in bar."""

    valves: np.ndarray | None = None
    pressures: np.ndarray | None = None


class Controller(Protocol):
    """Protocol of a brake controller, whatever program or process it runs in.

    A class that has ``steady = True`` beside its ``sample`` answers alike to every sample in which the switch is
    closed, and is asked once.
    """

    def sample(self, sample: Sample) -> Command:
        """The controller's commands for a sample."""
        ...


def is_steady(controller: Controller) -> bool:
    """Whether the controller needs to be asked only once. A derived class with its own ``sample`` is not steady merely
    because its base class is."""
    declared: Mapping[str, object] = next(
        (vars(kind) for kind in type(controller).__mro__ if "sample" in vars(kind)), {}
    )
    return bool(declared.get("steady", False))


@dataclass(frozen=True, eq=False)
class Pressures:
    """Pressures (W,) in bar that stay, as on a test without anti-lock system."""

    pressures: np.ndarray
    steady: ClassVar[bool] = True

    def sample(self, sample: Sample) -> Command:
        """The same pressures at every sample."""
        return Command(pressures=self.pressures)


@dataclass(frozen=True)
class AllApplied:
    """No anti-lock system: every valve stays open."""

    wheels: int
    steady: ClassVar[bool] = True

    def sample(self, sample: Sample) -> Command:
        """Commands that open all valves."""
        return Command(valves=np.full(self.wheels, APPLY if sample.brake else RELEASE))
