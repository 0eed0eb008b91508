"""Changes of variances by leaving effects out, predicted from one covariance and one adjoint solution of the full
scene.

The variance of a reduced system, A_r, C_r, noise Q_r, is for **any** symmetric matrix P_m exactly

    J_r = tr(L_r (A_r P_m + P_m A_r' + Q_r)) + C_r P_m C_r',    A_r' L_r + L_r A_r + C_r' C_r = 0.

With P_m the whole scene's covariance P seen in the reduced state (``Reduced.left``) this is the certificate: two routes
to one number. With L_r, too, replaced by the whole scene's L, T' L T, it is the screen: no equation is solved for the
effect, and the error is a product of two small ones, the residual of P_m and the adjoint's own. For changed values
alone, T = 1, it reads dJ = tr(L (dA P + P dA' + dQ)) + 2 dC P C' + dC P dC'.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from models.advice.ride_choice.reduced import Reduced
from models.core.errors import InputError
from models.ride.covariance import (
    FINITE,
    StationaryCovariance,
    lyapunov_solution,
    noise_intensity_of_system,
    rounding_thresholds,
    stationary_covariance,
)
from models.ride.excited import DelayedSystem
from models.ride.marginal import split_marginal

SLOWEST_DECAY = 1e-9
"""Ratio of a decay rate to the fastest rate below which a motion counts as undamped."""
EXACT_SOLVE_LIMIT, TRUSTED_VARIANCE_SHARE = 1e-7, 1e-10
"""Ratio of a decay rate to the fastest rate below which the exact solution replaces eigenmodes, and the share of a
variance that eigenmodes may miss.
"""


@dataclass(frozen=True)
class StationarySolution:
    """Stationary solution of a linear system in extended precision: covariance P (n, n), adjoints L (quantities, n, n)
    and variances (quantities,).
    """

    P: np.ndarray
    L: np.ndarray
    variance: np.ndarray


def solve(linear_system: DelayedSystem, output_rows: list[int]) -> StationarySolution:
    """Stationary covariance P and adjoints L of a system in which every mode is damped; InputError for a mode without a
    restoring force.

    Noise and outputs stay in extended precision in the coordinates of the modes, too: where these are nearly parallel,
    a variance is a small difference of large terms.
    """
    split = split_marginal(linear_system.A)
    if split.count_of_marginal_states:
        raise InputError("", "vehicle", None, "has a motion that nothing pulls back: no adjoint to screen effects with")
    V, W, C = split.V, split.W, linear_system.C[output_rows]
    P = V @ lyapunov_solution(split.S, W @ noise_intensity_of_system(linear_system) @ W.T)[0] @ V.T
    L = np.array([W.T @ lyapunov_solution(split.S.T, np.outer(c, c))[0] @ W for c in C @ V])
    return StationarySolution(P, L, np.array([c @ P @ c for c in C.astype(np.longdouble)]))


class Screen:
    """Predictions of variances for systems that are reduced further than ``base``, from the stationary solution for
    ``base``. Quantities are given by their rows of C.
    """

    def __init__(self, reduced_scene: Reduced, output_rows: list[int]) -> None:
        self.base, self.rows = reduced_scene, output_rows
        A, C, modes = reduced_scene.system.A, reduced_scene.system.C[output_rows], reduced_scene.modes
        if has_undamped_motion(modes.rates if modes else np.linalg.eigvals(A)):
            raise InputError(
                "",
                "vehicle",
                None,
                "has a motion that nothing pulls back, as one that is free to drive "
                "away: effects are chosen for vehicles of which every motion dies out",
            )
        if modes:
            self.P, self.L = modes.covariance(reduced_scene.noise), modes.adjoints(C)
        else:
            self.P = solve_continuous_lyapunov(A, -reduced_scene.noise)
            self.L = np.array([solve_continuous_lyapunov(A.T, -np.outer(c, c)) for c in C])

    @cached_property
    def extended_solution(self) -> StationarySolution:
        """Stationary solution for the system ``base`` in extended precision, for the certificate."""
        return solve(self.base.system, self.rows)

    def predicted_variances(self, reduced_system: Reduced) -> np.ndarray:
        """Predicted variances (quantities,) of the reduced system; inf where white noise reaches a quantity
        directly.
        """
        system, left, T = reduced_system.system, reduced_system.left @ self.base.T, self.base.left @ reduced_system.T
        P, C = left @ self.P @ left.T, system.C[self.rows]
        half = system.A @ P
        excess_noise = half + half.T + reduced_system.noise
        J = np.einsum("ki,ij,kj->k", C, P, C) + np.einsum("kij,ij->k", T.T @ self.L @ T, excess_noise)
        white = sum((d[self.rows] ** 2).sum(axis=1) for d in system.D) > 0
        return np.where(white, np.inf, np.maximum(J, 0.0))

    def certificate_sides(self, reduced_system: Reduced) -> tuple[np.ndarray, np.ndarray]:
        """Variances (quantities,) of the reduced system in two ways, which a certificate compares: from the covariance
        of ``base`` with the adjoints of the reduced system, and from the reduced covariance.
        """
        system, left = reduced_system.system, (reduced_system.left @ self.base.T).astype(np.longdouble)
        covariance = solve(system, self.rows)
        P = left @ self.extended_solution.P @ left.T
        half = system.A.astype(np.longdouble) @ P
        excess_noise = half + half.T + noise_intensity_of_system(system)
        C = system.C[self.rows].astype(np.longdouble)
        variance = np.einsum("ki,ij,kj->k", C, P, C) + np.einsum("kij,ij->k", covariance.L, excess_noise)
        return variance.astype(float), covariance.variance.astype(float)


def has_undamped_motion(eigenvalues: np.ndarray, least_decay_ratio: float = SLOWEST_DECAY) -> bool:
    """Whether one of the eigenvalues (1/s) has almost no damping: ``least_decay_ratio`` is the least ratio of decay to
    the fastest rate.
    """
    return bool(eigenvalues.real.max(initial=-np.inf) > -least_decay_ratio * abs(eigenvalues).max(initial=0.0))


def variances_from_modes(reduced_system: Reduced, output_rows: list[int]) -> np.ndarray | None:
    """Variances (quantities,) from the eigenmodes of the reduced system; None where only the exact solution is
    reliable.

    J = C P C' + tr(L (A P + P A' + Q)), which is exact for any P: where the second term, of all outputs, is more than
    rounding, where noise reaches a quantity at once, or where a motion hardly dies out, motions are not to be trusted.
    """
    system, modes = reduced_system.system, reduced_system.modes
    if (
        modes is None
        or has_undamped_motion(modes.rates, EXACT_SOLVE_LIMIT)
        or any(d[output_rows].any() for d in system.D)
    ):
        return None
    P, C = modes.covariance(reduced_system.noise), system.C
    half = system.A @ P
    modal_noise = modes.W @ (half + half.T + reduced_system.noise) @ modes.W.conj().T
    variance = ((C @ P) * C).sum(axis=1)
    missing = (modes.modal_adjoint(C) * modal_noise.T).sum(axis=(1, 2)).real
    is_certain = np.isfinite(system.D).all(axis=(0, 2)) & (variance > rounding_thresholds(C, P))
    if (
        not (abs(missing[is_certain]) <= TRUSTED_VARIANCE_SHARE * variance[is_certain]).all()
        or not is_certain[output_rows].all()
    ):
        return None
    return np.asarray((variance + missing)[output_rows])


def exact_variances(reduced_system: Reduced, output_rows: list[int]) -> np.ndarray:
    """Variances (quantities,) by the exact solution of the reduced system, inf where a quantity has none. Raises
    InputError for an unstable system.
    """
    return row_variances(stationary_covariance(reduced_system.system), output_rows)


def row_variances(covariance: StationaryCovariance, output_rows: list[int]) -> np.ndarray:
    """Variances (quantities,) of the outputs with these row indices, inf where an output has none."""
    return np.array([covariance.variance[row] if covariance.status[row] == FINITE else np.inf for row in output_rows])


def variances_and_rounding(reduced_system: Reduced, output_rows: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Variances (quantities,) by the exact solution, and levels (quantities,) below which variances are only
    rounding.
    """
    covariance = stationary_covariance(reduced_system.system)
    return row_variances(covariance, output_rows), rounding_thresholds(
        reduced_system.system.C[output_rows], covariance.P
    )
