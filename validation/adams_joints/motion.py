"""Motion of a mechanism's body and reaction of its joint and springs, in the axes of the ground."""

from dataclasses import dataclass

import numpy as np

from validation.adams_joints.mechanism import Mechanism


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a body. times (m,) s; position, velocity, acceleration (m, 3) of its centre; rotation (m, 3, 3) since
    the start; angular_velocity (m, 3) in rad/s; angular_acceleration (m, 3) in rad/s^2."""

    times: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    rotation: np.ndarray
    angular_velocity: np.ndarray
    angular_acceleration: np.ndarray


@dataclass(frozen=True, eq=False)
class Reaction:
    """Sum of the forces of joint and springs: force (m, 3) in N and moment (m, 3) in N m about a marker. They act on
    the ground, about the ground's marker; where the joint's first marker lies on the body, they act on the body."""

    force: np.ndarray
    moment: np.ndarray


def reaction_by_momentum(mechanism: Mechanism, body_motion: BodyMotion) -> Reaction:
    """Reaction of joint and springs from the body's accelerations and weight, by Newton's and Euler's equations."""
    inertia = body_motion.rotation @ mechanism.inertia @ np.transpose(body_motion.rotation, (0, 2, 1))
    force = mechanism.mass * (body_motion.acceleration - mechanism.gravity)
    momentum = np.einsum("mij,mj->mi", inertia, body_motion.angular_velocity)
    moment = np.einsum("mij,mj->mi", inertia, body_motion.angular_acceleration) + np.cross(
        body_motion.angular_velocity, momentum
    )
    return reaction_about_marker(mechanism, body_motion, force, moment)


def reaction_about_marker(
    mechanism: Mechanism, body_motion: BodyMotion, force: np.ndarray, moment: np.ndarray
) -> Reaction:
    """Reaction about the joint's marker, from the force and moment (m, 3) that act on the body about its centre."""
    if mechanism.is_first_marker_on_body:
        arm = np.einsum("mij,j->mi", body_motion.rotation, mechanism.centre - mechanism.body_marker.position)
        return Reaction(force, moment + np.cross(arm, force))
    return Reaction(-force, -moment - np.cross(body_motion.position - mechanism.ground_marker.position, force))


def marker_axes(mechanism: Mechanism, body_motion: BodyMotion) -> np.ndarray:
    """Axes (m, 3, 3) of the marker at the body's centre over time, as columns, in the axes of the ground."""
    return body_motion.rotation @ mechanism.axes
