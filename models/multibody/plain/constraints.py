"""Rigid constraints of a tree of bodies in plain numpy: their Jacobian, acceleration terms and violation at a state.

A constraint g(q) = 0 has rows J = dg/dq, and asks J q'' + J' q' = 0 of accelerations. Points kept together: g is the
vector between them. Axes kept parallel: g are the products of three pairs of axes of both bodies, which must be square
to each other: the same products as Exudyn's, so that paths that drift off by the error of a step drift alike.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from models.multibody.plain.motion import BIAS, FIRST_DERIVATIVE, GROUND, PLACE, RATE, Bodies, PlainMotion
from models.vehicles.spatial import Vector

Axes = tuple[np.ndarray, np.ndarray]
"""Axes of two bodies as columns in the design position, (3, 3) each."""
Joint = tuple[tuple[tuple[str | None, Vector], ...], Axes | None]
"""Two points of bodies (None: the ground) in the design position, m, that must coincide; and axes that must be
parallel, or None."""
PERPENDICULAR_AXES = ((2, 1), (2, 0), (0, 1))
"""Pairs of axes, one of the first and one of the second body, that are perpendicular where both bodies are oriented
alike."""


class ConstraintTerms(NamedTuple):
    """Acceleration-level terms of constraints at a state, J q'' = -J' q': Jacobian J (c, n), and J' q' (c,)."""

    jacobian: np.ndarray
    bias: np.ndarray


class ConstraintGap(NamedTuple):
    """Violation (c,) of constraints in m and rad at given coordinates, and its derivative (c, n)."""

    size: np.ndarray
    jacobian: np.ndarray


class PlainConstraints:
    """Linear constraints rows q = offsets with rows (r, n) and offsets (r,), and joints between bodies."""

    def __init__(
        self, bodies: Bodies, coupling_rows: np.ndarray, coupling_offsets: np.ndarray, joints: Sequence[Joint]
    ) -> None:
        self._bodies, self._rows, self._offsets = bodies, coupling_rows, coupling_offsets
        self._ends = bodies.points([end for ends, _ in joints for end in ends])
        turns = [(ends, axes) for ends, axes in joints if axes is not None]
        self._turns = [([bodies.row[name] if name else GROUND for name, _ in ends], axes) for ends, axes in turns]

    def terms(self, q: np.ndarray, v: np.ndarray) -> ConstraintTerms:
        """``ConstraintTerms`` of all constraints at coordinates and rates (n,)."""
        motion = self._bodies.move(q, v)
        terms = np.hstack(
            (self._point_vectors(motion), *(_axis_products(*each).T for each in self._joint_axes(motion)))
        )
        rest = np.concatenate((np.zeros(len(self._rows)), terms[BIAS]))
        return ConstraintTerms(np.vstack((self._rows, terms[FIRST_DERIVATIVE:].T)), rest)

    def gap(self, q: np.ndarray) -> ConstraintGap:
        """Violation of all constraints at coordinates (n,). Between axes it is the rotation vector, which vanishes only
        where the axes coincide."""
        motion = self._bodies.move(q, np.zeros_like(q))
        apart, turned = self._point_vectors(motion), [rotation_gap(*each) for each in self._joint_axes(motion)]
        size = np.concatenate((self._rows @ q - self._offsets, apart[PLACE], *(each.size for each in turned)))
        return ConstraintGap(
            size, np.vstack((self._rows, apart[FIRST_DERIVATIVE:].T, *(each.jacobian for each in turned)))
        )

    def _point_vectors(self, body_motion: PlainMotion) -> np.ndarray:
        """Vectors between the two points of each of p constraints, with their rates and derivatives, (3 + n, 3 p), rows
        as in a ``PlainMotion``."""
        ends = body_motion.at(self._ends)
        apart: np.ndarray = (ends[1::2] - ends[::2]).transpose(1, 0, 2).reshape(len(body_motion.matrices[0]), -1)
        return apart

    def _joint_axes(self, body_motion: PlainMotion) -> Iterator[list[np.ndarray]]:
        """Axes of both bodies of each joint as columns, with their rates and derivatives, (3 + n, 3, 3) for each
        body."""
        for rows, axes in self._turns:
            yield [body_motion.axes(row) @ columns for row, columns in zip(rows, axes, strict=True)]


def _axis_products(first_axes: np.ndarray, second_axes: np.ndarray) -> np.ndarray:
    """Scalar products (3, 3 + n) of three pairs of axes of two bodies, with rates and derivatives by the product
    rule."""
    terms = np.empty((len(PERPENDICULAR_AXES), len(first_axes)))
    for term, (i, j) in zip(terms, PERPENDICULAR_AXES, strict=True):
        axis, other = first_axes[:, :, i], second_axes[:, :, j]
        term[:] = axis @ other[PLACE] + other @ axis[PLACE]
        term[PLACE] /= 2.0
        term[BIAS] += 2.0 * axis[RATE] @ other[RATE]
    return terms


def rotation_gap(first_axes: np.ndarray, second_axes: np.ndarray) -> ConstraintGap:
    """Rotation vector (3,) from the first to the second axes, given in the first, and its derivative (3, n)."""
    turn = first_axes[PLACE].T @ second_axes[PLACE]
    change = (
        first_axes[FIRST_DERIVATIVE:].transpose(0, 2, 1) @ second_axes[PLACE]
        + first_axes[PLACE].T @ second_axes[FIRST_DERIVATIVE:]
    )
    return ConstraintGap(Rotation.from_matrix(turn).as_rotvec(), _rotation_vectors(change @ turn.T))


def angular_velocity_jacobian(body_axes: np.ndarray) -> np.ndarray:
    """Jacobian (3, n) from the coordinates' rates to a body's angular velocity in space; ``body_axes`` : the body's
    axes in a ``PlainMotion``."""
    return _rotation_vectors(body_axes[FIRST_DERIVATIVE:] @ body_axes[PLACE].T)


def _rotation_vectors(skew_matrices: np.ndarray) -> np.ndarray:
    """Rotation vectors (3, n) of n skew-symmetric matrices (3, 3)."""
    return np.array((skew_matrices[:, 2, 1], skew_matrices[:, 0, 2], skew_matrices[:, 1, 0]))
