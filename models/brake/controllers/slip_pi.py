"""Slip control by a proportional and an integral part whose gains grow with speed; it commands pressures.

The controlled quantity mixes slip with deceleration, s - mix w' r / g: the deceleration tells first. Slip answers to
torque the faster the slower the vehicle is, and gains in proportion to the speed keep the loop the same. Sources: S.
Savaresi, M. Tanelli, Active braking control systems design for vehicles (2010), mixed slip-deceleration control; S.
Solyom, A. Rantzer, J. Ludemann, Synthesis of a model-based tire slip controller, Vehicle System Dynamics 41 (2004).
"""

from dataclasses import dataclass

from models.brake.controller import Command, Sample
from models.brake.controllers.per_wheel import SLIP, SMALLEST, Common, PerWheel


@dataclass
class SlipPI(Common):
    """target : slip wanted; gain : bar per unit of slip and m/s; reset : time of the integral part (s); mix : share
    of the deceleration (slip per g)."""

    wheels: int
    target: float = 0.06
    gain: float = 1.0
    reset: float = 0.08
    mix: float = 0.0

    def __post_init__(self) -> None:
        self.check(target=SLIP, gain=(0.0, 1e4), reset=(0.0, 1e3), mix=(-SMALLEST, 10.0))
        self._loop = PerWheel(self.wheels, self, lambda: _Logic(self), pressures=True)

    def sample(self, given: Sample) -> Command:
        """Pressures."""
        return self._loop.command(given)


class _Logic:
    def __init__(self, own: SlipPI) -> None:
        self._own, self._sum = own, 0.0

    def decide(self, slip: float, gains: float, speed: float, supply: float) -> float:
        own = self._own
        error = own.target - (slip - own.mix * gains / 9.81)
        gain = own.gain * speed
        total = self._sum + gain * error * own.period / own.reset
        self._sum = min(max(total, 0.0), supply)
        return min(max(self._sum + gain * error, 0.0), supply)
