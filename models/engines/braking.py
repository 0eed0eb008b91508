"""A braked vehicle whose chassis an engine carries: "exudyn" or "mujoco" has the bodies, joints and masses.

Tyres, wheels and the loads under them stay with the compiled step, which is exact where an engine would need steps of
microseconds. Each step it finds the mean force of every tyre in the wheel's own axes; the engine then marches by its
own Runge-Kutta method with these forces held at the wheels, turned with them, as custom forces. Its coordinates are X,
Y and the heading of the first unit and the angles of the hinges.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numba import carray

from models.brake.advance import FINE, advance
from models.brake.plane_step import FORCE_X, FORCE_Y
from models.brake.plane_vehicle import Plane
from models.brake.samples import moved
from models.engines.free_vehicle import Driven, FreeModel, free_model
from models.machine.compiled import lean, njit
from models.machine.stack import array, at, beyond, start
from models.vehicles.spatial import Body, SpatialVehicle

HEADER, ROW = 2, 6
"""Table: numbers of units and wheels, the reach of the units, then of each wheel unit, x, y, steer and both forces."""


@njit(cache=True, error_model="numpy")
def held(numbers, time, q, v, f):
    """Add the wheels' forces, held in their own axes, to those of the engine's coordinates; pointers to doubles."""
    head = carray(numbers, (HEADER,))
    units, wheels = int(head[0]), int(head[1])
    table = carray(numbers, (HEADER + units * units + ROW * wheels,))
    position, force = carray(q, (2 + units,)), carray(f, (2 + units,))
    for w in range(HEADER + units * units, table.size, ROW):
        k, heading = int(table[w]), table[w + 3]
        for j in range(k + 1):
            heading += position[2 + j]
        c, s = np.cos(heading), np.sin(heading)
        fx, fy = c * table[w + 4] - s * table[w + 5], s * table[w + 4] + c * table[w + 5]
        force[0] += fx
        force[1] += fy
        psi = 0.0
        for j in range(units):
            psi += position[2 + j]
            way = table[HEADER + k * units + j] + (table[w + 1] if j == k else 0.0)
            side = table[w + 2] if j == k else 0.0
            c, s = np.cos(psi), np.sin(psi)
            moment = fx * (-way * s - side * c) + fy * (way * c - side * s)
            for a in range(j + 1):
                force[2 + a] += moment


@lean
def fill(block, n, numbers):
    """``held`` in a block of doubles at an address: f, q and v (n,), of which f is cleared before."""
    f = at(block)
    force = array(f, (n,))
    force[:] = 0.0
    held(start(numbers), 0.0, beyond(f, n), beyond(f, 2 * n), f)


def bodies(plane: Plane) -> SpatialVehicle:
    """Units of a plane vehicle as bodies of an engine; each one after the first turns about its hinge.

    The hinge of unit k lies at reach[k, j] ahead of the units j < k and reach[k, k] behind its own centre.
    """
    found = list[Body]()
    for k, (mass, turn) in enumerate(zip(plane.masses, plane.inertias, strict=True)):
        tensor = ((turn, 0.0, 0.0), (0.0, turn, 0.0), (0.0, 0.0, turn))
        hinge, centre = float(plane.reach[k, :k].sum()), float(plane.reach[k].sum())
        if k == 0:
            found.append(Body("0", float(mass), (0.0, 0.0, 0.0), ("x", "y", "rz"), tensor))
            continue
        below = "0" if k == 1 else f"hinge {k - 1}"
        found.append(Body(f"hinge {k}", 0.0, (hinge, 0.0, 0.0), ("rz",), parent=below))
        found.append(Body(str(k), float(mass), (centre, 0.0, 0.0), (), tensor, parent=f"hinge {k}"))
    return SpatialVehicle("braked", tuple(found), (), (), ())


class Carried:
    """The chassis of a plane vehicle in an engine; ``advance`` stands in for the compiled one of that name."""

    def __init__(self, engine: str, plane: Plane) -> None:
        units = plane.masses.size
        wheels = np.column_stack((plane.unit, plane.place, np.zeros((plane.wheels, 3))))
        self.numbers = np.concatenate(([units, plane.wheels], plane.reach.ravel(), wheels.ravel()))
        self._wheels = self.numbers[HEADER + units * units :].reshape(-1, ROW)
        table = self.numbers
        driven = Driven(bodies(plane), np.zeros(3), table, held, lambda block, t, n: fill(block, n, table))
        self._model: FreeModel = free_model(engine, driven)

    def advance(
        self, state: np.ndarray, turning: np.ndarray, torques: np.ndarray, step: float, steer: np.ndarray, *rest: Any
    ) -> tuple[int, float]:
        """As ``models.brake.advance.advance``, a step at a time, each moved by the engine."""
        time, report = 0.0, rest[-1]
        for n in range(len(torques) - 1):
            before = state.copy()
            status, used = advance(state, turning, torques[n : n + 2], step, steer, *rest)
            time += used
            if status != FINE:
                return status, time
            self._wheels[:, 3], self._wheels[:, 4:] = steer, report[:, [FORCE_X, FORCE_Y]]
            state[:] = self._moved(before, step)
        return FINE, time

    def moving(self, *given: Any) -> Iterator[tuple[int, float, float, float]]:
        """As ``models.brake.samples.samples``."""
        return moved(self.advance)(*given)

    def _moved(self, before: np.ndarray, step: float) -> np.ndarray:
        """Positions and rates (2, 2 + U) after a step of the engine."""
        own = before.copy()
        own[:, 3:] = np.diff(before[:, 2:], axis=1)
        if hasattr(self._model, "model"):
            self._model.model.numeric_data[:] = self.numbers
        after = self._model.march(own[0], own[1], 1, step)[-1].reshape(2, -1)
        after[:, 2:] = np.cumsum(after[:, 2:], axis=1)
        return after
