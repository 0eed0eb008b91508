"""Motions of a linear system without restoring force: found in the system matrix, separated from it, and their growth
on a random road.

A vehicle that is free to drive away has eigenvalues at zero (its place, its heading, the two coupled as a Jordan
pair); an undamped spring has a pair on the imaginary axis. A Lyapunov equation has no solution then, although most
outputs have a variance: all that do not see such a motion, or that see one which the road leaves alone.

Zero eigenvalues are found from singular values: those of a Jordan pair come out of an eigenvalue solver as large as
the root of its rounding, while the singular values stay within the rounding itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np
from scipy.linalg import expm, matrix_balance, schur, svd, svdvals

from models.core.errors import InputError

MATRIX_ACCURACY = 1e-10
"""Relative accuracy of a system matrix where nothing else is known: formulas reach 1e-15, engines that differentiate
curves with corners 1e-11. A motion with a rate below this share of the fastest one (some 1e-8 1/s) counts as free."""
ZERO_MARGIN = 1e3
"""Factor by which a number must exceed its accuracy to count as different from zero."""


ZERO_PRODUCT_SHARE = 10 * float(np.finfo(float).eps)
"""Share of its terms below which a product of rows and columns is zero by symmetry, so that its value is only
rounding."""


class UnstableVehicle(InputError):
    """Error of a system that leaves its equilibrium without excitation: its ``growth`` rate in 1/s and ``frequency`` in
    Hz."""

    def __init__(self, growth_rate: float, frequency: float, speed: float | None = None) -> None:
        self.growth, self.frequency = growth_rate, frequency
        speed_text = "at this speed" if speed is None else f"at {speed:g} m/s"
        motion_text = f"that swings at {frequency:.4g} Hz" if frequency else "that does not swing"
        super().__init__(
            "",
            "vehicle",
            None,
            f"is unstable: a motion {motion_text} grows at a rate of {growth_rate:.4g} 1/s, twofold in "
            f"{np.log(2) / growth_rate:.3g} s, so nothing has a stationary variance; it must be stable {speed_text}",
        )


@dataclass(frozen=True)
class MarginalParts:
    """Decoupling of x' = A x + u into a marginal part (eigenvalues on the imaginary axis) and a stable part: x = V0 a +
    V b, a' = M a + W0 u, b' = S b + W u.

    M (k, k) has its eigenvalues on the imaginary axis, the first ``zero_count`` of its rows those at 0 (nilpotent), the
    others undamped oscillations; S is stable. V and W are in extended precision.
    scale (n,): sizes of the states that balance A; rounding is relative to them. norm_of_rates: norm of A, 1/s.
    neglected_rate_ratio: largest rate that was taken for 0, by the slowest of the stable part.
    """

    M: np.ndarray
    V0: np.ndarray
    W0: np.ndarray
    S: np.ndarray
    V: np.ndarray
    W: np.ndarray
    zero_count: int
    scale: np.ndarray
    norm_of_rates: float
    neglected_rate_ratio: float

    @property
    def count_of_marginal_states(self) -> int:
        """Number of marginal states, those with eigenvalues on the imaginary axis."""
        return len(self.M)


def split_marginal(A: np.ndarray, matrix_accuracy: float = MATRIX_ACCURACY) -> MarginalParts:
    """Marginal and stable part of x' = A x + u, with A (n, n). Raises Unstable, or InputError where they cannot be
    separated.

    ``matrix_accuracy`` of A, relative to its norm once its states are scaled: what is smaller counts as zero.
    """
    balanced, scale, norm = _balanced_matrix(A)
    V, form, zeros, left = _zero_eigenvalues_first(balanced, matrix_accuracy * norm)
    if zeros and matrix_accuracy * norm > FREE_ROUNDING:
        _refuse_inseparable(norm)
    U, stable_part, undamped = _undamped_pairs_first(form[zeros:, zeros:], 10 * matrix_accuracy * norm)
    k = zeros + undamped
    V[:, zeros:] = V[:, zeros:] @ U
    form[:zeros, zeros:] = form[:zeros, zeros:] @ U
    form[zeros:, zeros:] = stable_part
    W = V.T.copy()
    for size in {k, zeros}:
        _decouple(form, V, W, size)
    S, T, back = _modal_form(form[k:, k:])
    stable = (V[:, k:] @ T, back @ W[k:]) if k else (T, back)
    return MarginalParts(
        form[:k, :k],
        scale[:, None] * V[:, :k],
        W[:k] / scale,
        S,
        scale[:, None] * stable[0],
        stable[1] / scale,
        zeros,
        scale,
        norm,
        _ratio_to_slowest_decay(left, stable_part[undamped:, undamped:]),
    )


FREE_ROUNDING = 1e-3
"""Rounding of a rate (1/s) above which a motion is not called free because of rounding: in a thousand seconds a vehicle
comes to rest."""


def _refuse_inseparable(fastest_rate: float) -> None:
    raise InputError(
        "",
        "vehicle",
        None,
        f"has a motion so fast, {fastest_rate:.2g} 1/s, that its slow ones cannot be told from free "
        "ones: look for a mass or an inertia that is far too small, a stiffness or damping that is far too large",
    )


def _balanced_matrix(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """System matrix A after scaling the states to similar size, these scales (n,), and the norm of A as LAPACK balances
    it (1/s).

    LAPACK counts diagonals in: a road filter whose corner is almost 0 would get a size of almost 0, and beside its
    noise, which does not shrink, nothing could be told from rounding. The fastest rate on all diagonals prevents it.
    """
    fastest = float(np.linalg.norm(matrix_balance(A, permute=False)[0], 2))
    _, (scale, _) = matrix_balance(A + fastest * np.eye(len(A)), permute=False, separate=True)
    return A * scale / scale[:, None], scale, fastest


def _ratio_to_slowest_decay(neglected_rate: float, S: np.ndarray) -> float:
    return neglected_rate / float(-np.linalg.eigvals(S).real.max()) if len(S) else 0.0


def _zero_eigenvalues_first(A: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray, int, float]:
    """Orthogonal matrix Q, the form Q' A Q with its zero eigenvalues first, the block of these strictly upper
    triangular; their number; and the largest singular value that was taken for 0.

    Null space, then null space of what remains, until nothing remains to be found: the staircase of Jordan chains.
    """
    Q, form, nullity, left = np.eye(len(A)), A.copy(), 0, 0.0
    while nullity < len(A):
        small = [value for value in svdvals(form[nullity:, nullity:]) if value <= tolerance]
        null = len(small)
        if null == 0:
            break
        left = max(left, *small)
        turn = svd(form[nullity:, nullity:])[2][::-1].T  # null space first
        Q[:, nullity:] = Q[:, nullity:] @ turn
        form[:, nullity:] = form[:, nullity:] @ turn
        form[nullity:, nullity:] = turn.T @ form[nullity:, nullity:]
        form[nullity:, nullity : nullity + null] = 0.0
        nullity += null
    return Q, form, nullity, left


def _undamped_pairs_first(A: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Orthogonal matrix U, the ordered real Schur form U' A U with its undamped pairs first, and the number of their
    eigenvalues.

    Raises Unstable if any eigenvalue lies beyond them, on the right.
    """

    def on_axis(real_part: np.ndarray, imaginary_part: np.ndarray) -> np.ndarray:
        return (imaginary_part != 0) & (abs(real_part) <= tolerance)

    values = np.linalg.eigvals(A)
    on_the_axis = on_axis(values.real, values.imag)
    growing = values[~on_the_axis & (values.real >= 0)]
    if len(growing):
        worst = growing[growing.real.argmax()]
        raise UnstableVehicle(worst.real, abs(worst.imag) / (2 * np.pi))
    if not on_the_axis.any():
        return np.eye(len(A)), A, 0
    form, U, undamped = schur(A, output="real", sort=on_axis)
    return U, form, undamped


