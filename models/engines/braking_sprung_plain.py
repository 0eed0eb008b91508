"""A braked vehicle on its suspension by the independent reference: no engine and no compiled code in its steps.

It stands where ``models.engines.braking_sprung.OnSprings`` stands, with the same start, controller and samples.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from models.brake.advance import AT_REST, FINE
from models.brake.plain.pressure import Pressures
from models.brake.plain.step import BLINK, OVER, UPRIGHT, Course, Moving, Steps
from models.brake.plain.suspension import Suspension
from models.brake.plane_vehicle import Plane
from models.brake.sprung import Sprung
from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.spatial_protocol import INTEGRATORS, check_modes
from models.engines.stability import LONG_RUN
from models.tyre.tyre_table import Tables
from models.vehicles.spatial_linear import linearise

NAME = "reference"


class PlainOnSprings:
    """The vehicle by plain code; ``advance`` and ``moving`` as those of ``OnSprings``."""

    def __init__(self, vehicle: Sprung) -> None:
        self.vehicle, self.size, self.suspension = vehicle, vehicle.size, Suspension(vehicle)
        self.liveliness = self.suspension.liveliness()
        self._changes = np.zeros(len(self.suspension.tyres))

    def advance(
        self,
        state: np.ndarray,
        turning: np.ndarray,
        torques: np.ndarray,
        step: float,
        steer: np.ndarray,
        slope: float,
        *rest: Any,
    ) -> tuple[int, float]:
        """As ``models.brake.advance.advance``, ``state`` (2, n) having all coordinates and their rates.

        A run begins with zeros in the accelerations ``found``. Raises RunFailed where the vehicle turns over.
        """
        plane, kinds, road, tables, found, report = rest
        if not found.any():
            self._changes[:] = 0.0
        course = Course(plane, steer, kinds, road, Tables(*tables), slope * self.liveliness * step)
        steps, own = Steps(self.suspension, course, step), Moving(state, turning, self._changes, report, found)
        time = 0.0
        for ends in pairwise(torques):
            status, used = steps.on(own, np.array(ends))
            time += used
            if status == OVER:
                raise RunFailed(NAME, f"the vehicle turns over: it leans by more than {UPRIGHT} rad", time)
            if status == AT_REST:
                return AT_REST, time
        return FINE, time

    def moving(
        self, told: Any, kept: Any, sample: float, braking: Any, state: np.ndarray, turning: np.ndarray, *rest: Any
    ) -> Iterator[tuple[int, float, float, float]]:
        """As ``models.brake.samples.samples``; Refused for a step that is too long, RunFailed as ``advance``."""
        torques, time, status = braking.torques, 0.0, FINE
        step = sample / (len(torques) - 1)
        self.check_step(step)
        pressures = Pressures(braking.chambers, braking.brakes, sample, braking.air)
        while True:
            yield status, time, float(np.hypot(*state[1, :2])), float(braking.air.supply[0])
            for _ in range(int(told.samples[0])):
                if math.isnan(told.pressures[0]):
                    pressures.by_valves(told.valves, torques)
                else:
                    pressures.by_pressures(told.pressures, torques)
                status, used = self.advance(state, turning, torques, step, told.steer, *rest)
                time += used
                kept.now[0] = time
                kept.rows[kept.left[0]] = kept.now
                kept.left[0] += 1
                if status == AT_REST or time >= kept.until:
                    break

    def check_step(self, step: float) -> None:
        """Refuse a step (s) at which a mode of the vehicle on its springs and tyres would grow."""
        settings = Settings(INTEGRATORS["mujoco"], step, LONG_RUN * step)
        check_modes(NAME, linearise(self.vehicle.handling.vehicle), settings)

    def rolling(
        self,
        state: np.ndarray,
        steer: np.ndarray,
        plane: Plane,
        kind: np.ndarray,
        road: Any,
        tables: tuple[np.ndarray, ...],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations (n,) of a state (2, n) whose wheels roll without brakes, and their speeds of turning (W,)."""
        steps = Steps(self.suspension, Course(plane, steer, kind, road, Tables(*tables), 0.0), BLINK)
        return steps.rolling(state)
