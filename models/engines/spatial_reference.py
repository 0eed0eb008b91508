"""Hand-written accelerations of a spatial vehicle, with which both engines are compared.

Every body's centre and turning velocity as rows of the rates, body by body from the ground outwards; the sums of
Jourdain's principle over bodies and forces; one linear solve. The laws are those of ``models.vehicles.spatial``, read
straight from the description.
"""

from dataclasses import dataclass

import numpy as np

from models.vehicles.kinematics import UNIT_AXES, SpringEnd
from models.vehicles.spatial import FREEDOMS, AntiRollBar, SpatialVehicle, SpringDamper, Vector
from models.vehicles.spatial_linear import static_preloads


@dataclass
class BodyMotion:
    """Motion of a body: position of its centre, rotation, Jacobians (3, n) of both, and the terms (3,) of their
    accelerations that do not depend on q''."""

    centre: np.ndarray
    rotation: np.ndarray
    shift: np.ndarray
    turn: np.ndarray
    shift_rest: np.ndarray
    turn_rest: np.ndarray

    def at(self, body_vector: np.ndarray, angular_velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position and Jacobian of a body's point at ``body_vector`` (body's axes) from the centre, and the term of its
        acceleration that does not depend on q''."""
        r = self.rotation @ body_vector
        rows = self.shift - cross_product_matrix(r) @ self.turn
        rest = (
            self.shift_rest
            - cross_product_matrix(r) @ self.turn_rest
            + cross_product_matrix(angular_velocity) @ (cross_product_matrix(angular_velocity) @ r)
        )
        return self.centre + r, rows, rest


def cross_product_matrix(vector: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) of the cross product v x of a vector v (3,); ten times as fast as numpy's own product."""
    x, y, z = vector.tolist()
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def _rotation_about(axis: int, angle: float) -> np.ndarray:
    """Rotation matrix (3, 3) about coordinate axis number ``axis`` by an angle (rad), after Rodrigues."""
    cross = cross_product_matrix(UNIT_AXES[axis])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


