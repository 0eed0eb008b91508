"""What is left of a system when its fast motions have no state of their own: they follow the slow ones and the road.

With the vehicle's states split by x = V s + U u into slow and fast motions, s' = S s + W A_f f and u' = F u + Z A_f f,
f the road's, the fast ones stand where they stand in the mean for what the slow ones and the road are at that moment:

    u = K (s, f),    K = E[u (s, f)'] E[(s, f) (s, f)']^-1,

the estimate of least mean square (Gauss-Markov). Slow motions keep their rates and their covariance to the digit. What
an output loses is the variance of the part of its fast motions that the slow ones and the road do not tell: it never
gains any, and loses more the more motions follow. None passes white noise on.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import pinvh, schur, solve_continuous_lyapunov, solve_sylvester

from models.errors import InputError
from models.ride.covariance import noise_of
from models.ride.delayed_system import DelayedSystem

SLOWEST = 1e-9
"""Decay, by the fastest rate, below which a motion counts as one that does not die out."""
TOLD = 1e-12
"""Share of the largest one, scaled, below which a variance of slow motions and road counts as none."""


@dataclass(frozen=True)
class Motions:
    """A system of which the first ``states`` are the vehicle's, the others the road's."""

    system: DelayedSystem
    states: int

    @cached_property
    def P(self) -> np.ndarray:
        """Covariance of the state (n, n); InputError where a motion does not die out."""
        if still(self.system.A):
            raise InputError("", "effects", None, "what is left has a motion that nothing pulls back")
        return solve_continuous_lyapunov(self.system.A, -noise_of(self.system))

    def slow(self, fastest: float) -> tuple[DelayedSystem, np.ndarray, np.ndarray]:
        """The system without motions faster than ``fastest`` (1/s).

        Also G (n, x) from its state to the whole one and back (x, n), back G = 1. Raises InputError where no slow
        motion is left."""
        system, n = self.system, self.states
        V, U, S, W, Z = _split(system.A[:n, :n], fastest)
        if not len(S):
            raise InputError("", "effects", None, "nothing is left that could move")
        k, m = len(S), len(system.A) - n
        back = np.block([[W, np.zeros((k, m))], [np.zeros((m, n)), np.eye(m)]])
        G = np.block([[V, np.zeros((n, m))], [np.zeros((m, k)), np.eye(m)]])
        G[:n] += U @ _estimate(Z @ self.P[:n] @ back.T, back @ self.P @ back.T)
        A = np.block([[S, W @ system.A[:n, n:]], [np.zeros((m, k)), system.A[n:, n:]]])
        return replace(system, A=A, B=tuple(back @ b for b in system.B), C=system.C @ G), G, back


def still(A: np.ndarray) -> bool:
    """Whether x' = A x has a motion that does not die out, or not to speak of."""
    values = np.linalg.eigvals(A)
    return bool(values.real.max(initial=-np.inf) > -SLOWEST * abs(values).max(initial=0.0))


def _estimate(both: np.ndarray, known: np.ndarray) -> np.ndarray:
    """E[u k'] E[k k']^-1; of what never moves nothing is told."""
    scale = np.sqrt(known.diagonal().clip(0.0))
    scale = np.where(scale > 0, scale, 1.0)
    return np.asarray((both / scale) @ pinvh(known / np.outer(scale, scale), rtol=TOLD) / scale)


def _split(A: np.ndarray, fastest: float) -> tuple[np.ndarray, ...]:
    """V, U, S, W, Z of A = V S W + U F Z, the rates of S no faster than ``fastest``, in real numbers."""
    T, Q, k = schur(A, output="real", sort=lambda real, imaginary: np.hypot(real, imaginary) <= fastest)
    S, F = T[:k, :k], T[k:, k:]
    Y = solve_sylvester(S, -F, -T[:k, k:]) if 0 < k < len(A) else np.zeros((k, len(A) - k))
    return Q[:, :k], Q[:, :k] @ Y + Q[:, k:], S, (Q[:, :k] - Q[:, k:] @ Y.T).T, Q[:, k:].T
