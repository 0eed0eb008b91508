"""Common part of the slip controllers: one logic per wheel or axle, the estimate of the vehicle's speed, and the end of
control at low speed.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from models.brake.controller import APPLY, RELEASE, SAMPLING_PERIOD, Command, Sample
from models.core.errors import InputError

ACCELERATION_SMOOTHING_TIME = 0.1
"""Time constant (s) over which the vehicle's acceleration is smoothed."""
SMALLEST_FLOAT = 5e-324
"""Smallest positive number; its negative as an exclusive lower bound admits zero, and as an upper bound excludes
zero.
"""
ACCELERATION_BOUNDS, PRESSURE_RATE = (0.0, 1e4), (0.0, 1e5)
"""Bounds of thresholds of a wheel's acceleration (m/s^2) and of rates of pressure (bar/s), beyond any wheel or
valve.
"""
SLIP_BOUNDS = (0.0, 1.0)
"""Bounds of slip thresholds: a locked wheel has slip 1."""


class WheelLogic(Protocol):
    """Protocol of the anti-lock logic for one wheel, or for one axle on the basis of its slower wheel."""

    def decide(self, slip: float, relative_acceleration: float, vehicle_speed: float, supply_pressure: float) -> float:
        """Valve state or pressure (bar), from the wheel's slip, its acceleration relative to the vehicle's (m/s^2), the
        vehicle's speed (m/s) and the supply pressure (bar)."""
        ...


@dataclass(kw_only=True)
class AntiLockController:
    """Parameters that every anti-lock controller has.

    wheels : how many there are; select_low : axles, from 0, whose two wheels get what the slower one needs; cut_off :
    speed of the vehicle (m/s) below which all brakes are applied, so that it comes to rest; period : s between two
    samples.
    """

    wheels: int = field(kw_only=False)
    select_low: tuple[int, ...] = ()
    cut_off: float = 1.5
    period: float = SAMPLING_PERIOD

    def set_logic(self, make_wheel_logic: Callable[[Any], WheelLogic], commands_pressures: bool = False) -> None:
        """Set up one ``make_wheel_logic`` per wheel or axle; ``commands_pressures`` : whether it commands pressures
        instead of valve states.
        """
        self._loop = PerWheelLoop(self.wheels, self, make_wheel_logic, commands_pressures)

    def sample(self, sample: Sample) -> Command:
        """Command for a sample: states of the valves, or pressures."""
        return self._loop.command(sample)

    def check(self, **bounds: tuple[float, float]) -> None:
        """Refuse a parameter that is no number or outside its bounds: it must be above the first and at most the
        second.

        Raises InputError. Axles that do not exist are refused by ``PerWheelLoop``.
        """
        for name, (bound_below, bound_above) in {
            "period": (0.0, 1.0),
            "cut_off": (-SMALLEST_FLOAT, 100.0),
            **bounds,
        }.items():
            value, key_path = getattr(self, name), f"controller.parameters.{name}"
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
                raise InputError("", key_path, value, "must be a number")
            if not bound_below < value <= bound_above:
                least_text = "0 or more" if bound_below == -SMALLEST_FLOAT else f"above {bound_below:g}"
                largest = "below 0" if bound_above == -SMALLEST_FLOAT else f"at most {bound_above:g}"
                raise InputError("", key_path, value, f"must be {least_text}, {largest}")
        self.select_low = tuple(self.select_low)


