"""How the body of a mechanism moved, and what passed to the ground, in the axes of the ground."""

from dataclasses import dataclass

import numpy as np

from validation.adams_joints.mechanism import Mechanism


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a body. times (m,) s; place, velocity, acceleration (m, 3) of its centre; turned (m, 3, 3): rotation
    since the start; turning, spin_up (m, 3): angular velocity (rad/s) and angular acceleration (rad/s^2)."""

    times: np.ndarray
    place: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    turned: np.ndarray
    turning: np.ndarray
    spin_up: np.ndarray


@dataclass(frozen=True, eq=False)
class Reaction:
    """Sum of the forces of joint and springs: force (m, 3) in N and moment (m, 3) in N m about a marker. They act on
    the ground and are about its marker; where the joint's first marker is the body's, they act on the body."""

    force: np.ndarray
    moment: np.ndarray


def reaction_by_momentum(mechanism: Mechanism, motion: BodyMotion) -> Reaction:
    """Reaction of joint and springs by Newton's and Euler's equations, from the body's accelerations and weight."""
    inertia = motion.turned @ mechanism.inertia @ np.transpose(motion.turned, (0, 2, 1))
    force = mechanism.mass * (motion.acceleration - mechanism.gravity)
    momentum = np.einsum("mij,mj->mi", inertia, motion.turning)
    moment = np.einsum("mij,mj->mi", inertia, motion.spin_up) + np.cross(motion.turning, momentum)
    return about_marker(mechanism, motion, force, moment)


def about_marker(mechanism: Mechanism, motion: BodyMotion, force: np.ndarray, moment: np.ndarray) -> Reaction:
    """The reaction about its marker, from the force and moment (m, 3) that act on the body about its centre."""
    if mechanism.on_body:
        arm = np.einsum("mij,j->mi", motion.turned, mechanism.centre - mechanism.body.place)
        return Reaction(force, moment + np.cross(arm, force))
    return Reaction(-force, -moment - np.cross(motion.place - mechanism.ground.place, force))


def marker_axes(mechanism: Mechanism, motion: BodyMotion) -> np.ndarray:
    """Axes (m, 3, 3) of the marker at the body's centre, as columns, over time."""
    return motion.turned @ mechanism.axes
