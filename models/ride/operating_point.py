"""Eigenvalues of a linear vehicle, and how far another operating point moves them."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from models.vehicles.linear_vehicle import LinearVehicle


def poles(vehicle: LinearVehicle) -> np.ndarray:
    """Eigenvalues (2 n,) in 1/s, slow ones first; of a pair the one with the negative imaginary part first."""
    n = len(vehicle.mass)
    own = np.linalg.solve(vehicle.mass, np.hstack([-vehicle.stiffness, -vehicle.damping]))
    found = np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), own]))
    return found[np.lexsort((found.imag, np.round(np.abs(found), 6)))]


def shift(unloaded: LinearVehicle, loaded: LinearVehicle) -> np.ndarray:
    """How far every eigenvalue (2 n,) of the unloaded vehicle moves, complex, in 1/s.

    The eigenvalues of the two are paired so that the sum of all distances is the least.
    """
    before, after = poles(unloaded), poles(loaded)
    rows, columns = linear_sum_assignment(np.abs(before[:, None] - after[None, :]))
    return after[columns] - before[rows]
