"""Kinematics of bodies on joints by products of matrices, with the mass matrix and the inertia forces.

The place of a body is a matrix T (3, 4): rotation and centre. It is the product of its parent's, of the arm to its
own centre, and of one factor exp(q G) per freedom, G the constant generator of a shift or a turn. The product rule
gives T's derivative by every coordinate, its rate, and its second rate without any q''. With a body's pseudo-inertia
P (4, 4), second moments of mass about its centre and its mass,

    M_ij = sum tr(dT/dq_i P dT/dq_j^T),    h_i = sum tr(dT/dq_i P (T'' without q'')^T)

(Lagrange's equations after Uicker, 1965). There is no angular velocity, no vector product and no Euler equation in
them, which the compiled tree and both engines are made of.
"""

from dataclasses import dataclass

import numpy as np

from models.vehicles.spatial import FREEDOMS, PARALLEL, Freedom, SpatialVehicle, Vector

GROUND = 0
"""Index of the ground, which is at rest in space, among the bodies."""
PLACE, RATE, BIAS, FIRST_DERIVATIVE = range(4)
"""Row indices of a body's matrices: T, T', T'' without q'', and the first of the derivatives dT/dq_i."""


def motion_generator(freedom: Freedom, axes: tuple[Vector, Vector, Vector] = PARALLEL) -> np.ndarray:
    """Generator matrix G (4, 4) of a translation along, or a rotation about, one of the axes (rows)."""
    kind, matrix = FREEDOMS.index(freedom), np.zeros((4, 4))
    x, y, z = axes[kind % 3]
    if kind < 3:
        matrix[:3, 3] = x, y, z
    else:
        matrix[:3, :3] = (0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)
    return matrix


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Points on bodies: indices of their bodies (p,), and homogeneous coordinates from the bodies' centres (p, 4), in
    m, the last one 1."""

    rows: np.ndarray
    arms: np.ndarray


@dataclass(frozen=True, eq=False)
class PlainMotion:
    """Motion of all bodies at one state: matrices (bodies + 1, 3 + n, 3, 4), rows as above; the first body is the
    ground."""

    matrices: np.ndarray

    def at(self, body_points: BodyPoints) -> np.ndarray:
        """Motion (p, 3 + n, 3) of points in space: position (m), velocity, acceleration without the q'' terms, then
        derivatives by q."""
        rows = self.matrices[body_points.rows]
        count = rows.shape[1]
        return np.matmul(rows.reshape(len(rows), 3 * count, 4), body_points.arms[:, :, None]).reshape(
            len(rows), count, 3
        )

    def axes(self, body_index: int) -> np.ndarray:
        """Axes of a body as columns, their rates, second derivatives without the q'' terms, and derivatives by q: (3 +
        n, 3, 3), in this order."""
        axes: np.ndarray = self.matrices[body_index, :, :, :3]
        return axes

    def angular_velocity(self, body_index: int) -> np.ndarray:
        """Angular velocity (3,) in rad/s of a body in space: half the sum of the products axis x rate of axis."""
        axes = self.axes(body_index)
        spin = axes[RATE] @ axes[PLACE].T
        return np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]) / 2.0

    def moment_forces(self, body_index: int, moment: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) of a moment M (N m, in space) on a body, applied as couples of forces M x axis / 2 at
        the body's axes."""
        axes = self.axes(body_index)
        x, y, z = moment.tolist()
        couples = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))) @ axes[PLACE] / 2.0
        return axes[FIRST_DERIVATIVE:].reshape(-1, 9) @ couples.ravel()


