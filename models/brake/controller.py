"""Interface between a vehicle and a brake controller, which is called once per sample and returns commands to the
valves.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

SAMPLING_PERIOD = 0.0055
"""Time (s) between two controller samples: the paper's, 182 samples per second."""
RELEASE, HOLD, APPLY, SLOW = -1, 0, 1, 2
"""Valve commands: release, hold, apply, and apply slowly, the last one only where the scene has such valves."""
LARGEST_PRESSURE = 300.0
"""Largest brake pressure (bar) that is accepted: road vehicles have some 10 with air and 200 with fluid."""


class Sample(NamedTuple):
    """Signals that a brake controller receives at a sample.

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
    """Command of a brake controller: states (W,) of the valves, or instead pressures (W,) in bar."""

    valves: np.ndarray | None = None
    pressures: np.ndarray | None = None


class Controller(Protocol):
    """Protocol of a brake controller, whatever program or process it runs in.

    A class that has ``steady = True`` beside its ``sample`` answers alike to every sample in which the switch is
    closed, and is asked once.
    """

    def sample(self, sample: Sample) -> Command:
        """The controller's command for a sample."""
        ...


def is_steady(controller: Controller) -> bool:
    """Whether the controller needs to be called only once, as its command never changes. A derived class with its own
    ``sample`` is not steady merely because its base class is.
    """
    declared: Mapping[str, object] = next(
        (vars(kind) for kind in type(controller).__mro__ if "sample" in vars(kind)), {}
    )
    return bool(declared.get("steady", False))


@dataclass(frozen=True, eq=False)
class ConstantPressures:
    """Controller that commands constant pressures (W,) in bar, as in a test without anti-lock system."""

    pressures: np.ndarray
    steady: ClassVar[bool] = True

    def sample(self, sample: Sample) -> Command:
        """The same pressures (W,) in bar at every sample."""
        return Command(pressures=self.pressures)


@dataclass(frozen=True)
class NoAntiLock:
    """Controller without anti-lock function: every valve stays open while the driver brakes."""

    wheels: int
    steady: ClassVar[bool] = True

    def sample(self, sample: Sample) -> Command:
        """Commands that open all valves while the brake switch is closed, else release all brakes."""
        return Command(valves=np.full(self.wheels, APPLY if sample.brake else RELEASE))
