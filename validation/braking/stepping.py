"""A vehicle in the plane under torques that are given, moved on by the compiled step or by an engine."""

from collections.abc import Callable
from typing import Any

import numpy as np

from models.brake.advance import advance
from models.brake.plane_step import REPORTED
from models.brake.plane_vehicle import Plane
from models.brake.surfaces import EVEN, Road
from models.tyre.tyre_table import Tables


class Moving:
    """A vehicle that begins by rolling along x at a speed (m/s), all its tyres alike, its front wheels steered (rad).

    state (2, 2 + U) and turning (W,) are moved in place; rates (2 + U,) and report (W, 7) are those of the last step;
    time : that passed (s); slope : of the tyres (1/rad), see ``advance``; go : that, or an engine's.
    """

    def __init__(
        self,
        plane: Plane,
        tables: Tables,
        speed: float,
        *,
        steer: float = 0.0,
        road: Road = EVEN,
        slope: float = 10.0,
        go: Callable[..., Any] = advance,
    ) -> None:
        self.plane, self.state, self.turning = plane, np.zeros((2, 2 + plane.masses.size)), speed / plane.radius
        self.state[1, 0], self.time = speed, 0.0
        self.rates, self.report = np.zeros(self.state.shape[1]), np.zeros((plane.wheels, REPORTED))
        steered = np.where(plane.place[:, 0] > 0.0, steer, 0.0)
        self._go, self._others = go, (steered, slope, plane, np.zeros(plane.wheels, dtype=int), road, tables.packed)

    @property
    def speed(self) -> float:
        """Of the first unit's centre of mass (m/s)."""
        return float(np.hypot(*self.state[1, :2]))

    def on(self, torques: np.ndarray, step: float) -> tuple[int, float]:
        """Go on by steps (s) between torques (n + 1, W) in N m; how it ended, and the time (s) that passed.

        torques (W,) : stay for one step.
        """
        ends = torques if torques.ndim > 1 else np.tile(torques, (2, 1))
        status, used = self._go(self.state, self.turning, ends, step, *self._others, self.rates, self.report)
        self.time += used
        return status, used