class Bodies:
    """Masses, inertias and joints of a vehicle's bodies (kg, m, kg m^2), from which their motion follows."""

    def __init__(self, vehicle: SpatialVehicle) -> None:
        self.places = vehicle.coordinates()
        self.size = len(self.places)
        self.row = {body.name: i + 1 for i, body in enumerate(vehicle.bodies)}
        self.position = {body.name: np.array(body.position, float) for body in vehicle.bodies}
        self._mass = np.array([body.mass for body in vehicle.bodies])
        self._parent = [self.row[body.parent] if body.parent else GROUND for body in vehicle.bodies]
        self._arms = [self._arm(vehicle, body.name) for body in vehicle.bodies]
        coordinates = [[i for i, (name, _) in enumerate(self.places) if name == body.name] for body in vehicle.bodies]
        self._coordinates = coordinates
        self._generators = np.array([motion_generator(f, vehicle.body(name).axes) for name, f in self.places])
        self._squares = self._generators @ self._generators
        self._turns = np.array([freedom.startswith("r") for _, freedom in self.places])
        self._inertia = np.array([_pseudo_inertia(body.mass, np.array(body.inertia)) for body in vehicle.bodies])

    def _arm(self, vehicle: SpatialVehicle, body_name: str) -> np.ndarray:
        """Translation (4, 4) from the centre of the parent body, or from the origin, to the centre of a body."""
        parent, arm = vehicle.body(body_name).parent, np.eye(4)
        arm[:3, 3] = self.position[body_name] - (self.position[parent] if parent else 0.0)
        return arm

    def index(self, body_name: str, freedom: str) -> int:
        """Index of a body's coordinate; -1 if the body does not have this freedom."""
        place = (body_name, freedom)
        return self.places.index(place) if place in self.places else -1

    def points(self, bodies_and_positions: list[tuple[str | None, Vector | np.ndarray]]) -> BodyPoints:
        """``BodyPoints`` of this vehicle, from pairs of a body (None for space) and a position in the design position
        (m)."""
        rows = [self.row[body] if body else GROUND for body, _ in bodies_and_positions]
        arms = [
            [*np.subtract(point, self.position[body] if body else 0.0), 1.0] for body, point in bodies_and_positions
        ]
        return BodyPoints(np.array(rows, int), np.array(arms, float).reshape(-1, 4))

    def move(self, q: np.ndarray, v: np.ndarray) -> PlainMotion:
        """Motion of all bodies at coordinates (m, rad) and rates (per s), (n,)."""
        matrices = np.zeros((len(self._parent) + 1, FIRST_DERIVATIVE + self.size, 3, 4))
        matrices[GROUND, PLACE, :, :3] = np.eye(3)
        first, second = np.where(self._turns, np.sin(q), q), np.where(self._turns, 1.0 - np.cos(q), 0.0)
        steps = np.eye(4) + first[:, None, None] * self._generators + second[:, None, None] * self._squares
        for i, (parent, arm, coordinates) in enumerate(zip(self._parent, self._arms, self._coordinates, strict=True)):
            rows = (matrices[parent].reshape(-1, 4) @ arm).reshape(-1, 3, 4)
            for j in coordinates:
                rows = self._joint(rows, j, steps[j], float(v[j]))
            matrices[i + 1] = rows
        return PlainMotion(matrices)

    def _joint(
        self, parent_matrices: np.ndarray, joint_index: int, joint_transform: np.ndarray, joint_rate: float
    ) -> np.ndarray:
        """Rows of the matrices of the body behind joint j, from those before the joint, by the product rule."""
        rows = (parent_matrices.reshape(-1, 4) @ joint_transform).reshape(-1, 3, 4)
        turned = (rows[:BIAS].reshape(-1, 4) @ self._generators[joint_index]).reshape(-1, 3, 4)
        rows[FIRST_DERIVATIVE + joint_index] = turned[PLACE]
        rows[RATE] += joint_rate * turned[PLACE]
        rows[BIAS] += 2.0 * joint_rate * turned[RATE] + joint_rate * joint_rate * (
            rows[PLACE] @ self._squares[joint_index]
        )
        return rows

    def inertia(self, body_motion: PlainMotion, gravity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix (n, n), and forces (n,): weights by gravity (3,) in m/s^2, less inertia forces without the q''
        terms."""
        columns = body_motion.matrices[1:, FIRST_DERIVATIVE:]
        count = self.size
        weighted = (columns.reshape(len(columns), -1, 4) @ self._inertia).reshape(columns.shape)
        flat = weighted.transpose(1, 0, 2, 3).reshape(count, -1)
        mass = flat @ columns.transpose(1, 0, 2, 3).reshape(count, -1).T
        weights = np.tensordot(self._mass, columns[:, :, :, 3], 1) @ gravity
        return mass, weights - flat @ body_motion.matrices[1:, BIAS].ravel()


def _pseudo_inertia(mass: float, inertia: np.ndarray) -> np.ndarray:
    """Pseudo-inertia matrix (4, 4) of a body: second moments of mass about its centre (kg m^2), from the inertia
    tensor, and its mass."""
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    matrix[3, 3] = mass
    return matrix