class PerWheelLoop:
    """Loop over wheels or axles that all controllers share; ``pressures`` : whether they command pressures instead of
    valve states.
    """

    def __init__(
        self,
        wheel_count: int,
        controller: AntiLockController,
        make_wheel_logic: Callable[[Any], WheelLogic],
        commands_pressures: bool,
    ) -> None:
        for axle in controller.select_low:
            if not (isinstance(axle, int) and 0 <= 2 * axle + 1 < wheel_count):
                raise InputError(
                    "", "controller.parameters.select_low", axle, f"must be axles 0 to {wheel_count // 2 - 1}"
                )
        shared = [(2 * axle, 2 * axle + 1) for axle in controller.select_low]
        single_wheels = [(i, i) for i in range(wheel_count) if i // 2 not in controller.select_low]
        self._groups = sorted(shared + single_wheels)
        self._logics = [make_wheel_logic(controller) for _ in self._groups]
        self._common, self._pressures, self._wheels = controller, commands_pressures, wheel_count
        self._estimate, self._last_wheel_speeds = SpeedEstimate(controller.period), [np.nan] * len(self._groups)
        self._speed, self._mean_acceleration = np.nan, 0.0

    def command(self, sample: Sample) -> Command:
        """Command for a sample; all brakes are released while the brake switch is off, and applied below the cut-off
        speed.
        """
        wheels = sample.wheels.tolist()
        speed = speed_from_scene_or_estimate(sample.speed, wheels, self._estimate)
        vehicle_acceleration = self._smoothed_acceleration(speed)
        if not sample.brake:
            return self._command_all(0.0 if self._pressures else RELEASE)
        commands = [0.0] * self._wheels
        for k, (first_wheel, last_wheel) in enumerate(self._groups):
            wheel = min(wheels[first_wheel], wheels[last_wheel])
            speed_before = self._last_wheel_speeds[k]
            relative_acceleration = (
                (wheel - speed_before) / self._common.period - vehicle_acceleration
                if speed_before == speed_before
                else 0.0
            )
            self._last_wheel_speeds[k] = wheel
            if speed > 0.0:
                answer = self._logics[k].decide(1.0 - wheel / speed, relative_acceleration, speed, sample.supply)
                commands[first_wheel] = commands[last_wheel] = answer
        if speed < self._common.cut_off:
            return self._command_all(sample.supply if self._pressures else APPLY)
        return self._commands_of_logics(commands)

    def _smoothed_acceleration(self, vehicle_speed: float) -> float:
        """Mean acceleration of the vehicle (m/s^2), negative while it brakes, smoothed over about
        ``ACCELERATION_SMOOTHING_TIME`` seconds.
        """
        if self._speed == self._speed:
            latest = (vehicle_speed - self._speed) / self._common.period
            self._mean_acceleration += (latest - self._mean_acceleration) * min(
                self._common.period / ACCELERATION_SMOOTHING_TIME, 1.0
            )
        self._speed = vehicle_speed
        return self._mean_acceleration

    def _command_all(self, wheel_command: float) -> Command:
        """The same command for all wheels."""
        return self._commands_of_logics([wheel_command] * self._wheels)

    def _commands_of_logics(self, wheel_commands: list[float]) -> Command:
        """Command with one valve state or pressure per wheel."""
        if self._pressures:
            return Command(pressures=np.array(wheel_commands, dtype=float))
        return Command(valves=np.array(wheel_commands, dtype=np.int64))


@dataclass
class SpeedEstimate:
    """Estimate of the vehicle's speed (m/s) from sampled wheel speeds.

    sampling_period : s between two of them; first_slope : slope (m/s^2) until one is learnt, chosen: with 10 a slip
    bang-bang takes 10 % more way on ice, as the estimate goes down with its wheels, with 4 it takes 8 % more on dry
    road, as it lets them go too early, with 6 neither; steepest_deceleration : deceleration (m/s^2) that no vehicle
    exceeds;
    slope_margin : the slope by the deceleration learnt; least_interval : s at least between the moments from which it
    is learnt. Wheels that are held at a slip and never come back teach it nothing.
    """

    sampling_period: float
    first_slope: float = 6.0
    steepest_deceleration: float = 10.0
    gentlest_deceleration: float = 1.0
    slope_margin: float = 1.2
    least_interval: float = 0.15

    def __post_init__(self) -> None:
        self._speed, self._slope = math.nan, self.first_slope
        self._fastest, self._rising, self._since = 0.0, False, 0.0
        self._peak = math.nan

    def after(self, wheel_speeds: Sequence[float]) -> float:
        """Estimated speed (m/s) of the vehicle after one more sample of the wheels' speeds (m/s)."""
        fastest = max(wheel_speeds)
        if self._speed != self._speed:
            self._speed = self._peak = fastest
        self._learn_slope(fastest)
        self._speed = max(fastest, self._speed - self._slope * self.sampling_period)
        return self._speed

    def _learn_slope(self, fastest_wheel_speed: float) -> None:
        """Update the slope (m/s^2) of the vehicle's speed from the last two maxima of the fastest wheel's speed."""
        self._since += self.sampling_period
        if self._rising and fastest_wheel_speed < self._fastest and self._since >= self.least_interval:
            slope = self.slope_margin * (self._peak - self._fastest) / self._since
            self._slope = min(max(slope, self.gentlest_deceleration), self.steepest_deceleration)
            self._peak, self._since = self._fastest, 0.0
        self._rising, self._fastest = fastest_wheel_speed > self._fastest, fastest_wheel_speed


def speed_from_scene_or_estimate(
    scene_speed: float, wheel_speeds: Sequence[float], speed_estimate: SpeedEstimate
) -> float:
    """Vehicle speed (m/s) from the scene, or the estimate where the scene's speed is not a number."""
    return speed_estimate.after(wheel_speeds) if scene_speed != scene_speed else scene_speed
