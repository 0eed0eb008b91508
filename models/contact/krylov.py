"""Linear systems known by their products alone: GMRES (Saad and Schultz, 1986), preconditioned from the right.

Its own loops instead of a library's, whose calls of threaded linear algebra on short vectors stall on busy cores.
"""

from collections.abc import Callable

import numpy as np

from models.compiled import njit
from models.errors import RunFailed

Map = Callable[[np.ndarray], np.ndarray]


def solve(apply: Map, precondition: Map, wanted: np.ndarray, tolerance: float, most: int) -> np.ndarray:
    """x with |apply(x) - wanted| <= tolerance |wanted|, vectors (n,); raises RunFailed after ``most`` products."""
    size = float(np.linalg.norm(wanted))
    if size == 0.0:
        return np.zeros_like(wanted)
    basis, images = np.empty((most + 1, wanted.size)), np.zeros((most + 1, most))
    basis[0] = wanted / size
    for count in range(1, most + 1):
        images[: count + 1, count - 1] = _orthogonalise(basis, count, apply(precondition(basis[count - 1])))
        part = images[: count + 1, :count]
        weights = np.linalg.lstsq(part, size * np.eye(count + 1)[0], rcond=None)[0]
        left = np.linalg.norm(part @ weights - size * np.eye(count + 1)[0])
        if left <= tolerance * size:
            return precondition(weights @ basis[:count])
    raise RunFailed("linear solver", f"residual {left / size:.2g} after {most} products")


@njit(cache=True, fastmath=True, nogil=True)
def _orthogonalise(basis, count, vector):
    """Write the part of ``vector`` orthogonal to the first rows of ``basis``, of length 1, as its next row.

    Returns the components along these ``count`` rows and the new one, by modified Gram-Schmidt.
    """
    components = np.zeros(count + 1)
    left = vector.copy()
    for row in range(count):
        for i in range(len(left)):
            components[row] += basis[row, i] * left[i]
        for i in range(len(left)):
            left[i] -= components[row] * basis[row, i]
    for i in range(len(left)):
        components[count] += left[i] * left[i]
    components[count] = np.sqrt(components[count])
    for i in range(len(left)):
        basis[count, i] = left[i] / max(components[count], 1e-300)
    return components
