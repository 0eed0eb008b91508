"""Anti-lock control by phases of the wheel's acceleration, with its slip as a second criterion: the production
algorithm of Bosch.

    apply      until the wheel falls faster than -a: then hold
    hold       until its slip is above ``slip``: then release
    release    until it falls no faster than -a: then recover
    recover    hold; above +A apply again, and once it has risen faster than +a and does so no more: step up
    overshoot  apply until it rises no faster than +A: then recover
    step up    one sample of applying in ``pulse``, or applying slowly, until it falls faster than -a: then release

A wheel that stays at a deep slip without rising (on ice it may lock, and then it does not fall either) is released
again. Sources: U. Kiencke, L. Nielsen, Automotive control systems, ch. on anti-lock braking; Robert Bosch GmbH,
Automotive Handbook. Their figures are those of cars; these are for a truck with a sample of 5.5 ms.
"""

from dataclasses import dataclass

from models.brake.controller import APPLY, HOLD, RELEASE, SLOW
from models.brake.controllers.per_wheel import ACCELERATION_BOUNDS, SLIP_BOUNDS, SMALLEST_FLOAT, AntiLockController
from models.core.errors import InputError

FIRST, WAIT, LET_GO, RECOVER, OVERSHOOT, STEP_UP = range(6)


@dataclass
class AccelerationPhases(AntiLockController):
    """Anti-lock controller by thresholds of the wheel's acceleration (m/s^2): falls (-a), rises (+a), rises_fast (+A);
    of its slip: slip, and deep, above which a wheel that does not rise is released; pulse : samples per step of
    pressure; slow : whether valves that can apply slowly do so in place of these steps.
    """

    falls: float = -20.0
    rises: float = 2.0
    rises_fast: float = 20.0
    slip: float = 0.035
    deep: float = 0.1
    pulse: int = 4
    slow: bool = False

    def __post_init__(self) -> None:
        self.check(
            falls=(-ACCELERATION_BOUNDS[1], -SMALLEST_FLOAT),
            rises=ACCELERATION_BOUNDS,
            rises_fast=ACCELERATION_BOUNDS,
            slip=SLIP_BOUNDS,
            deep=SLIP_BOUNDS,
            pulse=(0.0, 1000.0),
        )
        for name, kind in (("pulse", int), ("slow", bool)):
            if not isinstance(getattr(self, name), kind):
                allowed = "must be a whole number" if kind is int else "must be true or false"
                raise InputError("", f"controller.parameters.{name}", getattr(self, name), allowed)
        self.set_logic(_AccelerationPhaseLogic)


class _AccelerationPhaseLogic:
    """State machine of one wheel's acceleration phases."""

    def __init__(self, thresholds: AccelerationPhases) -> None:
        self._settings, self._phase, self._rose, self._count = thresholds, FIRST, False, 0

    def decide(self, slip: float, relative_acceleration: float, vehicle_speed: float, supply_pressure: float) -> float:
        settings, phase = self._settings, self._phase
        falls = relative_acceleration < settings.falls
        if phase == FIRST and falls:
            phase = WAIT
        if phase == STEP_UP and (falls or slip > settings.deep):
            phase = LET_GO if slip > settings.slip else WAIT
        if phase in (FIRST, WAIT) and slip > settings.slip and (phase == WAIT or slip > settings.deep):
            phase = LET_GO
        elif phase == WAIT and relative_acceleration > settings.rises:
            phase, self._count = STEP_UP, 0
        if phase == LET_GO and not falls and (slip < settings.deep or relative_acceleration > settings.rises):
            phase, self._rose = RECOVER, False
        elif phase in (RECOVER, OVERSHOOT):
            phase = self._recovering(slip, relative_acceleration)
        self._phase = phase
        return self._valve(phase)

    def _recovering(self, slip: float, relative_acceleration: float) -> int:
        settings = self._settings
        self._rose = self._rose or relative_acceleration > settings.rises
        if relative_acceleration > settings.rises_fast and slip < settings.slip:
            return OVERSHOOT
        if relative_acceleration <= settings.rises and slip > settings.deep:
            return LET_GO
        if relative_acceleration <= settings.rises and (self._rose or slip < settings.slip):
            self._count = 0
            return STEP_UP
        return RECOVER

    def _valve(self, phase: int) -> int:
        if phase in (FIRST, OVERSHOOT):
            return APPLY
        if phase == STEP_UP and self._settings.slow:
            return SLOW
        if phase == STEP_UP:
            self._count += 1
            return APPLY if self._count % self._settings.pulse == 1 % self._settings.pulse else HOLD
        return RELEASE if phase == LET_GO else HOLD
