"""Linear systems known by their products alone: GMRES (Saad and Schultz, 1986), preconditioned from the right.

Its own loops instead of a library's, whose calls of threaded linear algebra on short vectors stall on busy cores.
"""

from collections.abc import Callable

import numpy as np

from models.contact.inputs import Array
from models.core.errors import RunFailed
from models.machine.compiled import njit

Map = Callable[[Array], Array]


def solve(apply: Map, precondition: Map, wanted: Array, tolerance: float, most: int) -> Array:
    """x with |apply(x) - wanted| <= tolerance |wanted|, vectors (n,); raises RunFailed after ``most`` products."""
    size = float(np.linalg.norm(wanted))
    if size == 0.0:
        return np.zeros_like(wanted)
    basis, triangle, turns = np.empty((most + 1, wanted.size)), np.zeros((most, most)), np.empty((most, 2))
    left = np.append(size, np.zeros(most))
    basis[0] = wanted / size
    for count in range(1, most + 1):
        triangle[:count, count - 1] = _turned(
            _orthogonalise(basis, count, apply(precondition(basis[count - 1]))), turns, left
        )
        if abs(left[count]) <= tolerance * size:
            return precondition(np.linalg.solve(triangle[:count, :count], left[:count]) @ basis[:count])
    raise RunFailed("linear solver", f"residual {abs(left[most]) / size:.2g} after {most} products")


@njit(cache=True, nogil=True)
def _turned(column, turns, left):
    """The image's components (count + 1,) by Givens' rotations that leave a triangle, (count,).

    turns (most, 2) : cosine and sine of the rotations, of which the last is added; left (most + 1,) : what the residual
    was turned to, its last component the residual's size.
    """
    count = len(column) - 1
    for i in range(count - 1):
        low, high = column[i], column[i + 1]
        column[i], column[i + 1] = turns[i, 0] * low + turns[i, 1] * high, turns[i, 0] * high - turns[i, 1] * low
    size = np.hypot(column[count - 1], column[count])
    turns[count - 1, 0], turns[count - 1, 1] = column[count - 1] / size, column[count] / size
    column[count - 1] = size
    left[count], left[count - 1] = -turns[count - 1, 1] * left[count - 1], turns[count - 1, 0] * left[count - 1]
    return column[:count]


@njit(cache=True, fastmath=True, nogil=True)
def _orthogonalise(basis, count, vector):
    """Write the part of ``vector`` orthogonal to the first rows of ``basis``, of length 1, as its next row.

    Returns the components along these ``count`` rows and the new one, by modified Gram-Schmidt.
    """
    components = np.zeros(count + 1)
    left = vector.copy()
    for row in range(count):
        part = 0.0
        for i in range(len(left)):
            part += basis[row, i] * left[i]
        for i in range(len(left)):
            left[i] -= part * basis[row, i]
        components[row] = part
    square = 0.0
    for i in range(len(left)):
        square += left[i] * left[i]
    components[count] = np.sqrt(square)
    for i in range(len(left)):
        basis[count, i] = left[i] / max(components[count], 1e-300)
    return components
