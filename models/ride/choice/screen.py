"""What leaving effects out does to quantities, from one covariance and one adjoint solve of the whole scene each.

The variance of a reduced system, A_r, C_r, noise Q_r, is for **any** symmetric matrix P_m exactly

    J_r = tr(L_r (A_r P_m + P_m A_r' + Q_r)) + C_r P_m C_r',    A_r' L_r + L_r A_r + C_r' C_r = 0.

With P_m the whole scene's covariance P seen in the reduced state (``Reduced.left``) this is the certificate: two routes
to one number. With L_r, too, replaced by the whole scene's L, T' L T, it is the screen: no equation is solved for the
effect, and the error is a product of two small ones, the residual of P_m and the adjoint's own. For changed values
alone, T = 1, it reads dJ = tr(L (dA P + P dA' + dQ)) + 2 dC P C' + dC P dC'.
"""

from dataclasses import dataclass

import numpy as np

from models.errors import InputError
from models.ride.choice.reduced import Reduced, Whole
from models.ride.covariance import FINITE, Covariance, intensity, lyapunov, stationary
from models.ride.delayed_system import DelayedSystem
from models.ride.marginal import parts


@dataclass(frozen=True)
class Solved:
    """Covariance P (n, n), adjoints L (quantities, n, n) and variances (quantities,) of a system, extended precision."""

    P: np.ndarray
    L: np.ndarray
    variance: np.ndarray


def solve(system: DelayedSystem, rows: list[int]) -> Solved:
    """P and L of a system whose every motion dies out; InputError for one with a motion that nothing pulls back."""
    split = parts(system.A)
    if split.marginal:
        raise InputError("", "vehicle", None, "has a motion that nothing pulls back: no adjoint to screen effects with")
    noise = noise_of(system)
    Q = (split.W @ noise @ split.W.T).astype(float)
    V, W = split.V, split.W
    P = V @ lyapunov(split.S, Q)[0] @ V.T
    C = system.C[rows]
    seen = (C @ V).astype(float)
    L = np.array([W.T @ lyapunov(split.S.T, np.outer(c, c))[0] @ W for c in seen])
    return Solved(P, L, np.array([c @ P @ c for c in C.astype(np.longdouble)]))


def noise_of(system: DelayedSystem) -> np.ndarray:
    """Q of the system's Lyapunov equation."""
    return intensity(system.A, *_hits(system))


def _hits(system: DelayedSystem) -> tuple[list[np.ndarray], list[float], bool]:
    from models.ride.covariance import hits

    B, _, delays = hits(system)
    return B, delays, system.independent


class Screen:
    """Predictions for reduced systems from the whole one's solution; quantities by their rows of C."""

    def __init__(self, whole: Whole, rows: list[int]) -> None:
        self.rows, self.solved = rows, solve(whole.full.system, rows)
        self.P, self.L = self.solved.P.astype(float), self.solved.L.astype(float)

    def predicted(self, reduced: Reduced) -> np.ndarray:
        """Relative changes (quantities,) of standard deviations; inf where the reduced system passes white noise."""
        system, T = reduced.system, reduced.T
        P, C = reduced.left @ self.P @ reduced.left.T, system.C[self.rows]
        half = system.A @ P
        left = half + half.T + noise_of(system)
        own = np.einsum("ki,ij,kj->k", C, P, C)
        J = own + np.einsum("kij,ij->k", T.T @ self.L @ T, left)
        white = sum((d[self.rows] ** 2).sum(axis=1) for d in system.D) > 0
        return np.where(white, np.inf, np.sqrt(np.maximum(J / self.solved.variance.astype(float), 0.0)) - 1.0)

    def identity(self, reduced: Reduced) -> tuple[np.ndarray, np.ndarray]:
        """Certificate: variances (quantities,) by the whole scene's P and the reduced L, and by the reduced P."""
        system, left = reduced.system, reduced.left.astype(np.longdouble)
        own = solve(system, self.rows)
        P = left @ self.solved.P @ left.T
        half = system.A.astype(np.longdouble) @ P
        rest = half + half.T + noise_of(system)
        C = system.C[self.rows].astype(np.longdouble)
        found = np.einsum("ki,ij,kj->k", C, P, C) + np.einsum("kij,ij->k", own.L, rest)
        return found.astype(float), own.variance.astype(float)


def confirmed(reduced: Reduced, rows: list[int], full: np.ndarray) -> np.ndarray:
    """Relative changes (quantities,) of standard deviations by the exact solve of the reduced system.

    inf where a quantity has none in it; ``full`` (quantities,) are the whole scene's variances. Raises InputError.
    """
    found: Covariance = stationary(reduced.system)
    ratio = np.sqrt(found.variance[rows] / full.astype(float)) - 1.0
    return np.where([found.status[row] == FINITE for row in rows], ratio, np.inf)