class SpatialReference:
    """Hand-written equations of motion of a spatial vehicle, without an engine."""

    def __init__(self, vehicle: SpatialVehicle, speed: float | None = None) -> None:
        self.vehicle, self.speed, self.held = vehicle, float(speed or 0.0), static_preloads(vehicle)
        self.index = {place: i for i, place in enumerate(vehicle.coordinates())}
        self.size = len(self.index)

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray, road_row: np.ndarray | None = None) -> np.ndarray:
        """Accelerations (n,) from positions and rates (n,); ``road_row`` (2 w,): heights (m), then rates (m/s) under w
        tyres."""
        self.q, self.v, self.motions = q, v, self.motions_of(q, v)
        mass, force = np.zeros((self.size, self.size)), np.zeros(self.size)
        for body in self.vehicle.bodies:
            m = self.motions[body.name]
            inertia, omega = m.rotation @ np.array(body.inertia) @ m.rotation.T, m.turn @ v
            mass += body.mass * m.shift.T @ m.shift + m.turn.T @ inertia @ m.turn
            force -= body.mass * m.shift.T @ (m.shift_rest + self.vehicle.gravity * UNIT_AXES[2])
            force -= m.turn.T @ (inertia @ m.turn_rest + cross_product_matrix(omega) @ inertia @ omega)
        force += self._forces(np.zeros(2 * len(self.vehicle.tyres)) if road_row is None else road_row)
        return np.linalg.solve(mass, force)

    def motions_of(self, q: np.ndarray, v: np.ndarray) -> dict[str, BodyMotion]:
        """Motions of all bodies at positions and rates (n,), parents first. Each freedom shifts along, or turns about,
        an axis that the freedoms before it have turned."""
        motions: dict[str, BodyMotion] = {}
        for body in self.vehicle.bodies:
            rows = np.zeros((3, self.size))
            below = (
                motions[body.parent]
                if body.parent
                else BodyMotion(np.zeros(3), UNIT_AXES, rows, rows, rows[:, 0], rows[:, 0])
            )
            origin = self.vehicle.body(body.parent).position if body.parent else (0.0, 0.0, 0.0)
            arm, turned_rows, omega = np.subtract(body.position, origin), rows.copy(), below.turn @ v
            for k, freedom in enumerate(FREEDOMS[:3]):
                if freedom in body.freedoms:
                    arm[k] += q[self.index[body.name, freedom]]
                    turned_rows[:, self.index[body.name, freedom]] = below.rotation[:, k]
            centre, shift, rest = below.at(arm, omega)
            m = BodyMotion(
                centre,
                below.rotation,
                shift + turned_rows,
                below.turn.copy(),
                rest + 2 * cross_product_matrix(omega) @ turned_rows @ v,
                below.turn_rest.copy(),
            )
            for k, freedom in enumerate(FREEDOMS[3:]):
                if freedom in body.freedoms:
                    i, axis = self.index[body.name, freedom], m.rotation[:, k]
                    m.turn_rest += cross_product_matrix(m.turn @ v) @ axis * v[i]
                    m.turn[:, i] += axis
                    m.rotation = m.rotation @ _rotation_about(k, q[i])
            motions[body.name] = m
        return motions

    def _point(self, body: str | None, point: Vector) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and Jacobian (3, n) of a point (m) that is given in the design position."""
        if body is None:
            return np.array(point), np.zeros((3, self.size))
        return self.motions[body].at(np.subtract(point, self.vehicle.body(body).position), np.zeros(3))[:2]

    def _forces(self, road_row: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) of springs, bars, tyres, side forces and drags, without weights."""
        out, heights, rates = np.zeros(self.size), *np.split(road_row, 2)
        for spring in self.vehicle.springs:
            out += self._spring(spring)
        for bar in self.vehicle.bars:
            out += self._bar(bar)
        for tyre, height, rate in zip(self.vehicle.tyres, heights, rates, strict=True):
            place, rows = self._point(tyre.body, tyre.point)
            elastic = self.held.tyres[tyre.name] + tyre.stiffness * (height - place[2] + tyre.point[2])
            pressed = elastic + tyre.damping * (rate - rows[2] @ self.v)
            out += (max(min(pressed, 2.0 * elastic), 0.0) if tyre.pushes_only else pressed) * rows[2]
        for side in self.vehicle.side_forces:
            rows = self._point(side.body, side.point)[1]
            roll, yaw = (
                self.q[self.index[side.chassis, f]] if (side.chassis, f) in self.index else 0.0 for f in ("rx", "rz")
            )
            out += side.stiffness * (side.roll_steer * roll + yaw - rows[1] @ self.v / self.speed) * rows[1]
        for drag in self.vehicle.drags:
            row = self.motions[drag.body].shift[0]
            out -= drag.coefficient * self.speed * (row @ self.v) * row
        return out

    def _spring(self, spring: SpringDamper) -> np.ndarray:
        """Generalised forces (n,) of a spring-damper."""
        travel, row = self._travel(
            (spring.first_body, spring.first_point),
            (spring.second_body, spring.second_point),
            spring.axis,
            spring.frame,
        )
        rate = row @ self.v
        force = self.held.parts[spring.name] + spring.stiffness * travel + spring.damping * rate
        force += (spring.travel_force(travel) if spring.travel_force else 0.0) + (
            spring.rate_force(rate) if spring.rate_force else 0.0
        )
        return -(force + spring.friction * np.tanh(rate / spring.friction_rate)) * row

    def _bar(self, bar: AntiRollBar) -> np.ndarray:
        """Generalised forces (n,) of an anti-roll bar. Where the bar's frame is the body itself, the body's roll is not
        counted."""
        ends = (bar.right, bar.point_right), (bar.left, bar.point_left)
        apart, row = self._travel(*ends, (0.0, 0.0, 1.0), bar.frame)
        roll = np.eye(self.size)[self.index[bar.body, "rx"]] * (bar.frame != bar.body)
        turned, row = roll @ self.q - apart / bar.track, roll - row / bar.track
        moment = self.held.parts[bar.name] + bar.stiffness * turned + bar.damping * row @ self.v
        return np.asarray(-moment * row)

    def _travel(
        self, from_end: SpringEnd, to_end: SpringEnd, axis: Vector, frame: str | None
    ) -> tuple[float, np.ndarray]:
        """Distance (m) of two points along an axis less its value in the design position, axis . (point to_end - point
        from_end), and its derivatives (n,)."""
        (first, of_first), (second, of_second) = self._point(*from_end), self._point(*to_end)
        along, apart, row = np.array(axis), np.subtract(to_end[1], from_end[1]), np.zeros(self.size)
        if frame is not None:
            m = self.motions[frame]
            apart, along = m.rotation @ apart, m.rotation @ along
            row = np.cross(along, second - first) @ m.turn
        return float(along @ (second - first - apart)), row + along @ (of_second - of_first)
