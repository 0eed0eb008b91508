"""Rigid constraints of a user's model: the constraint forces, and states that satisfy the constraints."""

from collections.abc import Callable, Sequence

import numpy as np

from models.multibody.plain.constraints import PlainConstraints
from models.multibody.plain.motion import Bodies
from models.own_model.equalities import coupling_rows
from models.own_model.reading import TwinModel

REDUNDANT_SHARE = 1e-9
"""Share of the largest singular value of the constraint Jacobian below which a combination of its rows counts as
redundant."""
DIFFERENCE_STRIDE = 0.02
"""Distance (rad, m), summed over all coordinates, between neighbouring states of finite differences."""
DIFFERENCE_WEIGHTS = (45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0)
"""Weights of central differences of order 6, over one, two and three strides to either side."""
SATISFIED_GAP, MOST_CORRECTIONS, LONGEST_CORRECTION = 1e-12, 60, 0.5
"""Violation (m, rad) below which constraints are satisfied; largest count of Newton steps to get there; the longest of
these steps (m, rad)."""

JacobianAt = Callable[[Sequence[np.ndarray]], Sequence[np.ndarray]]
"""Function that returns the constraint Jacobian J (c, n) at each of some coordinates (n,)."""
Ranges = tuple[np.ndarray | float, np.ndarray | float]
"""Lowest and highest coordinates, (n,) or the same for all."""


def plain_constraints(user_model: TwinModel) -> PlainConstraints:
    """The constraints of a user's model in plain numpy."""
    driven = user_model.driven
    joints = [(connection.ends, connection.axes) for connection in driven.connections]
    return PlainConstraints(Bodies(driven.vehicle), *coupling_rows(driven.couplings, user_model.size), joints)


def constrained_forces(
    mass_matrix: np.ndarray, forces: np.ndarray, jacobian: np.ndarray, bias: np.ndarray
) -> np.ndarray:
    """Forces (n,) including the constraint forces of rigid constraints J q'' + bias = 0, with Jacobian J (c, n) and
    bias (c,); rows may be linearly dependent."""
    turned, sizes, jacobian = np.linalg.svd(jacobian, full_matrices=False)
    kept = sizes > REDUNDANT_SHARE * sizes[0]
    jacobian, bias = jacobian[kept], (bias @ turned)[kept] / sizes[kept]
    free, compliance = np.linalg.solve(mass_matrix, forces), np.linalg.solve(mass_matrix, jacobian.T)
    answer: np.ndarray = forces - jacobian.T @ np.linalg.solve(jacobian @ compliance, jacobian @ free + bias)
    return answer


def jacobian_by_differences(jacobian_at: JacobianAt, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Constraint Jacobian J (c, n), and J' q' (c,) by differences of J along the motion, at coordinates and rates
    (n,)."""
    stride = DIFFERENCE_STRIDE / max(float(np.abs(v).sum()), 1e-9)
    steps = [k * stride * v for k in range(1, len(DIFFERENCE_WEIGHTS) + 1)]
    rows, *others = jacobian_at([q, *(place for s in steps for place in (q + s, q - s))])
    changes = [
        weight * (there - back)
        for weight, there, back in zip(DIFFERENCE_WEIGHTS, others[::2], others[1::2], strict=True)
    ]
    rest: np.ndarray = np.sum(changes, axis=0) @ v / stride
    return rows, rest


def satisfying_state(
    constraints: PlainConstraints, q: np.ndarray, v: np.ndarray, coordinate_ranges: Ranges = (-np.inf, np.inf)
) -> tuple[np.ndarray, np.ndarray] | None:
    """Nearest coordinates (n,) and rates (n,) that satisfy the constraints, by Newton's method; None if it does not
    converge. ranges : lowest and highest coordinates, which no correction leaves."""
    for _ in range(MOST_CORRECTIONS):
        gap = constraints.gap(q)
        if np.abs(gap.size).max() <= SATISFIED_GAP:
            return q, v - np.linalg.pinv(gap.jacobian, REDUNDANT_SHARE) @ (gap.jacobian @ v)
        step = _correction(gap.jacobian, gap.size, q, coordinate_ranges)
        q = np.clip(
            q - step * min(1.0, LONGEST_CORRECTION / max(float(np.abs(step).max()), SATISFIED_GAP)), *coordinate_ranges
        )
    return None


def _correction(
    jacobian: np.ndarray, constraint_gap: np.ndarray, q: np.ndarray, coordinate_ranges: Ranges
) -> np.ndarray:
    """Smallest correction (n,) of the coordinates that closes gaps (c,) to first order; coordinates that it would push
    out of their ranges are left unchanged."""
    (low, high), held = coordinate_ranges, np.zeros(len(q), bool)
    while True:
        step: np.ndarray = np.linalg.pinv(np.where(held, 0.0, jacobian), REDUNDANT_SHARE) @ constraint_gap
        pressed = ~held & (((q <= low) & (step > 0.0)) | ((q >= high) & (step < 0.0)))
        if not pressed.any():
            return step
        held |= pressed