def _decouple(block_triangular_form: np.ndarray, V: np.ndarray, W: np.ndarray, leading_size: int) -> None:
    """Remove the coupling form[:k, k:] of a block triangular form = W A V in place, by solving a Sylvester equation."""
    if 0 < leading_size < len(block_triangular_form):
        from control import lyap

        Z = lyap(
            block_triangular_form[:leading_size, :leading_size],
            -block_triangular_form[leading_size:, leading_size:],
            block_triangular_form[:leading_size, leading_size:],
            method="scipy",
        )
        V[:, leading_size:] += V[:, :leading_size] @ Z
        W[:leading_size] -= Z @ W[leading_size:]
        block_triangular_form[:leading_size, leading_size:] = 0.0


def _modal_form(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """System matrix A transformed almost to its own modes, T^-1 A T, with T and its inverse: real, in extended
    precision.

    In positions and velocities an acceleration is a small difference of large forces, and a rounding of the state
    is multiplied by stiffnesses; in these coordinates each motion has its own size. They need not be exact, and
    where eigenvectors are nearly parallel all stays as it is.
    """
    values, vectors = np.linalg.eig(A)
    T = np.where(values.imag < 0, vectors.imag, vectors.real)
    unit_matrix = np.eye(len(A), dtype=np.longdouble)
    if len(A) == 0 or not np.linalg.cond(T) < LARGEST_CONDITION:
        return A, unit_matrix, unit_matrix
    back = np.linalg.inv(T).astype(np.longdouble)
    wide = T.astype(np.longdouble)
    back = back @ (2 * unit_matrix - wide @ back)
    return (back @ A.astype(np.longdouble) @ wide).astype(float), wide, back


LARGEST_CONDITION = 1e8
"""Condition number of the eigenvectors beyond which they are of no use as coordinates."""


@dataclass(frozen=True)
class VarianceGrowth:
    """Long-run growth of each output's variance: rate * t^power (t in s), with power 0 where it does not grow."""

    rate: np.ndarray
    power: np.ndarray


def variance_growth(
    marginal_parts: MarginalParts,
    B: Sequence[np.ndarray],
    delays: Sequence[float],
    C: np.ndarray,
    has_independent_axles: bool,
    variance: np.ndarray,
    matrix_accuracy: float = MATRIX_ACCURACY,
) -> VarianceGrowth:
    """Long-run growth of the variances of the outputs y = C x along the marginal motions, under noise through B_i (n,
    k) with delays tau_i (s).

    Axles that meet the same noise act as one input, the sum of e^(-M tau_i) W0 B_i: what the first one starts, the
    last one may stop. C (p, n). Products no larger than ZERO_MARGIN times their accuracy are zero, unless the motion,
    if it is not free but dies out too slowly to tell, would still add to the ``variance`` (p,) of all others.
    """
    join = np.hstack if has_independent_axles else sum
    carried = [
        np.eye(marginal_parts.count_of_marginal_states) if has_independent_axles else expm(-marginal_parts.M * delay)
        for delay in delays
    ]
    G = join([E @ marginal_parts.W0 @ b for E, b in zip(carried, B, strict=True)])
    reach = np.linalg.norm(marginal_parts.W0 * marginal_parts.scale, axis=1, keepdims=True)
    G_size = join(
        [
            abs(E) @ reach * np.linalg.norm(b / marginal_parts.scale[:, None], axis=0)
            for E, b in zip(carried, B, strict=True)
        ]
    )
    outputs_of_marginal = C @ marginal_parts.V0
    seen_size = np.linalg.norm(C * marginal_parts.scale, axis=1, keepdims=True) * np.ones(
        marginal_parts.count_of_marginal_states
    )
    z, least_rate = marginal_parts.zero_count, ZERO_MARGIN * matrix_accuracy
    largest_rounding = least_rate * variance * 2 * matrix_accuracy * marginal_parts.norm_of_rates
    rate, power = _growth_by_zeros(
        marginal_parts.M[:z, :z],
        G[:z],
        G_size[:z],
        outputs_of_marginal[:, :z],
        seen_size[:, :z],
        least_rate,
        largest_rounding,
    )
    swung = _growth_by_undamped(
        marginal_parts.M[z:, z:],
        G[z:],
        G_size[z:],
        outputs_of_marginal[:, z:],
        seen_size[:, z:],
        least_rate,
        largest_rounding,
    )
    rate = np.where(power <= 1, rate + swung, rate)
    return VarianceGrowth(rate, np.where((power == 0) & (swung > 0), 1, power))


def _growth_by_zeros(
    N: np.ndarray,
    G: np.ndarray,
    G_size: np.ndarray,
    C: np.ndarray,
    C_size: np.ndarray,
    lower_bound: float,
    upper_bound: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Growth rates and powers (p,) of the variances due to zero eigenvalues, from the response sum of C N^l G t^l / l!,
    whose highest power dominates. A term counts above ``lower_bound`` times its size; at power 1 it also counts
    where its rate is above ``upper_bound`` (p,)."""
    rate, power = np.zeros(len(C)), np.zeros(len(C), int)
    step, step_size = G, G_size
    for level in range(len(N)):
        factor = C @ step / factorial(level)
        is_certain = (abs(factor) * factorial(level) > lower_bound * (C_size @ step_size)).any(axis=1)
        real = (abs(factor) > ZERO_PRODUCT_SHARE * (C_size @ step_size)).any(axis=1)
        is_certain |= (level == 0) & real & ((factor**2).sum(axis=1) > upper_bound)
        rate[is_certain] = (factor[is_certain] ** 2).sum(axis=1) / (2 * level + 1)
        power[is_certain] = 2 * level + 1
        step, step_size = N @ step, abs(N) @ step_size
    return rate, power


def _growth_by_undamped(
    T: np.ndarray,
    G: np.ndarray,
    G_size: np.ndarray,
    C: np.ndarray,
    C_size: np.ndarray,
    lower_bound: float,
    upper_bound: np.ndarray,
) -> np.ndarray:
    """Growth rates (p,) of the variances due to undamped oscillations: the mean square of the response C e^(T t) G,
    summed over the frequencies. An amplitude counts above ``lower_bound`` times its size, or where its rate is above
    ``upper_bound`` (p,)."""
    rate = np.zeros(len(C))
    values, vectors = np.linalg.eig(T)
    right, left = C @ vectors, np.linalg.solve(vectors, G.astype(complex)) if len(T) else G
    for value in values[values.imag > 0]:
        is_same_value = abs(values - value) < 1e-6 * abs(value)
        first = bool(is_same_value[: np.flatnonzero(values == value)[0]].any())
        amplitude = right[:, is_same_value] @ left[is_same_value]
        is_certain = (abs(amplitude) > lower_bound * (C_size @ G_size)).any(axis=1)
        real = (abs(amplitude) > ZERO_PRODUCT_SHARE * (C_size @ G_size)).any(axis=1)
        is_certain |= real & (2 * (abs(amplitude) ** 2).sum(axis=1) > upper_bound)
        rate[is_certain] += 0.0 if first else 2 * (abs(amplitude[is_certain]) ** 2).sum(axis=1)
    return rate
