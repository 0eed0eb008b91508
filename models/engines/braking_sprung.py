"""A braked vehicle on its suspension in an engine: "exudyn" or "mujoco" has bodies, joints, masses and weights.

Each step (s) the wheels are exact under the torques that they have, with loads and slip angles in the middle of the
step, to which half a step by the accelerations leads; the engine then marches the whole step by its own Runge-Kutta
method around the compiled forces, the tyres' mean ones held at their contacts and turned with their wheels.
"""

from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from models.braking.advance import AT_REST, FINE
from models.braking.plane_step import KNOWN, REPORTED, begin, comes_to_rest
from models.braking.plane_vehicle import Plane
from models.braking.sprung import PITCH, ROLL, Sprung
from models.braking.sprung_forces import ROW, STEER, fill, held, held_forces, hold
from models.braking.surfaces import under_wheels
from models.engines.free_vehicle import Driven, FreeModel, free_model
from models.errors import RunFailed
from models.vehicles.spatial_linear import mass

BLINK = 1e-5
"""s: time over which wheels that only roll are looked at."""
UPRIGHT = 0.5
"""Roll and pitch (rad) beyond which the vehicle turns over."""


class OnSprings:
    """The vehicle in an engine; ``advance`` stands in for the compiled one of that name, with all coordinates."""

    def __init__(self, engine: str, vehicle: Sprung) -> None:
        own, wheels = vehicle.handling, len(vehicle.handling.vehicle.tyres)
        self.engine, self.vehicle, self.size = engine, vehicle, vehicle.size
        self.numbers = table = np.concatenate((own.numbers, np.zeros(ROW * wheels)))
        self._rows = table[own.numbers.size :].reshape(wheels, ROW)
        self._rates, self._known = np.zeros(wheels), np.empty((wheels, KNOWN))

    @cached_property
    def _liveliness(self) -> float:
        """Largest rate (m/s^2) at which side forces of slope 1 at a speed of 1 m/s damp a motion; g of a point mass.

        A body that rolls lets its contacts go sideways more easily than its mass would.
        """
        own, size = self.vehicle.handling, self.size
        motion, across = np.empty((len(self._known), 3)), np.empty((len(self._known), size))
        for j, rate in enumerate(np.eye(size)):
            held_forces(self.numbers, np.zeros(size), rate, np.zeros(size), motion)
            across[:, j] = motion[:, 1]
        loads = np.array([own.held.tyres[tyre.name] for tyre in own.vehicle.tyres])
        damping = np.linalg.solve(mass(own.vehicle), across.T @ (loads[:, None] * across))
        return float(np.linalg.eigvals(damping).real.max())

    @cached_property
    def _model(self) -> FreeModel:
        """Built with the first step."""
        own, table = self.vehicle.handling, self.numbers
        driven = Driven(own.vehicle, own.gravity, table, held, lambda block, t, n: fill(block, n, table))
        return free_model(self.engine, driven)

    def advance(self, state: np.ndarray, turning: np.ndarray, torques: np.ndarray, step: float, steer: np.ndarray,
                slope: float, plane: Plane, kind: np.ndarray, road: Any, tables: tuple[np.ndarray, ...],
                found: np.ndarray, report: np.ndarray) -> tuple[int, float]:  # fmt: skip
        """As ``models.braking.advance.advance``, ``state`` (2, n) having all coordinates and their rates.

        A run begins with zeros in ``found``.
        """
        surface, time, regular = np.empty((turning.size, 3)), 0.0, slope * self._liveliness * step
        if not found.any():
            self._rates[:] = 0.0
        self._rows[:, STEER] = steer
        for before, after in pairwise(torques):
            under_wheels(state, step, plane, kind, road, surface)
            begin(turning, surface, plane, self._known)
            used = self._step(state, turning, before, after, step, regular, plane, tables, found, report)
            time += used
            if used < step:
                return AT_REST, time
            if np.abs(state[0, [ROLL, PITCH]]).max() > UPRIGHT:
                raise RunFailed(self.engine, f"the vehicle turns over: it leans by more than {UPRIGHT} rad", time)
        return FINE, time

    def _step(self, state: np.ndarray, turning: np.ndarray, torque0: np.ndarray, torque1: np.ndarray, step: float,
              regular: float, plane: Plane, tables: tuple[np.ndarray, ...], found: np.ndarray,
              report: np.ndarray) -> float:  # fmt: skip
        """Time (s) of the step at which the vehicle comes to rest, ``step`` if it does not."""
        numbers, known, (q, v) = self.numbers, self._known, state
        hold(numbers, q, v, torque0, 0.5 * (torque0 + torque1), 0.5 * step, self._rates, regular, True, tables, known,
             report)  # fmt: skip
        rates = self.accelerations(q, v)
        found[:] = rates[: found.size]
        rest = comes_to_rest(v[: found.size], turning, found, step, plane)
        if rest >= 0.0:
            q += rest * v + 0.5 * rest**2 * rates
            v[: found.size], turning[:] = 0.0, 0.0
            return rest
        half = 0.5 * step
        hold(numbers, q + half * v + 0.5 * half**2 * rates, v + half * rates, torque0, torque1, step, self._rates,
             regular, False, tables, known, report)  # fmt: skip
        self._hand_over()
        state[:] = self._model.march(q, v, 1, step)[-1].reshape(2, -1)
        turning[:] = report[:, -1]
        return step

    def rolling(self, state: np.ndarray, steer: np.ndarray, plane: Plane, kind: np.ndarray, road: Any,
                tables: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Accelerations (n,) of a state (2, n) whose wheels roll without brakes, and their speeds of turning (W,)."""
        surface, known = np.empty((steer.size, 3)), self._known
        none, motion, report = np.zeros(steer.size), np.empty((steer.size, 3)), np.empty((steer.size, REPORTED))
        self._rows[:], self._rows[:, STEER] = 0.0, steer
        held_forces(self.numbers, *state, np.zeros(self.size), motion)
        turning = motion[:, 0] / plane.radius
        under_wheels(state, 0.0, plane, kind, road, surface)
        begin(turning, surface, plane, known)
        hold(self.numbers, *state, none, none, BLINK, none.copy(), 0.0, True, tables, known, report)
        return self.accelerations(*state), turning

    def accelerations(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(n,) by the engine, with the forces that are held."""
        self._hand_over()
        return self._model.acceleration(0.0, q, v)

    def _hand_over(self) -> None:
        if hasattr(self._model, "model"):
            self._model.model.numeric_data[:] = self.numbers
