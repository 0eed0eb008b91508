"""Accelerations with MuJoCo's soft constraints, by the law in its documentation, applied to the plain equations.

At a state that satisfies a constraint, in place and in speed, its reference acceleration is 0. Then the accelerations a
minimise (a - a0) M (a - a0) + c c / R with c = J a + J' q', where a0 are those without the constraint, J its rows,
d the first number of solimp, and R = (1 - d) / d times what the documentation calls the diagonal approximation: the sum
of the joints' entries in the inverse of the mass matrix in the design position; between bodies, the sum of both
bodies' means over three directions, of their centres' shifts or of their turns.
"""

import numpy as np

from models.multibody.plain.constraints import angular_velocity_jacobian
from models.multibody.plain.motion import FIRST_DERIVATIVE
from models.own_model.builds import Equations, StateMotion, plain_tree
from models.own_model.constraints import plain_constraints
from models.own_model.equalities import coupling_rows
from models.own_model.reading import TwinModel

QUATERNION_RATE = 0.5
"""Ratio of a quaternion's rate to the angular velocity for small rotations; MuJoCo's welds constrain the quaternion."""


def soft_constraint_equations(twin_model: TwinModel) -> Equations:
    """Equations of motion of a model with soft constraints, by the law of MuJoCo's documentation; nothing but the
    constraints may be soft."""
    tree, constraints = plain_tree(twin_model), plain_constraints(twin_model)
    give, scale = _row_compliance(twin_model), _row_factors(twin_model)

    def move(q: np.ndarray, v: np.ndarray) -> StateMotion:
        mass, force = tree.mass_and_force(0.0, q, v)
        rows, rest = constraints.terms(q, v)
        rows, rest = scale[:, None] * rows, scale * rest
        acceleration = np.linalg.solve(mass + rows.T / give @ rows, force - rows.T / give @ rest)
        return StateMotion(mass, mass @ acceleration, acceleration)

    return move


def _row_factors(twin_model: TwinModel) -> np.ndarray:
    """Factors (c,) of the constraint rows: 1 for joint couplings and points, then one for each row of a rotation."""
    driven = twin_model.driven
    welds = [QUATERNION_RATE * each.torque_scale for each in driven.connections if each.axes is not None]
    return np.concatenate((np.ones(len(driven.couplings) + 3 * len(driven.connections)), np.repeat(welds, 3)))


def _row_compliance(twin_model: TwinModel) -> np.ndarray:
    """Regularisation R (c,) of every constraint row, which makes the constraint soft."""
    driven, tree = twin_model.driven, plain_tree(twin_model)
    mass, _ = tree.mass_and_force(0.0, *np.zeros((2, twin_model.size)))
    inverse = np.linalg.inv(mass)
    rows, _ = coupling_rows(driven.couplings, twin_model.size)
    ties = np.array([_impedance_share(tie.solimp) for tie in driven.couplings]) * ((rows != 0.0) @ inverse.diagonal())
    light = [
        (_impedance_share(each.solimp) * _mean_inverse_inertia(twin_model, inverse, each.ends), each.axes)
        for each in driven.connections
    ]
    shifts, turns = [each[0] for each, _ in light], [each[1] for each, axes in light if axes is not None]
    return np.concatenate((ties, np.repeat(shifts, 3), np.repeat(turns, 3)))


def _impedance_share(impedance_parameters: tuple[float, ...]) -> float:
    return (1.0 - impedance_parameters[0]) / impedance_parameters[0]


def _mean_inverse_inertia(twin_model: TwinModel, inverse_mass: np.ndarray, connected_bodies: tuple) -> np.ndarray:
    """Mean inverse inertias (2,) of a connection, summed over both bodies: for translation (1/kg) and for rotation
    (1/(kg m^2))."""
    bodies, total = plain_tree(twin_model).bodies, np.zeros(2)
    motion = bodies.move(*np.zeros((2, twin_model.size)))
    for name in (name for name, _ in connected_bodies if name is not None):
        (shift,) = motion.at(bodies.points([(name, bodies.position[name])]))
        for i, rows in enumerate(
            (shift[FIRST_DERIVATIVE:].T, angular_velocity_jacobian(motion.axes(bodies.row[name])))
        ):
            total[i] += np.trace(rows @ inverse_mass @ rows.T) / 3.0
    return total
