"""Five-phase hybrid anti-lock controller: by the wheel's acceleration alone, on a limit cycle about the peak of the
tyre's friction.

    1  pressure falls at ``falling``  until y >= e1
    2  it holds                       until y >= e2
    3  it rises at ``fast``           until y <= e3
    4  it holds                       until y <= e4
    5  it rises at ``slow``           until y <= -e5, then phase 1

with y = r w' the acceleration of the wheel's rim. It begins with phase 3 until y <= -e5. Source: W. Pasillas-Lepine,
Hybrid modeling and limit cycle analysis for a class of five-phase anti-lock brake algorithms, Vehicle System Dynamics
44 (2006) 173-188; M. Gerard, W. Pasillas-Lepine, E. de Vries, M. Verhaegen, Adaptation of hybrid five-phase ABS
algorithms for experimental validation, AAC 2010. e1 has to be large enough for the wheel not to lock in phase 2. Where
one set of thresholds has to do for all roads three rules of ours hold the cycle together: a wheel that in phase 2 gains
speed no more (y <= e4), or in phase 1 has no pressure left and rolls, goes on with phase 5, and one at a deep slip
with phase 1.
"""

from dataclasses import dataclass

from models.brake.controllers.per_wheel import ACCELERATION_BOUNDS, PRESSURE_RATE, SLIP_BOUNDS, AntiLockController
from models.core.errors import InputError


@dataclass
class FivePhase(AntiLockController):
    """Five-phase anti-lock controller. e1 to e5 : thresholds of the wheel's acceleration (m/s^2); falling, fast, slow :
    rates of its pressure (bar/s); deep : slip above which phase 1 begins.
    """

    e1: float = 4.0
    e2: float = 5.0
    e3: float = 4.5
    e4: float = 1.0
    e5: float = 13.0
    falling: float = 40.0
    fast: float = 20.0
    slow: float = 5.0
    deep: float = 0.3

    def __post_init__(self) -> None:
        self.check(
            **dict.fromkeys(("e1", "e2", "e3", "e5"), ACCELERATION_BOUNDS),
            e4=(-1e4, 1e4),
            deep=SLIP_BOUNDS,
            **dict.fromkeys(("falling", "fast", "slow"), PRESSURE_RATE),
        )
        if not self.e1 < self.e2 or not self.e4 < self.e3 < self.e2:
            raise InputError("", "controller.parameters.e2", self.e2, "must be above e1 and e3, and e3 above e4")
        self.set_logic(_FivePhaseLogic, commands_pressures=True)


FIRST_PHASE = 0


def phase_end_threshold(phase: int, controller: FivePhase) -> tuple[float, float]:
    """Threshold of the wheel's acceleration that ends a phase: sign +1 if the acceleration must rise to it, -1 if it
    must fall, and level (m/s^2).
    """
    if phase in (1, 2):
        return 1.0, controller.e1 if phase == 1 else controller.e2
    return -1.0, {3: controller.e3, 4: controller.e4}.get(phase, -controller.e5)


def pressure_rate_of_phase(phase: int, controller: FivePhase) -> float:
    """Rate of the brake pressure (bar/s) in a phase."""
    return (controller.fast, -controller.falling, 0.0, controller.fast, 0.0, controller.slow)[phase]


class _FivePhaseLogic:
    """State machine of one wheel's five phases."""

    def __init__(self, controller: FivePhase) -> None:
        self._settings, self._phase, self._pressure = controller, FIRST_PHASE, 0.0

    def decide(self, slip: float, relative_acceleration: float, vehicle_speed: float, supply_pressure: float) -> float:
        sign, level = phase_end_threshold(self._phase, self._settings)
        if sign * (relative_acceleration - level) >= 0.0:
            self._phase = self._phase % 5 + 1
        elif self._continues_with_phase_5(slip, relative_acceleration):
            self._phase = 5
        if self._phase != 1 and slip > self._settings.deep:
            self._phase = 1
        raised = self._pressure + pressure_rate_of_phase(self._phase, self._settings) * self._settings.period
        self._pressure = min(max(raised, 0.0), supply_pressure)
        return self._pressure

    def _continues_with_phase_5(self, slip: float, relative_acceleration: float) -> bool:
        """Whether phase 5 follows: the wheel no longer gains speed in phase 2, or has no brake pressure left and little
        slip in phase 1.
        """
        if self._phase == 1:
            return self._pressure == 0.0 and slip <= self._settings.deep
        return self._phase == 2 and relative_acceleration <= self._settings.e4
