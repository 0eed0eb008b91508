"""A wheel brake: torque from chamber pressure, with push-out pressure, hysteresis, and separate gradients for rising
and falling pressure.

Torque rises along ``rising`` (p - push_out) and falls along ``falling`` (p - release), and between these two lines it
stays: T = max(up(p), min(down(p), T)). The upper line is the one on which pressure falls, so that the loop is run
through in the sense of friction, with the area between the lines, and torque never changes its sign. Source of the
form: the paper's brake model "includes pushout pressure and hysteresis", and "different gradients when pressure is
rising and decreasing".
"""

from typing import NamedTuple

import numpy as np
from pydantic import model_validator

from models.core.strict import Strict, quantity
from models.machine.compiled import lean


class Brake(Strict):
    """Parameters of one wheel's brake. Raises InputError where the hysteresis would put torque below the line of rising
    pressure.
    """

    push_out: float = quantity("bar", "pressure above which torque rises from none", zero=True)
    release: float = quantity("bar", "pressure below which there is no torque; at most push_out", zero=True)
    rising: float = quantity("N m/bar", "gradient of the torque while pressure rises")
    falling: float = quantity("N m/bar", "gradient of the torque while pressure falls; at least rising")

    @model_validator(mode="after")
    def _is_a_loop(self) -> "Brake":
        if self.release > self.push_out:
            raise ValueError(f"release must be at most push_out, {self.push_out:g} bar: brakes let go below that")
        if self.falling < self.rising:
            raise ValueError(f"falling must be at least rising, {self.rising:g} N m/bar: hysteresis holds torque back")
        return self


class WheelBrakes(NamedTuple):
    """Parameters of the brakes of W wheels, one array (W,) each, for compiled functions; see ``Brake``."""

    push_out: np.ndarray
    release: np.ndarray
    rising: np.ndarray
    falling: np.ndarray


def brakes_of_wheels(*brakes: Brake) -> WheelBrakes:
    """Brake parameters (W,) of all wheels, in the order of the wheels."""
    return WheelBrakes(*(np.array([getattr(brake, name) for brake in brakes]) for name in WheelBrakes._fields))


@lean
def brake_torque(wheel_index, pressure, last_torque, brakes):
    """Torque (N m) of brake i at a pressure (bar) that has changed monotonically since the torque was ``last_torque``
    (N m).
    """
    rising_torque = brakes.rising[wheel_index] * max(0.0, pressure - brakes.push_out[wheel_index])
    falling_torque = brakes.falling[wheel_index] * max(0.0, pressure - brakes.release[wheel_index])
    return max(rising_torque, min(falling_torque, last_torque))


def torques_of_pressures(pressures: np.ndarray, brakes: WheelBrakes) -> np.ndarray:
    """Torques (n,) in N m of the first brake over a sequence of pressures (n,) in bar, starting without torque."""
    last_torque, torques = 0.0, np.empty(len(pressures))
    for n, pressure in enumerate(pressures):
        last_torque = torques[n] = brake_torque(0, pressure, last_torque, brakes)
    return torques


PAPER_FRONT_BRAKE = Brake(push_out=0.75, release=0.71, rising=1500.0, falling=1500.0)
PAPER_REAR_BRAKE = Brake(push_out=0.25, release=0.25, rising=1200.0, falling=1200.0)
"""The paper's brakes as far as its printed data can be read: its hysteresis parameters (0.71, 0.75; 0.25, 0.25) are
good, that they are these two pressures and that the factors are 1500 and 1200 N m/bar is guessed."""
PAPER_BRAKES = brakes_of_wheels(PAPER_FRONT_BRAKE, PAPER_FRONT_BRAKE, PAPER_REAR_BRAKE, PAPER_REAR_BRAKE)
