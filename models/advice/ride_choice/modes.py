"""A linear system in its eigenmodes, A = V diag(rates) W: stationary covariances, adjoints and e^(A t) without an
equation solver.

What drives and what it drives have motions of their own; those of both follow from them by a division, so that the
eigenvalue problem of a vehicle is solved once for all its roads and speeds.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import block_diag
from scipy.linalg.lapack import dgebal

from models.ride.weighting import WEIGHTINGS

LARGEST_MODE_CONDITION = 1e6
"""Largest product of the norms of a column of V and a row of W, by which rounding grows; beyond it, eigenvectors are
too nearly parallel.
"""
INVERSE_TOLERANCE = 1e-9
"""Largest difference of W V from the unit matrix."""

STEP_TIMES_EIGENVALUE = np.linspace(0.0, 3.0, 601)[1:]
"""Magnitudes of step times eigenvalue at which stability is tested; on the real axis the stable range ends at 2.785."""


@dataclass(frozen=True)
class Modes:
    """Eigenmodes of a linear system. rates (n,) : eigenvalues in 1/s; V (n, n) : eigenvectors as columns; W (n, n) :
    inverse of V.
    """

    rates: np.ndarray
    V: np.ndarray
    W: np.ndarray

    def reliable_for(self, A: np.ndarray) -> "Modes | None":
        """These modes, if they are accurate modes of the matrix A and no two eigenvectors are nearly parallel; else
        None.

        The states are scaled as they balance A, so that units have no part in it.
        """
        scale = dgebal(A, scale=1, permute=0)[3]
        V, W = self.V / scale[:, None], self.W * scale
        deviation_of_inverse = abs(W @ V - np.eye(len(A))).max(initial=0.0)
        grows = (np.linalg.norm(V, axis=0) * np.linalg.norm(W, axis=1)).max(initial=0.0)
        return self if deviation_of_inverse <= INVERSE_TOLERANCE and grows <= LARGEST_MODE_CONDITION else None

    def propagated(self, time: float, B: np.ndarray) -> np.ndarray:
        """The matrix product e^(A t) B (n, k) after a time t (s)."""
        return np.asarray(((self.V * np.exp(self.rates * time)) @ (self.W @ B)).real)

    def covariance(self, Q: np.ndarray) -> np.ndarray:
        """Stationary covariance P (n, n), the solution of the Lyapunov equation A P + P A' + Q = 0."""
        inner = -(self.W @ Q @ self.W.conj().T) / (self.rates[:, None] + self.rates.conj())
        return np.asarray((self.V @ inner @ self.V.conj().T).real)

    def modal_adjoint(self, C: np.ndarray) -> np.ndarray:
        """Adjoint Z (p, n, n) in modal coordinates for every output c (p, n). The adjoint L = W* Z W solves A' L + L A
        + c' c = 0.
        """
        y = C @ self.V
        return np.asarray(-(y.conj()[:, :, None] * y[:, None, :]) / (self.rates.conj()[:, None] + self.rates))

    def adjoints(self, C: np.ndarray) -> np.ndarray:
        """Adjoints L (p, n, n) in state coordinates for the outputs C (p, n); they solve A' L + L A + c' c = 0."""
        return np.asarray((self.W.conj().T @ self.modal_adjoint(C) @ self.W).real)


def modes_of(A: np.ndarray) -> Modes | None:
    """Eigenvalues and eigenvectors of x' = A x, A (n, n); None where eigenvectors are nearly parallel."""
    rates, V = np.linalg.eig(A)
    try:
        return Modes(rates, V, np.linalg.inv(V)).reliable_for(A)
    except np.linalg.LinAlgError:
        return None


def modes_of_cascade(driver_modes: Modes | None, coupling: np.ndarray, system_modes: Modes | None) -> Modes | None:
    """Modes of the coupled system u' = A_u u, x' = A_x x + coupling u with state (u, x); None where an eigenvalue
    belongs to both.
    """
    if driver_modes is None or system_modes is None:
        return None
    rate_differences = driver_modes.rates - system_modes.rates[:, None]
    if not rate_differences.all():
        return None
    coupling_in_modes = (system_modes.W @ coupling @ driver_modes.V) / rate_differences
    rates = np.concatenate([driver_modes.rates, system_modes.rates])
    return Modes(
        rates,
        _block_triangular(driver_modes.V, system_modes.V @ coupling_in_modes, system_modes.V),
        _block_triangular(driver_modes.W, -coupling_in_modes @ driver_modes.W, system_modes.W),
    )


