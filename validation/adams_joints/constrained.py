"""Independent reference: a free rigid body with joint constraints, whose Lagrange multipliers are the joint's forces.

Newton's and Euler's equations of six freedoms, with the second derivative of each constraint as a further row. Nothing
is shared with the trees of joints that the engines build: no joint coordinates, and reactions come from multipliers
instead of accelerations. Rotation is a quaternion. Classical Runge-Kutta steps; constraints drift by its error alone.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from models.core.errors import InputError
from models.core.runge_kutta import runge_kutta_step
from validation.adams_joints.mechanism import Mechanism
from validation.adams_joints.motion import BodyMotion, Reaction, reaction_about_marker

POSITION, QUATERNION, VELOCITY, ANGULAR_VELOCITY, ANGLE = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13), 13
"""Positions in a state (14,): centre, quaternion (scalar last), velocity, angular velocity, angle about the joint's
axis."""
START_VELOCITY_TOLERANCE = 1e-9
"""Largest start velocity (m/s, rad/s) against the joint's constraints."""


class ConstrainedBody:
    """Equations of motion of a rigid body on a joint, with constraints and multipliers."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.arm = mechanism.body_marker.position - mechanism.centre
        self.joint_axes = mechanism.ground_marker.axes.T

    def start(self) -> np.ndarray:
        """State (14,) at the start. Raises InputError where the joint does not allow the start velocity."""
        m = self.mechanism
        state = np.concatenate([m.centre, [0.0, 0.0, 0.0, 1.0], m.velocity, m.angular_velocity, [0.0]])
        rows, _ = self._constraints(state)
        speed = rows @ state[7:13]
        if speed.size and np.abs(speed).max() > START_VELOCITY_TOLERANCE:
            raise InputError("", "PART, V and W", speed.tolist(), "is no velocity that the joint allows at the start")
        return state

    def rates(self, body_state: np.ndarray) -> np.ndarray:
        """Time derivatives (14,) of a state."""
        quaternion, turning = body_state[QUATERNION], body_state[ANGULAR_VELOCITY]
        x, y, z, w = quaternion
        product = np.array(  # of the angular velocity and the quaternion
            [
                turning[0] * w + turning[1] * z - turning[2] * y,
                turning[1] * w + turning[2] * x - turning[0] * z,
                turning[2] * w + turning[0] * y - turning[1] * x,
                -turning @ quaternion[:3],
            ]
        )
        accelerations, _ = self.accelerations_and_reaction(body_state)
        axis_rate = self.joint_axes[2] @ turning
        return np.concatenate([body_state[VELOCITY], 0.5 * product, accelerations, [axis_rate]])

    def accelerations_and_reaction(self, body_state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Linear and angular accelerations (6,) of the body, and the joint's force and moment (6,) on the body about
        its centre."""
        m, rotation = self.mechanism, _rotation_matrix(body_state[QUATERNION])
        inertia = rotation @ m.inertia @ rotation.T
        turning = body_state[ANGULAR_VELOCITY]
        applied = self.springs(body_state)
        applied[:3] += m.mass * m.gravity
        applied[3:] -= _vector_product(turning, inertia @ turning)
        rows, wanted = self._constraints(body_state)
        mass = np.zeros((6, 6))
        mass[:3, :3], mass[3:, 3:] = m.mass * np.eye(3), inertia
        count = len(rows)
        saddle_matrix = np.block([[mass, -rows.T], [rows, np.zeros((count, count))]])
        answer = np.linalg.solve(saddle_matrix, np.concatenate([applied, wanted]))
        return answer[:6], rows.T @ answer[6:]

    def springs(self, body_state: np.ndarray) -> np.ndarray:
        """Force and moment (6,) of all springs on the body about its centre."""
        wrench, rotation = np.zeros(6), _rotation_matrix(body_state[QUATERNION])
        for spring in self.mechanism.springs:
            if spring.is_rotational:
                law = spring.stiffness * (body_state[ANGLE] - spring.free_length)
                law += spring.damping * (self.joint_axes[2] @ body_state[ANGULAR_VELOCITY])
                wrench[3:] -= law * self.joint_axes[2]
                continue
            arm = rotation @ (spring.body_point - self.mechanism.centre)
            offset = body_state[POSITION] + arm - spring.ground_point
            length = np.linalg.norm(offset)
            if length > 0.0:
                direction = offset / length
                speed = direction @ (body_state[VELOCITY] + _vector_product(body_state[ANGULAR_VELOCITY], arm))
                force = -(spring.stiffness * (length - spring.free_length) + spring.damping * speed) * direction
                wrench += np.concatenate([force, _vector_product(arm, force)])
        return wrench

    def _constraints(self, body_state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Matrix (c, 6) of the joint's constraints on the accelerations, and its right-hand side (c,)."""
        kind, turning = self.mechanism.joint_kind, body_state[ANGULAR_VELOCITY]
        rotation = _rotation_matrix(body_state[QUATERNION])
        arm = rotation @ self.arm
        point = np.hstack([np.eye(3), -_skew_matrix(arm)])
        bent = -_vector_product(turning, _vector_product(turning, arm))
        turn, still = np.hstack([np.zeros((3, 3)), np.eye(3)]), np.zeros(3)
        axes = self.joint_axes
        if kind == "revolute":
            return np.vstack([point, axes[:2] @ turn]), np.concatenate([bent, still[:2]])
        if kind == "prismatic":
            return np.vstack([axes[:2] @ point, turn]), np.concatenate([axes[:2] @ bent, still])
        if kind == "cylindrical":
            return np.vstack([axes[:2] @ point, axes[:2] @ turn]), np.concatenate([axes[:2] @ bent, still[:2]])
        if kind == "spherical":
            return point, bent
        if kind == "universal":
            on_body = rotation @ self.mechanism.body_marker.axes[:, 2]
            row = _vector_product(on_body, axes[2]) @ turn
            swing = -axes[2] @ _vector_product(turning, _vector_product(turning, on_body))
            return np.vstack([point, row]), np.append(bent, swing)
        if kind == "distance":
            offset = body_state[POSITION] + arm - self.mechanism.ground_marker.position
            speed = body_state[VELOCITY] + _vector_product(turning, arm)
            return (offset @ point)[None], np.array([offset @ bent - speed @ speed])
        return np.empty((0, 6)), np.empty(0)

    def state_at_row(self, recorded_motion: BodyMotion, row_index: int) -> np.ndarray:
        """State (14,) of the body at a row of a recorded motion, with the angle about the joint's axis set to zero."""
        quaternion = Rotation.from_matrix(recorded_motion.rotation[row_index]).as_quat()
        return np.concatenate(
            [
                recorded_motion.position[row_index],
                quaternion,
                recorded_motion.velocity[row_index],
                recorded_motion.angular_velocity[row_index],
                [0.0],
            ]
        )

    def state_after(self, start_state: np.ndarray, step_count: int, time_step: float) -> np.ndarray:
        """State (14,) after ``step_count`` Runge-Kutta steps of length ``time_step`` (s)."""
        for _ in range(step_count):
            start_state = self._after_step(start_state, time_step)
        return start_state

    def run(self, duration: float, time_step: float, steps_per_row: int) -> tuple[BodyMotion, Reaction]:
        """Motion of the body and reaction of the joint by the classical Runge-Kutta method, recorded at every
        ``steps_per_row``-th step (s)."""
        state, states_kept = self.start(), list[np.ndarray]()
        for k in range(round(duration / time_step) + 1):
            if k % steps_per_row == 0:
                states_kept.append(state)
            state = self._after_step(state, time_step)
        return self._motion_and_reaction(np.array(states_kept), time_step * steps_per_row)

    def _after_step(self, body_state: np.ndarray, time_step: float) -> np.ndarray:
        next_state = runge_kutta_step(lambda _, stage_state: self.rates(stage_state), 0.0, body_state, time_step)
        next_state[QUATERNION] /= np.linalg.norm(next_state[QUATERNION])
        return next_state

    def _motion_and_reaction(self, body_states: np.ndarray, row_period: float) -> tuple[BodyMotion, Reaction]:
        solved = [self.accelerations_and_reaction(state) for state in body_states]
        accelerations = np.array([solution[0] for solution in solved])
        wrenches = np.array(
            [wrench + self.springs(state) for (_, wrench), state in zip(solved, body_states, strict=True)]
        )
        motion = BodyMotion(
            row_period * np.arange(len(body_states)),
            body_states[:, POSITION],
            body_states[:, VELOCITY],
            accelerations[:, :3],
            np.array([_rotation_matrix(state[QUATERNION]) for state in body_states]),
            body_states[:, ANGULAR_VELOCITY],
            accelerations[:, 3:],
        )
        return motion, reaction_about_marker(self.mechanism, motion, wrenches[:, :3], wrenches[:, 3:])


def _vector_product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of two vectors; numpy's takes ten times as long for so few numbers."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _skew_matrix(vector: np.ndarray) -> np.ndarray:
    """Skew-symmetric matrix (3, 3) that forms the vector product of ``vector`` with another vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _rotation_matrix(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) of a quaternion (scalar last), which is normalised first."""
    x, y, z, w = quaternion / np.sqrt(quaternion @ quaternion)
    skew_part = _skew_matrix(np.array([x, y, z]))
    return np.eye(3) + 2.0 * (w * skew_part + skew_part @ skew_part)
