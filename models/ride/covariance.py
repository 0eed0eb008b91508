"""Stationary covariance of a vehicle on a random road with exact axle delays, and the verdict whether each output has a
finite variance.

The response of the state to a unit of noise that the first axle meets now is e^(A s) R_j between the hits of the
axles j and j + 1: R_1 = B_1, F_j = e^(A (tau_j - tau_(j-1))) R_(j-1), R_j = F_j + B_j. The covariance, the integral
of the response times its transpose, so obeys one Lyapunov equation for any number of axles:

    A P + P A' + sum_j (B_j B_j' + F_j B_j' + B_j F_j') = 0.

Delays of zero make the axles one input; those without end make them independent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from models.core.errors import InputError
from models.ride.excited import DelayedSystem
from models.ride.marginal import (
    MATRIX_ACCURACY,
    ZERO_MARGIN,
    MarginalParts,
    VarianceGrowth,
    split_marginal,
    variance_growth,
)

FINITE, INFINITE, DIFFUSING = "finite", "infinite", "diffusing"
"""Status of an output's variance: finite; infinite; growing without bound over time (diffusing)."""


@dataclass(frozen=True)
class StationaryCovariance:
    """Stationary covariance of the states of a vehicle on its road, and variances of its outputs.

    P (n, n): covariance of the state, without motions that diffuse. Per output (p,): ``variance`` (unit^2), inf where
    there is none; ``status`` and a sentence on its ``reason``; ``rate`` and ``power`` of a variance that grows as
    rate * t^power (unit^2 / s^power). ``residual`` of the Lyapunov equation, relative to its largest term;
    ``error`` (p,): relative change of each variance by the last refinement, which leaves less than that, and what
    slow motions that count as free would change if they were not.
    """

    names: tuple[str, ...]
    P: np.ndarray
    variance: np.ndarray
    status: tuple[str, ...]
    reason: tuple[str, ...]
    rate: np.ndarray
    power: np.ndarray
    residual: float
    error: np.ndarray

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations (p,) of the outputs, inf where an output has no finite variance."""
        return np.sqrt(self.variance)


def stationary_covariance(
    delayed_system: DelayedSystem, matrix_accuracy: float = MATRIX_ACCURACY
) -> StationaryCovariance:
    """Stationary covariance of a system whose axles meet unit white noise one after the other.

    ``matrix_accuracy`` of the system's matrices, relative: what is smaller counts as zero, so that free motions are
    found. Raises Unstable, with growth rate and frequency, if the system leaves its equilibrium on its own, and
    InputError where a variance cannot be told to UNCERTAINTY_LIMIT of itself.
    """
    met = noise_arrivals(delayed_system)
    split = split_marginal(delayed_system.A, matrix_accuracy)
    onto_stable = met._replace(B=[split.W @ b for b in met.B])  # in extended precision: modes may be nearly parallel
    P, correction, residual = lyapunov_solution(split.S, noise_intensity(split.S, onto_stable))
    V = split.V
    if split.count_of_marginal_states:
        P, correction, V = _with_marginal_motions(split, met, onto_stable, P, correction)
    C = delayed_system.C @ V
    floor, change = rounding_thresholds(C, P), _output_variances(C, correction)
    variance = _output_variances(C, P)
    variance = np.where(variance > floor, variance, 0.0)
    grown = variance_growth(
        split, met.B, met.delays, delayed_system.C, met.independent, variance + floor, matrix_accuracy
    )
    status, reason = variance_verdicts(
        met.D, variance, floor, grown, float(np.linalg.norm(split.S)), matrix_accuracy, split
    )
    finite = np.array(status) == FINITE
    error = np.divide(abs(change), variance, out=np.zeros(len(variance)), where=finite & (variance > 0))
    error += split.neglected_rate_ratio
    if (error[finite] > UNCERTAINTY_LIMIT).any():
        _refuse_imprecise(delayed_system.names[int(np.where(finite, error, 0.0).argmax())], float(error[finite].max()))
    V, P = V.astype(float), P.astype(float)
    return StationaryCovariance(
        delayed_system.names,
        V @ P @ V.T,
        np.where(finite, variance, np.inf),
        status,
        reason,
        grown.rate,
        grown.power,
        residual,
        error,
    )


def rounding_thresholds(C: np.ndarray, P: np.ndarray) -> np.ndarray:
    """Variances (p,) of the outputs y = C x below which there is only rounding, so that an output counts as zero."""
    terms = abs(C) @ np.sqrt(abs(np.diagonal(P)))
    largest_output = abs(C).max(axis=1) * np.sqrt(abs(P).max(initial=0.0))
    return np.asarray(np.maximum(CANCELLATION_SHARE * terms, SILENCE_SHARE * largest_output) ** 2, float)


class NoiseArrivals(NamedTuple):
    """Instants at which noise reaches the axles: B (n, k), D (p, k) and delays (s); ``independent`` : whether each axle
    has its own noise."""

    B: list[np.ndarray]
    D: list[np.ndarray]
    delays: list[float]
    independent: bool


def noise_arrivals(delayed_system: DelayedSystem) -> NoiseArrivals:
    """``NoiseArrivals`` of a system; axles that meet the same noise at the same instant are combined."""
    if delayed_system.independent:
        return NoiseArrivals([*delayed_system.B], [*delayed_system.D], [0.0] * len(delayed_system.B), True)
    delays = sorted(set(delayed_system.delays))
    axles_by_hit = [[i for i, delay in enumerate(delayed_system.delays) if delay == hit] for hit in delays]
    if len(delays) == len(delayed_system.B):
        return NoiseArrivals(
            [delayed_system.B[i] for (i,) in axles_by_hit],
            [delayed_system.D[i] for (i,) in axles_by_hit],
            delays,
            False,
        )
    B, D = (
        [np.sum([matrices[i] for i in together], axis=0) for together in axles_by_hit]
        for matrices in (delayed_system.B, delayed_system.D)
    )
    return NoiseArrivals(B, D, delays, False)


MatrixExponential = Callable[[float, np.ndarray], np.ndarray]
"""Function that returns e^(A t) B of a time t (s) and B (n, k)."""


def _responses_before_arrival(
    A: np.ndarray, noise_arrivals_at_axles: NoiseArrivals, matrix_exponential: MatrixExponential | None = None
) -> list[np.ndarray]:
    """State responses F_j to noise that earlier axles have met, just before axle j meets the same noise; zero where no
    axle has met it before."""
    if matrix_exponential is None:

        def matrix_exponential(time: float, B: np.ndarray) -> np.ndarray:
            return np.asarray(expm(A * time) @ B)

    responses = [np.zeros_like(noise_arrivals_at_axles.B[0])]
    for j in range(1, len(noise_arrivals_at_axles.B)):
        never_correlated = noise_arrivals_at_axles.independent or len(A) == 0
        step = noise_arrivals_at_axles.delays[j] - noise_arrivals_at_axles.delays[j - 1]
        responses.append(
            np.zeros_like(noise_arrivals_at_axles.B[0])
            if never_correlated
            else matrix_exponential(step, responses[-1] + noise_arrivals_at_axles.B[j - 1])
        )
    return responses


def noise_intensity_of_system(
    delayed_system: DelayedSystem, matrix_exponential: MatrixExponential | None = None
) -> np.ndarray:
    """Noise intensity matrix Q of a system (see ``noise_intensity``), in double precision."""
    return noise_intensity(delayed_system.A, noise_arrivals(delayed_system), matrix_exponential).astype(float)


def noise_intensity(
    A: np.ndarray, noise_arrivals_at_axles: NoiseArrivals, matrix_exponential: MatrixExponential | None = None
) -> np.ndarray:
    """Noise intensity matrix Q (n, n) in A P + P A' + Q = 0: increase of the covariance per second by the noise at all
    axles, with exact delays.

    ``matrix_exponential`` stands for the matrix exponential where it is known. Squares in extended precision: where two
    axles' noises cancel in an output, so do the squares of their rounding.
    """
    earlier_responses, hit_inputs = (
        [matrix.astype(np.longdouble) for matrix in matrices]
        for matrices in (
            _responses_before_arrival(A, noise_arrivals_at_axles, matrix_exponential),
            noise_arrivals_at_axles.B,
        )
    )
    return np.asarray(sum(b @ b.T + f @ b.T + b @ f.T for f, b in zip(earlier_responses, hit_inputs, strict=True)))


def lyapunov_solution(A: np.ndarray, Q: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Solution P of the Lyapunov equation A P + P A' + Q = 0 in extended precision, the last correction, and the ratio
    of the residual to its largest term.

    python-control with its method named (left alone it takes another where slycot is installed), then refined: the
    residual, in extended precision, is solved for what is missing. Q may be indefinite. Raises InputError for a Q that
    is askew, values that are not finite, shapes that do not fit, and an A that is not stable: its equation has a
    solution, which is no covariance.
    """
    from control import lyap

    if A.shape != Q.shape or not (np.isfinite(A).all() and np.isfinite(Q).all()):
        raise InputError("", "A, Q", [list(A.shape), list(Q.shape)], "must be finite and of one shape (n, n)")
    if not abs(Q - Q.T).max(initial=0.0) <= ASYMMETRY_LIMIT * abs(Q).max(initial=0.0):
        raise InputError("", "Q", None, "must be symmetric")
    if len(A) == 0:
        return Q.astype(np.longdouble), Q.astype(np.longdouble), 0.0
    if (rate := float(np.linalg.eigvals(A).real.max())) >= 0.0:
        raise InputError("", "A", rate, "must be stable: the growth rate (1/s) of a motion that does not die out")
    wide, right = A.astype(np.longdouble), ((Q + Q.T) / 2).astype(np.longdouble)
    P = np.zeros_like(right)
    for _ in range(1 + MOST_REFINEMENTS):
        half = wide @ P
        correction = lyap(A, (half + half.T + right).astype(float), method="scipy").astype(np.longdouble)
        P = P + (correction + correction.T) / 2  # rounding leaves it askew, and half + half.T takes it to be symmetric
        if abs(correction).max() <= REFINED_SHARE * abs(P).max():
            break
    half = wide @ P
    left = abs(half + half.T + right).max(initial=0.0)
    return P, correction, float(left / max(abs(half).max(initial=0.0), np.finfo(float).tiny))


