"""Conversion between the coordinates of twinrig's description and those of MuJoCo.

Hinges and slides are the same in both but for the zero: here it is the design position, MuJoCo's ``qpos0``. Turning
without a limit (free and ball joints) has the angles rx, ry, rz here, R = Rx Ry Rz, and a quaternion with angular
velocities along the body's axes in MuJoCo. With v the rates here, MuJoCo's are J(q) v, its accelerations J a + J' v.
The angles are singular where ry is a quarter turn: states are drawn away from there.
"""

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

SLIDE_JOINT, BALL_JOINT, FREE_JOINT = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("SLIDE", "BALL", "FREE")
)


class MujocoState(NamedTuple):
    """MuJoCo's state: qpos (nq,), qvel (n,), the Jacobian J (n, n) from the rates of the description's coordinates to
    qvel, and J' v (n,) with these rates v."""

    qpos: np.ndarray
    qvel: np.ndarray
    jacobian: np.ndarray
    bias: np.ndarray


@dataclass(frozen=True)
class QuaternionJoint:
    """Three angles of the description in place of MuJoCo's quaternion: index of their first coordinate, index of the
    quaternion in qpos, axes (3, 3) of the body's frame in the design position as columns, and whether the quaternion is
    the attitude in space (free joint) or relative to the parent (ball joint)."""

    first_coordinate: int
    quaternion_index: int
    design_axes: np.ndarray
    free: bool


class ModelCoordinates:
    """Coordinates of one model, in the order of MuJoCo's degrees of freedom, and their conversion to MuJoCo's state."""

    def __init__(self, mujoco_model: mujoco.MjModel, design_data: mujoco.MjData) -> None:
        """design_data : data of the model in the design position, with kinematics computed."""
        self.size = int(mujoco_model.nv)
        self._zero = np.array(mujoco_model.qpos0)
        self._plain = list[tuple[int, int]]()
        self.turnings = list[QuaternionJoint]()
        for j in range(mujoco_model.njnt):
            kind, place, first = (
                int(mujoco_model.jnt_type[j]),
                int(mujoco_model.jnt_qposadr[j]),
                int(mujoco_model.jnt_dofadr[j]),
            )
            axes = design_data.xmat[mujoco_model.jnt_bodyid[j]].reshape(3, 3).copy()
            if kind == FREE_JOINT:
                self._plain += [(first + i, place + i) for i in range(3)]
                self.turnings.append(QuaternionJoint(first + 3, place + 3, axes, True))
            elif kind == BALL_JOINT:
                self.turnings.append(QuaternionJoint(first, place, axes, False))
            else:
                self._plain.append((first, place))

    def positions(self, states: np.ndarray) -> np.ndarray:
        """Coordinates (m, n) of MuJoCo's states (m, nq + n); NaN for rotations without limits."""
        out = np.full((len(states), self.size), np.nan)
        for coordinate, place in self._plain:
            out[:, coordinate] = states[:, place] - self._zero[place]
        return out

    def to_mujoco(self, q: np.ndarray, v: np.ndarray) -> MujocoState:
        """MuJoCo's state at coordinates and rates (n,)."""
        qpos, jacobian, rest = self._zero.copy(), np.eye(self.size), np.zeros(self.size)
        for coordinate, place in self._plain:
            qpos[place] += q[coordinate]
        for turning in self.turnings:
            at = slice(turning.first_coordinate, turning.first_coordinate + 3)
            rotation, rates, bias = rotation_by_angles(q[at], v[at])
            lies = (
                rotation @ turning.design_axes
                if turning.free
                else turning.design_axes.T @ rotation @ turning.design_axes
            )
            mujoco.mju_mat2Quat(
                qpos[turning.quaternion_index : turning.quaternion_index + 4], np.ascontiguousarray(lies).ravel()
            )
            jacobian[at, at], rest[at] = turning.design_axes.T @ rates, turning.design_axes.T @ bias
        return MujocoState(qpos, jacobian @ v, jacobian, rest)


def joint_coordinate_slices(mujoco_model: mujoco.MjModel) -> tuple[slice, ...]:
    """For every coordinate (n,), the slice of its joint's coordinates that together rotate or translate a body along
    three axes."""
    groups = list[slice]()
    for j in range(mujoco_model.njnt):
        first = int(mujoco_model.jnt_dofadr[j])
        starts = {FREE_JOINT: (first, first + 3), BALL_JOINT: (first,)}.get(int(mujoco_model.jnt_type[j]), ())
        groups += [slice(start, start + 3) for start in starts for _ in range(3)] or [slice(first, first + 1)]
    return tuple(groups)


def rotation_by_angles(angles: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotation matrix R = Rx Ry Rz (3, 3) of three angles; G (3, 3), such that G rates is the angular velocity in the
    rotated axes; and G' rates (3,)."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(angles), np.cos(angles)
    first = np.array(((1.0, 0.0, 0.0), (0.0, ca, -sa), (0.0, sa, ca)))
    second = np.array(((cb, 0.0, sb), (0.0, 1.0, 0.0), (-sb, 0.0, cb)))
    third = np.array(((cc, -sc, 0.0), (sc, cc, 0.0), (0.0, 0.0, 1.0)))
    gains = np.array(((cb * cc, sc, 0.0), (-cb * sc, cc, 0.0), (sb, 0.0, 1.0)))
    a, b, c = rates
    change = np.array(
        ((-sb * cc * b - cb * sc * c, cc * c, 0.0), (sb * sc * b - cb * cc * c, -sc * c, 0.0), (cb * b, 0.0, 0.0))
    )
    return first @ second @ third, gains, change @ np.array((a, b, c))
