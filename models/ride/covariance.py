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
from models.ride.marginal import MATRIX_ACCURACY, ZERO_MARGIN, Growth, MarginalParts, split_marginal, variance_growth

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


def stationary_covariance(system: DelayedSystem, accuracy: float = MATRIX_ACCURACY) -> StationaryCovariance:
    """Stationary covariance of a system whose axles meet unit white noise one after the other.

    ``accuracy`` of the system's matrices, relative: what is smaller counts as zero, so that free motions are found.
    Raises Unstable, with growth rate and frequency, if the system leaves its equilibrium on its own, and InputError
    where a variance cannot be told to UNCERTAINTY_LIMIT of itself.
    """
    met = noise_arrivals(system)
    split = split_marginal(system.A, accuracy)
    onto_stable = met._replace(B=[split.W @ b for b in met.B])  # in extended precision: modes may be nearly parallel
    P, correction, residual = lyapunov_solution(split.S, noise_intensity(split.S, onto_stable))
    V = split.V
    if split.count_of_marginal_states:
        P, correction, V = _with_marginal_motions(split, met, onto_stable, P, correction)
    C = system.C @ V
    floor, change = rounding_thresholds(C, P), _output_variances(C, correction)
    variance = _output_variances(C, P)
    variance = np.where(variance > floor, variance, 0.0)
    grown = variance_growth(split, met.B, met.delays, system.C, met.independent, variance + floor, accuracy)
    status, reason = variance_verdicts(met.D, variance, floor, grown, float(np.linalg.norm(split.S)), accuracy, split)
    finite = np.array(status) == FINITE
    error = np.divide(abs(change), variance, out=np.zeros(len(variance)), where=finite & (variance > 0))
    error += split.neglected_rate_ratio
    if (error[finite] > UNCERTAINTY_LIMIT).any():
        _refuse(system.names[int(np.where(finite, error, 0.0).argmax())], float(error[finite].max()))
    V, P = V.astype(float), P.astype(float)
    return StationaryCovariance(
        system.names,
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


def noise_arrivals(system: DelayedSystem) -> NoiseArrivals:
    """``NoiseArrivals`` of a system; axles that meet the same noise at the same instant are combined."""
    if system.independent:
        return NoiseArrivals([*system.B], [*system.D], [0.0] * len(system.B), True)
    delays = sorted(set(system.delays))
    axles_by_hit = [[i for i, delay in enumerate(system.delays) if delay == hit] for hit in delays]
    if len(delays) == len(system.B):
        return NoiseArrivals(
            [system.B[i] for (i,) in axles_by_hit], [system.D[i] for (i,) in axles_by_hit], delays, False
        )
    B, D = (
        [np.sum([matrices[i] for i in together], axis=0) for together in axles_by_hit]
        for matrices in (system.B, system.D)
    )
    return NoiseArrivals(B, D, delays, False)


Propagator = Callable[[float, np.ndarray], np.ndarray]
"""Function that returns e^(A t) B of a time t (s) and B (n, k)."""


def _responses_before_arrival(
    A: np.ndarray, arrivals: NoiseArrivals, propagator: Propagator | None = None
) -> list[np.ndarray]:
    """State responses F_j to noise that earlier axles have met, just before axle j meets the same noise; zero where no
    axle has met it before."""
    if propagator is None:

        def propagator(time: float, B: np.ndarray) -> np.ndarray:
            return np.asarray(expm(A * time) @ B)

    responses = [np.zeros_like(arrivals.B[0])]
    for j in range(1, len(arrivals.B)):
        never_correlated = arrivals.independent or len(A) == 0
        step = arrivals.delays[j] - arrivals.delays[j - 1]
        responses.append(
            np.zeros_like(arrivals.B[0]) if never_correlated else propagator(step, responses[-1] + arrivals.B[j - 1])
        )
    return responses


def noise_intensity_of_system(system: DelayedSystem, propagator: Propagator | None = None) -> np.ndarray:
    """Noise intensity matrix Q of a system (see ``noise_intensity``), in double precision."""
    return noise_intensity(system.A, noise_arrivals(system), propagator).astype(float)


def noise_intensity(A: np.ndarray, arrivals: NoiseArrivals, propagator: Propagator | None = None) -> np.ndarray:
    """Noise intensity matrix Q (n, n) in A P + P A' + Q = 0: increase of the covariance per second by the noise at all
    axles, with exact delays.

    ``propagator`` stands for the matrix exponential where it is known. Squares in extended precision: where two axles'
    noises cancel in an output, so do the squares of their rounding.
    """
    earlier_responses, hit_inputs = (
        [matrix.astype(np.longdouble) for matrix in matrices]
        for matrices in (_responses_before_arrival(A, arrivals, propagator), arrivals.B)
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


def _refuse(name: str, error: float) -> None:
    raise InputError(
        "",
        f"output {name}",
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
    split: MarginalParts, arrivals: NoiseArrivals, onto_stable: NoiseArrivals, P: np.ndarray, correction: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Covariance of the whole state (marginal motions first), its last correction and its basis; motions with unbounded
    variance are left out.

    A motion that does not diffuse responds only between the first and the last hit: its covariances are integrals over
    that window.
    """
    k, onto_marginal = split.count_of_marginal_states, arrivals._replace(B=[split.W0 @ b for b in arrivals.B])
    responses_before = (
        _responses_before_arrival(split.M, onto_marginal),
        _responses_before_arrival(split.S, onto_stable),
    )
    responses_after = [
        [f + g for f, g in zip(*pair, strict=True)]
        for pair in zip(responses_before, (onto_marginal.B, onto_stable.B), strict=True)
    ]
    within, cross = np.zeros((k, k)), np.zeros((k, len(split.S)))
    for j in range(0 if arrivals.independent else len(arrivals.B) - 1):
        within += _integral_over_delay(split.M, responses_after[0][j], arrivals.delays[j + 1] - arrivals.delays[j])
        cross += (
            responses_after[0][j] @ responses_after[1][j].T - responses_before[0][j + 1] @ responses_before[1][j + 1].T
        )
    if len(split.S):
        from control import lyap

        cross = lyap(split.M, split.S.T, cross.astype(float), method="scipy")
    full_covariance = np.block([[within.astype(np.longdouble), cross], [cross.T, P]])
    changed = np.zeros_like(full_covariance)
    changed[k:, k:] = correction
    return full_covariance, changed, np.hstack([split.V0, split.V])


def _integral_over_delay(M: np.ndarray, R: np.ndarray, length: float) -> np.ndarray:
    """Integral of e^(M s) R R' e^(M' s) from s = 0 to ``length``, by van Loan's block matrix; M neither grows nor
    decays."""
    k = len(M)
    block = expm(np.block([[-M, R @ R.T], [np.zeros((k, k)), M.T]]) * length)
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
    growth: Growth,
    fastest_rate: float,
    accuracy: float,
    split: MarginalParts | None = None,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Status of every output's variance (finite, infinite or diffusing), and the reason for it.

    White noise that comes through D counts if, up to the system's ``fastest_rate`` (1/s), it carries more than rounding
    could of the output's variance without it; ``rounding_floor`` (p,) is what rounding makes of a variance of zero."""
    direct = sum((d**2).sum(axis=1) for d in D) * fastest_rate
    white = direct > (ZERO_MARGIN * accuracy) ** 2 * variance + rounding_floor
    verdicts = [_variance_verdict(*output, split) for output in zip(white, growth.rate, growth.power, strict=True)]
    return tuple(status for status, _ in verdicts), tuple(reason for _, reason in verdicts)


def _variance_verdict(is_white: bool, rate: float, power: int, split: MarginalParts | None) -> tuple[str, str]:
    if is_white:
        return INFINITE, WHITE_NOISE_REASON
    if power:
        deviation_after = np.sqrt(rate * 100.0**power)
        return DIFFUSING, (
            f"the road drives a motion that nothing pulls back and that this output sees: its variance "
            f"grows as {rate:.4g} t^{power} (t in s), a standard deviation of {deviation_after:.3g} after "
            "100 s"
        )
    if split is None or not split.count_of_marginal_states:
        return FINITE, "every motion dies out"
    return FINITE, (
        f"{split.count_of_marginal_states} states are of motions that nothing pulls back, but this output does not see "
        "them, or sees only what the road does not drive in the long run"
    )


WHITE_NOISE_REASON = (
    "white noise of the road reaches this output directly, at all frequencies alike (tyre damping under a road "
    "filter of first order does that): take a road filter of second order, or a limited band"
)
