"""What is left of a system when its fast motions follow at once: the slow ones as they are, the fast ones at rest.

With the vehicle's states split by x = V s + U u into slow and fast motions, s' = S s + W A_f f and u' = F u + Z A_f f,
f the road's, the fast ones stand where the road's height of the moment would bring them to rest: u = -F^-1 Z A_f f.
Slow motions keep their rates to the digit, and what any output does in the end stays what it was (singular
perturbation, residualisation). White noise that meets a fast motion would pass through it at once.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import schur, solve_sylvester

from models.errors import InputError
from models.ride.delayed_system import DelayedSystem


def slow(system: DelayedSystem, states: int, fastest: float) -> tuple[DelayedSystem, np.ndarray, np.ndarray]:
    """The system without motions faster than ``fastest`` (1/s) among its first ``states``, those of the vehicle.

    Also G (n, x) from its state to the whole one and back (x, n), back G = 1. Raises InputError where no slow motion is
    left."""
    own, driven = system.A[:states, :states], system.A[:states, states:]
    V, U, S, F, W, Z = _split(own, fastest)
    if not len(S):
        raise InputError("", "effects", None, "nothing is left that could move")
    at_rest = -U @ np.linalg.solve(F, Z)
    k, m = len(S), len(system.A) - states
    G = np.block([[V, at_rest @ driven], [np.zeros((m, k)), np.eye(m)]])
    back = np.block([[W, np.zeros((k, m))], [np.zeros((m, states)), np.eye(m)]])
    A = np.block([[S, W @ driven], [np.zeros((m, k)), system.A[states:, states:]]])
    direct = system.C[:, :states] @ at_rest
    D = tuple(d + direct @ b[:states] for d, b in zip(system.D, system.B, strict=True))
    return replace(system, A=A, B=tuple(back @ b for b in system.B), C=system.C @ G, D=D), G, back


def _split(A: np.ndarray, fastest: float) -> tuple[np.ndarray, ...]:
    """V, U, S, F, W, Z of A = V S W + U F Z, the rates of S no faster than ``fastest``, in real numbers."""
    T, Q, k = schur(A, output="real", sort=lambda real, imaginary: np.hypot(real, imaginary) <= fastest)
    S, F = T[:k, :k], T[k:, k:]
    Y = solve_sylvester(S, -F, -T[:k, k:]) if 0 < k < len(A) else np.zeros((k, len(A) - k))
    return Q[:, :k], Q[:, :k] @ Y + Q[:, k:], S, F, (Q[:, :k] - Q[:, k:] @ Y.T).T, Q[:, k:].T
