"""The mechanism of the Adams file as a vehicle description for the engines: a chain of slides and hinges.

The vehicle's axes are laid along those of the joint, so that slides and hinges need no others; gravity then points
anywhere. A universal joint is two hinges, a ball three, a distance a massless rod on two hinges with a ball at its end:
neither engine then needs a constraint, and a step costs no projection. Three hinges in a row cannot tell the first
from the last where the second has turned by 90 degrees, as two cannot once the rod lies along the first: of several
ways to lay the axes the one is taken that stays farthest from there on the reference's path.
"""

from dataclasses import dataclass, replace

import numpy as np

from models.core.errors import InputError, Refused
from models.engines.assembly import Settings
from models.engines.free_vehicle import LoadedVehicle, free_model
from models.vehicles.free_vehicle import joint_table
from models.vehicles.spatial import FREEDOMS, Body, SpatialVehicle, Vector
from validation.adams_joints.mechanism import Mechanism
from validation.adams_joints.motion import BodyMotion, Reaction, reaction_by_momentum
from validation.adams_joints.spring_kernel import set_spring_forces, spring_forces, spring_table

LEAST_COSINE = 0.05
"""Least cosine of the second hinge's angle, of three hinges in a row, anywhere on the path."""
START_VELOCITY_TOLERANCE = 1e-9
"""Largest component (m/s, rad/s) of the start velocity that may remain outside the joints' freedom."""
BODY_NAME = "body"


