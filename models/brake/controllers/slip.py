"""Anti-lock control of wheel slip: by two thresholds, the simplest controller and yardstick of the others, and by a
proportional-integral loop.

``SlipPI`` has a proportional and an integral part whose gains grow with speed, and commands pressures. Its controlled
quantity mixes slip with deceleration, s - mix w' r / g: the deceleration tells first. Slip answers to torque the faster
the slower the vehicle is, and gains in proportion to the speed keep the loop the same. Sources: S. Savaresi, M.
Tanelli, Active braking control systems design for vehicles (2010), mixed slip-deceleration control; S. Solyom, A.
Rantzer, J. Ludemann, Synthesis of a model-based tire slip controller, Vehicle System Dynamics 41 (2004).
"""

from dataclasses import dataclass

from models.brake.controller import APPLY, RELEASE
from models.brake.controllers.per_wheel import SLIP_BOUNDS, SMALLEST_FLOAT, AntiLockController
from models.core.errors import InputError


@dataclass
class SlipBangBang(AntiLockController):
    """Slip controller that releases the brake above one slip, applies it below a lower one, and keeps its last command
    between them.
    """

    release: float = 0.10
    apply: float = 0.05

    def __post_init__(self) -> None:
        self.check(release=SLIP_BOUNDS, apply=SLIP_BOUNDS)
        if not self.apply <= self.release < 1.0:
            raise InputError("", "controller.parameters.apply", self.apply, "must be at most release, and that below 1")
        self.set_logic(_SlipBangBangLogic)


class _SlipBangBangLogic:
    """Two-threshold logic of one wheel."""

    def __init__(self, slip_controller: SlipBangBang) -> None:
        self._settings, self._valve = slip_controller, APPLY

    def decide(self, slip: float, relative_acceleration: float, vehicle_speed: float, supply_pressure: float) -> float:
        if slip > self._settings.release:
            self._valve = RELEASE
        elif slip < self._settings.apply:
            self._valve = APPLY
        return self._valve


@dataclass
class SlipPI(AntiLockController):
    """Proportional-integral slip controller. target : slip wanted; gain : bar per unit of slip and m/s; reset : time of
    the integral part (s); mix : share of the deceleration (slip per g).
    """

    target: float = 0.06
    gain: float = 1.0
    reset: float = 0.08
    mix: float = 0.0

    def __post_init__(self) -> None:
        self.check(target=SLIP_BOUNDS, gain=(0.0, 1e4), reset=(0.0, 1e3), mix=(-SMALLEST_FLOAT, 10.0))
        self.set_logic(_SlipPILogic, commands_pressures=True)


class _SlipPILogic:
    """Proportional-integral loop of one wheel, whose gain grows with speed."""

    def __init__(self, slip_controller: SlipPI) -> None:
        self._settings, self._sum = slip_controller, 0.0

    def decide(self, slip: float, relative_acceleration: float, vehicle_speed: float, supply_pressure: float) -> float:
        settings = self._settings
        error = settings.target - (slip - settings.mix * relative_acceleration / 9.81)
        gain = settings.gain * vehicle_speed
        total = self._sum + gain * error * settings.period / settings.reset
        self._sum = min(max(total, 0.0), supply_pressure)
        return min(max(self._sum + gain * error, 0.0), supply_pressure)
