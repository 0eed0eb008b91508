"""Brake pressures and torques over all commands of a run, in plain code: the reference of ``models.brake.pressure``.

The commands of all samples are kept with the times at which they reach the chambers. A step is cut where one does, and
within a cut each chamber follows p' = (p_to - p) / tau, so that no pressure turns back. See ``models.brake.pressure``
for the rule; there only the commands that are still on their way are kept.
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from models.brake.brake import WheelBrakes
from models.brake.controller import APPLY, RELEASE, SLOW
from models.brake.pressure import AirState, BrakeChambers

STEP_END_SHARE = 1e-9
"""Share of a step at its ends within which a command counts as arriving at the end."""


@dataclass(eq=False)
class PlainAirSystem:
    """The brakes' air system: all commands so far, and its state ``air``, which is updated in place; sample : duration
    (s).
    """

    chambers: BrakeChambers
    brakes: WheelBrakes
    sample: float
    air: AirState
    commands: list[np.ndarray] = field(default_factory=list)

    def by_valves(self, valve_states: np.ndarray, brake_torques: np.ndarray) -> None:
        """Fill ``brake_torques`` (n + 1, W) in N m, at the ends of the n steps of the next sample, for valve states
        (W,).
        """
        self.commands.append(valve_states.copy())
        brake_torques[0], steps = self.air.torque, len(brake_torques) - 1
        step = self.sample / steps
        for n in range(steps):
            within = [
                cut for cut in self._arrival_times(n * step) if STEP_END_SHARE < cut / step < 1.0 - STEP_END_SHARE
            ]
            for start_time, end_time in pairwise([0.0, *within, step]):
                self._advance_pressures(
                    self._effective_command(n * step + 0.5 * (start_time + end_time)), end_time - start_time
                )
            brake_torques[n + 1] = self.air.torque

    def by_pressures(self, pressures: np.ndarray, brake_torques: np.ndarray) -> None:
        """Set pressures (W,) in bar at once and keep them over the next sample; fill its ``brake_torques`` (n + 1, W)
        in N m.
        """
        self.air.pressure[:] = pressures
        self._follow_hysteresis()
        brake_torques[:] = self.air.torque

    def _arrival_times(self, time_in_sample: float) -> list[float]:
        """Times (s) at which each command reaches the chambers, counted from ``time_in_sample`` (s) in the latest
        sample.
        """
        latest = len(self.commands) - 1
        return [(k - latest) * self.sample + self.chambers.delay - time_in_sample for k in range(latest + 1)]

    def _effective_command(self, time_in_sample: float) -> np.ndarray:
        """The valve states (W,) that are effective in the chambers at a time (s) in the latest sample."""
        known = [
            arrived
            for arrived, late in zip(self.commands, self._arrival_times(time_in_sample), strict=True)
            if late <= 0.0
        ]
        return known[-1] if known else np.full(self.air.pressure.size, RELEASE)

    def _advance_pressures(self, valve_states: np.ndarray, duration: float) -> None:
        """Update chamber pressures and torques over a time (s) with constant valve states (W,)."""
        chambers, supply, pressures_before = self.chambers, float(self.air.supply[0]), self.air.pressure.copy()
        fills = valve_states >= APPLY
        target = np.where(fills, supply, np.where(valve_states == RELEASE, 0.0, pressures_before))
        slow = chambers.slow if chambers.slow.size else chambers.fill_time
        constants = np.where(
            valve_states == RELEASE, chambers.empty_time, np.where(valve_states == SLOW, slow, chambers.fill_time)
        )
        remaining_share = np.exp(-duration / np.where(constants > 0.0, constants, 1.0)) * (constants > 0.0)
        self.air.pressure[:] = target + (pressures_before - target) * remaining_share
        self._follow_hysteresis()
        if np.isfinite(chambers.reservoir):
            air_used = float(chambers.volumes @ ((self.air.pressure - pressures_before) * fills))
            self.air.supply[0] -= max(air_used, 0.0) / chambers.reservoir

    def _follow_hysteresis(self) -> None:
        """Update the brake torques: each stays between the lines of rising and of falling pressure of its hysteresis
        loop.
        """
        pressure, brakes = self.air.pressure, self.brakes
        rising = brakes.rising * np.maximum(pressure - brakes.push_out, 0.0)
        falling = brakes.falling * np.maximum(pressure - brakes.release, 0.0)
        self.air.torque[:] = np.clip(self.air.torque, rising, falling)
