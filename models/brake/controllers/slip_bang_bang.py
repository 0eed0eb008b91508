"""Slip control by two thresholds: the simplest controller, and the yardstick of the others."""

from dataclasses import dataclass

from models.brake.controller import APPLY, RELEASE, Command, Sample
from models.brake.controllers.per_wheel import SLIP, Common, PerWheel
from models.core.errors import InputError


@dataclass
class SlipBangBang(Common):
    """Releases above one slip, applies below a lower one, and between them goes on with what it did."""

    wheels: int
    release: float = 0.10
    apply: float = 0.05

    def __post_init__(self) -> None:
        self.check(release=SLIP, apply=SLIP)
        if not self.apply <= self.release < 1.0:
            raise InputError("", "controller.parameters.apply", self.apply, "must be at most release, and that below 1")
        self._loop = PerWheel(self.wheels, self, lambda: _Logic(self))

    def sample(self, given: Sample) -> Command:
        """States of the valves."""
        return self._loop.command(given)


class _Logic:
    def __init__(self, own: SlipBangBang) -> None:
        self._own, self._valve = own, APPLY

    def decide(self, slip: float, gains: float, speed: float, supply: float) -> float:
        if slip > self._own.release:
            self._valve = RELEASE
        elif slip < self._own.apply:
            self._valve = APPLY
        return self._valve
