"""A tree of bodies under gravity, loads, springs, friction and joint elements: mass matrix and forces in plain numpy.

Nothing here is shared with an engine or with the compiled kernels: bodies move by products of matrices (``motion``).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from models.multibody.plain.constraints import Axes, rotation_gap
from models.multibody.plain.motion import FIRST_DERIVATIVE, GROUND, PLACE, RATE, Bodies, PlainMotion
from models.vehicles.spatial import SpatialVehicle, Vector

LineSpring = tuple[tuple[tuple[str | None, Vector], ...], float, float, float]
"""Spring-damper along the line between two points: points on bodies (None: the ground) in the design position, N/m, N
s/m, length at rest (m)."""
FollowerLoad = tuple[str, Vector, np.ndarray, np.ndarray]
"""Force and moment (3,) in N and N m that turn with a body: the body, a point (m) on it in the design position, force,
moment."""
TurningSpring = tuple[tuple[str | None, str], Axes, float, float]
"""Rotational spring-damper: two bodies (None: the ground), their axes that are parallel at rest, N m/rad and N m s/rad
about all axes."""
Friction = tuple[int, float, float]
"""Dry friction of a coordinate: its index, its force (N, N m), and the speed (m/s, rad/s) from which it has that
force."""
Load = tuple[str, Vector, np.ndarray]
"""Force on a body with a fixed direction: the body, a point (m) on it in the design position, the force (3,) in N along
the axes of space."""


class AppliedForces(NamedTuple):
    """Forces on bodies besides gravity and joint elements, by kind; any of the lists may be empty."""

    loads: Sequence[Load] = ()
    lines: Sequence[LineSpring] = ()
    frictions: Sequence[Friction] = ()
    turns: Sequence[TurningSpring] = ()
    followers: Sequence[FollowerLoad] = ()


NO_APPLIED_FORCES = AppliedForces()


def joint_rows(bodies: Bodies, vehicle: SpatialVehicle) -> np.ndarray:
    """Factors (e, n) of the coordinates in the displacement of each joint element."""
    rows = np.zeros((len(vehicle.joint_elements), bodies.size))
    for row, element in zip(rows, vehicle.joint_elements, strict=True):
        for place, factor in zip(element.coordinates, element.factors, strict=True):
            row[bodies.index(*place)] += factor
    return rows


def joint_numbers(vehicle: SpatialVehicle) -> np.ndarray:
    """Stiffness, damping, preload and inertia (4, e) of every joint element."""
    numbers = [(e.stiffness, e.damping, e.preload, e.inertia) for e in vehicle.joint_elements]
    return np.array(numbers).reshape(-1, 4).T


class PlainTree:
    """Equations of motion of the bodies and joint elements of a vehicle; gravity (3,) in m/s^2."""

    def __init__(
        self, vehicle: SpatialVehicle, gravity: np.ndarray, applied_forces: AppliedForces = NO_APPLIED_FORCES
    ) -> None:
        self.bodies, self.gravity = Bodies(vehicle), gravity
        loads, lines, frictions, turns, followers = applied_forces
        self.size = self.bodies.size
        self._loads = np.array([force for _, _, force in loads]).reshape(-1, 3)
        self._points = self.bodies.points([(body, point) for body, point, _ in loads])
        self._lines, self._ends = lines, self.bodies.points([end for ends, *_ in lines for end in ends])
        self._turns, self._followers = turns, followers
        self._pushed = self.bodies.points([(body, point) for body, point, *_ in followers])
        self._rows = joint_rows(self.bodies, vehicle)
        self._stiffness, self._damping, self._held, self._inertia = joint_numbers(vehicle)
        self._rubbing = [coordinate for coordinate, _, _ in frictions]
        self._friction, self._slides = np.array([rest for _, *rest in frictions]).reshape(-1, 2).T

    def mass_and_force(self, time: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix (n, n), and forces (n,) including inertia forces without the q'' terms, at coordinates and rates
        (n,)."""
        motion = self.bodies.move(q, v)
        mass, force = self.bodies.inertia(motion, self.gravity)
        along = self._held + self._stiffness * (self._rows @ q) + self._damping * (self._rows @ v)
        force -= self._rows.T @ along
        if len(self._loads):
            force += np.einsum("pnk,pk->n", motion.at(self._points)[:, FIRST_DERIVATIVE:], self._loads)
        if self._lines:
            force += self._line_spring_forces(motion)
        for (body, _, push, moment), point in zip(self._followers, motion.at(self._pushed), strict=True):
            row = self.bodies.row[body]
            axes = motion.axes(row)[PLACE]
            force += point[FIRST_DERIVATIVE:] @ (axes @ push) + motion.moment_forces(row, axes @ moment)
        for turn in self._turns:
            force -= self._turning_resistance(turn, motion, v)
        force[self._rubbing] -= self._friction * np.clip(v[self._rubbing] / self._slides, -1.0, 1.0)
        return mass + self._rows.T * self._inertia @ self._rows, force

    def _line_spring_forces(self, body_motion: PlainMotion) -> np.ndarray:
        """Generalised forces (n,) of springs between two points: -F dl/dq, with l the distance between the points."""
        total, ends = np.zeros(self.size), body_motion.at(self._ends)
        for (_, stiffness, damping, length), first, second in zip(self._lines, ends[::2], ends[1::2], strict=True):
            apart = second - first
            distance = float(np.linalg.norm(apart[PLACE]))
            gradient = apart[FIRST_DERIVATIVE:] @ (apart[PLACE] / distance)
            rate = float(apart[RATE] @ apart[PLACE]) / distance
            total -= (stiffness * (distance - length) + damping * rate) * gradient
        return total

    def _turning_resistance(self, turning_spring: TurningSpring, body_motion: PlainMotion, v: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) of a rotational spring-damper between two bodies, positive against the direction in
        which they act."""
        bodies, axes, stiffness, damping = turning_spring
        rows = [self.bodies.row[name] if name else GROUND for name in bodies]
        first, second = (body_motion.axes(row) @ columns for row, columns in zip(rows, axes, strict=True))
        size, gains = rotation_gap(first, second)
        resistance: np.ndarray = gains.T @ (stiffness * size + damping * (gains @ v))
        return resistance

    def applied_forces(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Applied forces (n,) without inertia forces; their power is the rate of change of kinetic energy."""
        _, inertia = self.bodies.inertia(self.bodies.move(q, v), np.zeros(3))
        return self.mass_and_force(0.0, q, v)[1] - inertia

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at coordinates and rates (n,)."""
        return np.linalg.solve(*self.mass_and_force(time, q, v))