@dataclass(frozen=True, eq=False)
class JointTree:
    """A mechanism as a chain of slides and hinges. axes (3, 3): the vehicle's axes as columns, in the ground's axes."""

    mechanism: Mechanism
    axes: np.ndarray

    def to_vehicle_axes(self, vector: np.ndarray) -> np.ndarray:
        """Components in the vehicle's axes of a vector (3,) given in the ground's axes."""
        return self.axes.T @ vector

    def vehicle(self) -> SpatialVehicle:
        """Vehicle description of the mechanism: its joints as massless bodies, then the body at its centre."""
        m = self.mechanism
        ground, end = (
            _vector_of(self.to_vehicle_axes(m.ground_marker.position)),
            _vector_of(self.to_vehicle_axes(m.body_marker.position)),
        )
        joint_bodies = {
            "revolute": [Body("joint", 0.0, end, ("rz",))],
            "prismatic": [Body("joint", 0.0, end, ("z",))],
            "cylindrical": [Body("joint", 0.0, end, ("z", "rz"))],
            "spherical": [Body("joint", 0.0, end, ("rx", "ry", "rz"))],
            "universal": [Body("cross", 0.0, end, ("rx",)), Body("joint", 0.0, end, ("ry",), parent="cross")],
            "distance": [
                Body("rod", 0.0, ground, ("rx", "ry")),
                Body("joint", 0.0, end, ("rx", "ry", "rz"), parent="rod"),
            ],
            "free": [Body("joint", 0.0, _vector_of(self.to_vehicle_axes(m.centre)), FREEDOMS)],
        }[m.joint_kind]
        inertia = self.axes.T @ m.inertia @ self.axes
        rows = tuple(_vector_of(row) for row in 0.5 * (inertia + inertia.T))
        body = Body(
            BODY_NAME,
            m.mass,
            _vector_of(self.to_vehicle_axes(m.centre)),
            (),
            (rows[0], rows[1], rows[2]),
            joint_bodies[-1].name,
        )
        return SpatialVehicle("mechanism", (*joint_bodies, body), (), (), ())

    def vehicle_with_springs(self) -> LoadedVehicle:
        """The vehicle description for the engines, with the springs as compiled forces."""
        vehicle = self.vehicle()
        springs = [
            replace(
                spring,
                ground_point=self.to_vehicle_axes(spring.ground_point),
                body_point=self.to_vehicle_axes(spring.body_point),
            )
            for spring in self.mechanism.springs
        ]
        gravity = self.to_vehicle_axes(self.mechanism.gravity)
        return LoadedVehicle(vehicle, gravity, spring_table(vehicle, springs), spring_forces, set_spring_forces)

    def motion(self, times: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> BodyMotion:
        """Motion of the body in the axes of the ground, from coordinates q, rates v and accelerations a (m, n) of the
        joints."""
        position, velocity, acceleration, rotation, turning, angular_acceleration = _motion_of_last_body(
            self.vehicle(), q, v, a
        )
        to_ground = self.axes.T
        return BodyMotion(
            times,
            position @ to_ground,
            velocity @ to_ground,
            acceleration @ to_ground,
            self.axes @ rotation @ to_ground,
            turning @ to_ground,
            angular_acceleration @ to_ground,
        )

    def start_rates(self) -> np.ndarray:
        """Rates (n,) of the joint coordinates at the start. Raises InputError where the joint does not allow the body's
        velocity."""
        n = len(self.vehicle().coordinates())
        zero, unit = np.zeros((n, n)), np.eye(n)
        unit_motions = self.motion(np.zeros(n), zero, unit, zero)
        columns = np.hstack([unit_motions.velocity, unit_motions.angular_velocity]).T
        wanted = np.concatenate([self.mechanism.velocity, self.mechanism.angular_velocity])
        rates = np.linalg.lstsq(columns, wanted, rcond=None)[0]
        if np.abs(columns @ rates - wanted).max() > START_VELOCITY_TOLERANCE:
            raise InputError("", "PART, V and W", wanted.tolist(), "is no velocity that the joint allows at the start")
        return rates

    def run(self, engine: str, duration: float, time_step: float, steps_per_row: int) -> tuple[BodyMotion, Reaction]:
        """Motion and reaction of the mechanism in an engine, at every ``steps_per_row``-th step (s). The reaction
        follows from the engine's accelerations by Newton's and Euler's equations."""
        model = free_model(engine, self.vehicle_with_springs(), Settings("RK44", time_step, duration))
        rates = self.start_rates()
        states = model.march(0.0 * rates, rates, round(duration / time_step), time_step)[::steps_per_row]
        q, v = np.split(states, 2, axis=1)
        motion_times = time_step * steps_per_row * np.arange(len(q))
        a = np.array([model.acceleration(t, *row) for t, *row in zip(motion_times.tolist(), q, v, strict=True)])
        motion = self.motion(motion_times, q, v, a)
        return motion, reaction_by_momentum(self.mechanism, motion)


def joint_tree(mechanism: Mechanism, body_path: BodyMotion) -> JointTree:
    """The joint chain whose hinges stay farthest from a singularity along a path. Raises Refused where every chain
    comes too near to one."""
    trees = [JointTree(mechanism, axes) for axes in _candidate_axes(mechanism)]
    hinge_cosines = [_least_hinge_cosine(tree, body_path) for tree in trees]
    best = int(np.argmax(hinge_cosines))
    if hinge_cosines[best] < LEAST_COSINE:
        raise Refused("joint tree", "the body turns so far that two hinges of its ball fall into one in every layout")
    return trees[best]


def _candidate_axes(mechanism: Mechanism) -> list[np.ndarray]:
    """Candidate axes (3, 3) for the chain of joints, as columns."""
    if mechanism.joint_kind in ("revolute", "prismatic", "cylindrical"):
        return [mechanism.ground_marker.axes]
    if mechanism.joint_kind == "universal":
        x, y = mechanism.ground_marker.axes[:, 2], mechanism.body_marker.axes[:, 2]
        return [np.column_stack([x, y, np.cross(x, y)])]
    arm = (
        mechanism.body_marker.position if mechanism.joint_kind == "distance" else mechanism.centre
    ) - mechanism.ground_marker.position
    arm_direction = arm / np.linalg.norm(arm) if np.linalg.norm(arm) > 0.0 else np.array([0.0, 0.0, 1.0])
    side = np.cross(arm_direction, mechanism.gravity)
    if np.linalg.norm(side) < 1e-6 * (1.0 + np.linalg.norm(mechanism.gravity)):
        side = np.cross(arm_direction, np.eye(3)[np.argmin(np.abs(arm_direction))])
    x = side / np.linalg.norm(side)
    base = np.column_stack([x, np.cross(arm_direction, x), arm_direction])
    if mechanism.joint_kind == "distance":
        return [base, np.column_stack([base[:, 1], -base[:, 0], base[:, 2]])]
    return [np.roll(base, shift, axis=1) for shift in range(3)]


def _least_hinge_cosine(chain_of_joints: JointTree, body_path: BodyMotion) -> float:
    """Least cosine of the second hinge's angle of a ball joint or rod along a path: 0 at the hinges' singularity, 1
    where the mechanism has no such hinge."""
    if chain_of_joints.mechanism.joint_kind not in ("spherical", "free", "distance"):
        return 1.0
    rotation = chain_of_joints.axes.T @ body_path.rotation @ chain_of_joints.axes
    if chain_of_joints.mechanism.joint_kind != "distance":
        return float(np.sqrt(1.0 - np.minimum(rotation[:, 0, 2] ** 2, 1.0)).min())
    m = chain_of_joints.mechanism
    end = body_path.position + body_path.rotation @ (m.body_marker.position - m.centre)
    d = (end - m.ground_marker.position) @ chain_of_joints.axes / m.rod_length
    of_rod = np.sqrt(np.maximum(1.0 - d[:, 0] ** 2, 0.0))
    tilt = np.arctan2(-d[:, 1], d[:, 2])
    first = np.column_stack([of_rod, d[:, 0] * np.sin(tilt), -d[:, 0] * np.cos(tilt)])  # the rod's own x axis
    of_ball = np.sqrt(1.0 - np.minimum(np.einsum("mi,mi->m", first, rotation[:, :, 2]) ** 2, 1.0))
    return float(min(of_rod.min(), of_ball.min()))


def _motion_of_last_body(
    vehicle: SpatialVehicle, q: np.ndarray, v: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Motion of the last body of a chain in the vehicle's axes: position, velocity, acceleration (m, 3), rotation (m,
    3, 3), angular velocity and angular acceleration (m, 3). It is computed by relative motion from joint to joint."""
    count = len(q)
    x, w, alpha = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 3))
    speed, gain, rotation = np.zeros((count, 3)), np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    kinds, origin = joint_table(vehicle), np.zeros(3)
    kinds_and_arms = [(int(kind), tuple(arm)) for kind, _, *arm in kinds]
    for j, (kind, arm) in enumerate(kinds_and_arms):
        origin = origin + arm
        axis = rotation[:, :, kind % 3]
        reach = rotation @ np.array(arm) + (axis * q[:, j : j + 1] if kind < 3 else 0.0)
        x, gain = x + reach, gain + np.cross(alpha, reach) + np.cross(w, np.cross(w, reach))
        speed = speed + np.cross(w, reach)
        rate, angular_acceleration_part = axis * v[:, j : j + 1], axis * a[:, j : j + 1]
        if kind < 3:
            speed, gain = speed + rate, gain + angular_acceleration_part + 2.0 * np.cross(w, rate)
        else:
            w, alpha = w + rate, alpha + angular_acceleration_part + np.cross(w, rate)
            rotation = rotation @ _rotations_about(kind % 3, q[:, j])
    reach = rotation @ (np.array(vehicle.bodies[-1].position) - origin)
    gain = gain + np.cross(alpha, reach) + np.cross(w, np.cross(w, reach))
    return x + reach, speed + np.cross(w, reach), gain, rotation, w, alpha


def _rotations_about(axis_number: int, angles: np.ndarray) -> np.ndarray:
    """Rotation matrices (m, 3, 3) about the coordinate axis number ``axis_number`` by angles (m,) in rad."""
    i, j = (axis_number + 1) % 3, (axis_number + 2) % 3
    turns = np.tile(np.eye(3), (len(angles), 1, 1))
    turns[:, i, i] = turns[:, j, j] = np.cos(angles)
    turns[:, j, i] = np.sin(angles)
    turns[:, i, j] = -turns[:, j, i]
    return turns


def _vector_of(components: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in components)
    return x, y, z