ASYMMETRY_LIMIT = 1e-9
"""Largest asymmetry of Q, relative to its largest element, that counts as rounding."""
UNCERTAINTY_LIMIT = 1e-6
"""Relative error of a variance above which no variance is given."""


def _refuse_imprecise(quantity_name: str, error: float) -> None:
    raise InputError(
        "",
        f"output {quantity_name}",
        None,
        f"its variance would be known to {error:.1g} of itself only: the rates of the "
        "vehicle and of the road lie too many decades apart, or a motion hardly dies out; look for a stiffness, "
        "damping or mass, or a corner of the road, that is far off",
    )


MOST_REFINEMENTS, REFINED_SHARE = 6, 1e-11
"""Largest count of corrections of the first solution, and the size of the last one relative to P below which refinement
ends: what remains is its square. A single correction is enough unless a motion hardly dies out; each takes as many
digits off the error as the first solution had."""


def _with_marginal_motions(
    marginal_parts: MarginalParts,
    noise_arrivals_at_axles: NoiseArrivals,
    stable_arrivals: NoiseArrivals,
    P: np.ndarray,
    last_correction: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Covariance of the whole state (marginal motions first), its last correction and its basis; motions with unbounded
    variance are left out.

    A motion that does not diffuse responds only between the first and the last hit: its covariances are integrals over
    that window.
    """
    k, onto_marginal = (
        marginal_parts.count_of_marginal_states,
        noise_arrivals_at_axles._replace(B=[marginal_parts.W0 @ b for b in noise_arrivals_at_axles.B]),
    )
    responses_before = (
        _responses_before_arrival(marginal_parts.M, onto_marginal),
        _responses_before_arrival(marginal_parts.S, stable_arrivals),
    )
    responses_after = [
        [f + g for f, g in zip(*pair, strict=True)]
        for pair in zip(responses_before, (onto_marginal.B, stable_arrivals.B), strict=True)
    ]
    within, cross = np.zeros((k, k)), np.zeros((k, len(marginal_parts.S)))
    for j in range(0 if noise_arrivals_at_axles.independent else len(noise_arrivals_at_axles.B) - 1):
        within += _integral_over_delay(
            marginal_parts.M,
            responses_after[0][j],
            noise_arrivals_at_axles.delays[j + 1] - noise_arrivals_at_axles.delays[j],
        )
        cross += (
            responses_after[0][j] @ responses_after[1][j].T - responses_before[0][j + 1] @ responses_before[1][j + 1].T
        )
    if len(marginal_parts.S):
        from control import lyap

        cross = lyap(marginal_parts.M, marginal_parts.S.T, cross.astype(float), method="scipy")
    full_covariance = np.block([[within.astype(np.longdouble), cross], [cross.T, P]])
    changed = np.zeros_like(full_covariance)
    changed[k:, k:] = last_correction
    return full_covariance, changed, np.hstack([marginal_parts.V0, marginal_parts.V])


def _integral_over_delay(M: np.ndarray, R: np.ndarray, delay: float) -> np.ndarray:
    """Integral of e^(M s) R R' e^(M' s) from s = 0 to ``delay``, by van Loan's block matrix; M neither grows nor
    decays."""
    k = len(M)
    block = expm(np.block([[-M, R @ R.T], [np.zeros((k, k)), M.T]]) * delay)
    integral = block[k:, k:].T @ block[:k, k:]
    return (integral + integral.T) / 2


def _output_variances(C: np.ndarray, P: np.ndarray) -> np.ndarray:
    """Variances (p,) of the outputs y = C x with state covariance P."""
    return np.einsum("pi,ij,pj->p", C.astype(np.longdouble), P, C.astype(np.longdouble)).astype(float)


CANCELLATION_SHARE, SILENCE_SHARE = 1e-9, 1e-12
"""Ratios of a standard deviation to the sum of its terms, and to the largest that the states could give, below which it
is zero by symmetry: motions are known to about ten digits, and states at rest to those of P."""


def variance_verdicts(
    D: Sequence[np.ndarray],
    variance: np.ndarray,
    rounding_floor: np.ndarray,
    growth_of_variance: VarianceGrowth,
    fastest_rate: float,
    matrix_accuracy: float,
    marginal_parts: MarginalParts | None = None,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Status of every output's variance (finite, infinite or diffusing), and the reason for it.

    White noise that comes through D counts if, up to the system's ``fastest_rate`` (1/s), it carries more than rounding
    could of the output's variance without it; ``rounding_floor`` (p,) is what rounding makes of a variance of zero."""
    direct = sum((d**2).sum(axis=1) for d in D) * fastest_rate
    white = direct > (ZERO_MARGIN * matrix_accuracy) ** 2 * variance + rounding_floor
    verdicts = [
        _variance_verdict(*output, marginal_parts)
        for output in zip(white, growth_of_variance.rate, growth_of_variance.power, strict=True)
    ]
    return tuple(status for status, _ in verdicts), tuple(reason for _, reason in verdicts)


def _variance_verdict(
    is_white: bool, growth_rate: float, growth_power: int, marginal_parts: MarginalParts | None
) -> tuple[str, str]:
    if is_white:
        return INFINITE, WHITE_NOISE_REASON
    if growth_power:
        deviation_after = np.sqrt(growth_rate * 100.0**growth_power)
        return DIFFUSING, (
            f"the road drives a motion that nothing pulls back and that this output sees: its variance "
            f"grows as {growth_rate:.4g} t^{growth_power} (t in s), a standard deviation of {deviation_after:.3g} "
            "after 100 s"
        )
    if marginal_parts is None or not marginal_parts.count_of_marginal_states:
        return FINITE, "every motion dies out"
    return FINITE, (
        f"{marginal_parts.count_of_marginal_states} states are of motions that nothing pulls back, but this output "
        "does not see them, or sees only what the road does not drive in the long run"
    )


WHITE_NOISE_REASON = (
    "white noise of the road reaches this output directly, at all frequencies alike (tyre damping under a road "
    "filter of first order does that): take a road filter of second order, or a limited band"
)