def _block_triangular(upper_block: np.ndarray, corner_block: np.ndarray, lower_block: np.ndarray) -> np.ndarray:
    """Block matrix [[upper, 0], [corner, lower]]."""
    n = len(upper_block)
    full = np.zeros((n + len(lower_block),) * 2, complex)
    full[:n, :n], full[n:, :n], full[n:, n:] = upper_block, corner_block, lower_block
    return full


def modes_with_road(A: np.ndarray, vehicle_modes: Modes | None, F: np.ndarray, axle_count: int) -> Modes | None:
    """Modes of a vehicle together with the road filters F (m, m) of its axles, for the state (x, f) and its matrix A;
    None where they are unreliable.
    """
    n, road = len(A) - axle_count * len(F), _modes_of_filters(F.tobytes(), len(F), axle_count)
    if road is None or vehicle_modes is None:
        return None
    coupled_modes = modes_of_cascade(road, A[:n, n:], vehicle_modes)
    if coupled_modes is None:
        return None
    order = np.concatenate([np.arange(len(A) - n, len(A)), np.arange(len(A) - n)])
    return Modes(coupled_modes.rates, coupled_modes.V[order], coupled_modes.W[:, order]).reliable_for(A)


def modes_with_weightings(A: np.ndarray, system_modes: Modes | None, weighting_names: tuple[str, ...]) -> Modes | None:
    """Modes of a system together with the weighting filters of its outputs, for the state (x, w) and its matrix A; None
    where they are unreliable.
    """
    filters = _modes_of_weightings(weighting_names)
    if system_modes is None or filters is None:
        return None
    n = len(system_modes.rates)
    coupled_modes = modes_of_cascade(system_modes, A[n:, :n], filters)
    return None if coupled_modes is None else coupled_modes.reliable_for(A)


@lru_cache(maxsize=256)
def _modes_of_filters(F: bytes, filter_size: int, axle_count: int) -> Modes | None:
    """Modes of the road filters of all axles; None where they are unreliable."""
    modes_of_filter = modes_of(np.frombuffer(F).reshape(filter_size, filter_size))
    if modes_of_filter is None:
        return None
    return Modes(
        np.tile(modes_of_filter.rates, axle_count),
        block_diag(*[modes_of_filter.V] * axle_count),
        block_diag(*[modes_of_filter.W] * axle_count),
    )


@lru_cache(maxsize=64)
def _modes_of_weightings(weighting_names: tuple[str, ...]) -> Modes | None:
    """Modes of the weighting filters of these names; None where they are unreliable."""
    parts = [modes_of(WEIGHTINGS[name].matrices()[0]) for name in weighting_names]
    filters = [filter_modes for filter_modes in parts if filter_modes]
    if len(filters) < len(parts):
        return None
    V, W = (block_diag(*(getattr(filter_modes, key) for filter_modes in filters)) for key in ("V", "W"))
    return Modes(np.concatenate([filter_modes.rates for filter_modes in filters]), V, W)


def stable_step(eigenvalues: np.ndarray) -> float:
    """Largest stable step (s) of the classical Runge-Kutta method: |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1 for z = step
    times every eigenvalue (1/s).
    """
    eigenvalues = eigenvalues[(abs(eigenvalues) > 0) & (eigenvalues.imag >= 0)]  # those of a pair allow the same step
    z = eigenvalues[:, None] / abs(eigenvalues)[:, None] * STEP_TIMES_EIGENVALUE
    grown = abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) > 1 + 1e-12
    first = np.where(grown.any(axis=1), grown.argmax(axis=1), len(STEP_TIMES_EIGENVALUE))
    reach = np.where(first > 0, STEP_TIMES_EIGENVALUE[np.maximum(first, 1) - 1], 0.0)
    return float((reach / abs(eigenvalues)).min(initial=np.inf))
