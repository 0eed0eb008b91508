"""Accelerations with the soft couplings of MuJoCo, by the law of its documentation about the plain equations.

At a state that satisfies a coupling, in place and in speed, its reference acceleration is 0. What is left of the law:
accelerations a minimise (a - a0) M (a - a0) + (J a) (J a) / R, where a0 are those without it, J its row, d the first
number of solimp, and R = (1 - d) / d times what the documentation calls the diagonal approximation: the sum of the
joints' entries in the inverse of the mass matrix in the design position.
"""

import numpy as np

from models.own_model.builds import Equations, Moved, plain_tree
from models.own_model.reading import TwinModel, tie_rows


def softly_coupled(twin: TwinModel) -> Equations:
    """Of a model whose couplings are all that is soft in it."""
    tree, ties = plain_tree(twin), twin.driven.couplings
    rows, _ = tie_rows(ties, twin.size)
    mass, _ = tree.mass_and_force(0.0, *np.zeros((2, twin.size)))
    lightness = np.linalg.inv(mass).diagonal()
    share = np.array([(1.0 - tie.solimp[0]) / tie.solimp[0] for tie in ties])
    give = share * ((rows != 0.0) @ lightness)

    def move(q: np.ndarray, v: np.ndarray) -> Moved:
        mass, force = tree.mass_and_force(0.0, q, v)
        acceleration = np.linalg.solve(mass + rows.T / give @ rows, force)
        return Moved(mass, mass @ acceleration, acceleration)

    return move
