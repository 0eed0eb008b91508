"""Uncertainty of identified parameters: covariance from correlated residuals, determined combinations, likelihood
profiles.

Residuals of a model that was fitted are no white noise: they stay for as long as a corner lasts. The covariance of
estimates is therefore the sandwich H^-1 S H^-1 with H = J^T J and S the long-run covariance of the scores J_t^T e_t,
summed over lags up to several times as long as residuals stay alike, with falling weights; or that of stationary
residuals as alike as they are, where it is larger: short records scatter. Source: Newey and West,
Econometrica 55 (1987), 703-708; for the whole, Ljung, System Identification (1999), section 9.
"""

from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.identification.fit import ParameterFit, fit, problem_with_fixed_parameter
from models.identification.problem import IdentificationProblem

LONGEST_LAG_FACTOR = 4.0
"""Ratio of the longest lag to the integral scale of the residuals."""
LAG_COUNT_LIMIT = 0.1
"""Largest ratio of the longest lag to the number of samples."""
NORMAL_QUANTILE = 1.96
"""Number of standard deviations of a 95 % interval."""
SINGULAR_EIGENVALUE_SHARE = 1e-12
"""Ratio to the largest eigenvalue of the information matrix below which an eigenvalue counts as zero."""
DETERMINED_HALF_WIDTH = 1.0
"""Half-width of the 95 % interval, in the parameter's scale, from which on a parameter counts as not determined."""
CHI_SQUARE_LIMIT = 3.841
"""95 % quantile of chi-square with one degree of freedom."""
PROFILED_DEVIATIONS = (-2.0, -1.0, 1.0, 2.0)
"""Distances from the estimate, in standard deviations, at which a likelihood profile is computed."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Uncertainty of fitted parameters, in their scales: covariance (p, p), information matrix H (p, p).

    at_no_bound (p,) : estimates that lie at no bound; the others have no covariance.
    """

    fit: ParameterFit
    covariance: np.ndarray
    information: np.ndarray
    at_no_bound: np.ndarray
    correlation_time: float

    @cached_property
    def deviations(self) -> np.ndarray:
        """Standard errors (p,) in the units of the parameters; very large for parameters that the data do not
        determine, NaN for estimates at a bound."""
        spread = np.sqrt(np.clip(np.diag(self.covariance), 0.0, None)) * self.fit.problem.scales
        return np.where(self.at_no_bound, spread, np.nan)

    @cached_property
    def is_determined(self) -> np.ndarray:
        """For each parameter (p,): whether its 95 % interval is narrower than its scale, and its estimate lies at no
        bound."""
        with np.errstate(invalid="ignore"):
            narrow = NORMAL_QUANTILE * self.deviations < DETERMINED_HALF_WIDTH * self.fit.problem.scales
        return self.at_no_bound & narrow

    @cached_property
    def condition(self) -> float:
        """Ratio of the largest to the smallest standard deviation among combinations of parameters, from the
        information matrix."""
        values = np.linalg.eigvalsh(self.information[np.ix_(self.at_no_bound, self.at_no_bound)])
        return float(np.sqrt(values[-1] / values[0])) if values[0] > SINGULAR_EIGENVALUE_SHARE * values[-1] else np.inf

    def combinations(self) -> list[tuple[float, np.ndarray]]:
        """Uncorrelated combinations of scaled parameters: standard error and direction (p,) of each, the best
        determined combination first."""
        inner = np.ix_(self.at_no_bound, self.at_no_bound)
        values, vectors = np.linalg.eigh(self.covariance[inner])
        answer = []
        for value, vector in zip(values, vectors.T, strict=True):
            full_vector = np.zeros(len(self.at_no_bound))
            full_vector[self.at_no_bound] = vector * np.sign(vector[np.argmax(np.abs(vector))])
            answer.append((float(np.sqrt(max(value, 0.0))), full_vector))
        return answer


def uncertainty(fit: ParameterFit, executor: Executor | None = None) -> Uncertainty:
    """``Uncertainty`` of the estimates, from the residuals of the fit; executor : computes the columns of their
    Jacobian."""
    problem = fit.problem
    jacobian = problem.jacobian(fit.values, executor=executor)
    free = ~fit.is_at_bound
    inner = np.einsum("cmp,cmq->pq", jacobian, jacobian)
    scores = np.einsum("cmp,cm->mp", jacobian, fit.residuals)
    lags, staying = _longest_lags(fit.residuals)
    covariance = np.zeros_like(inner)
    free_block = np.ix_(free, free)
    if free.any():
        inverse = _information_inverse(inner[free_block])
        both_covariances = (
            _long_run_covariance(scores[:, free], lags),
            _stationary_covariance(jacobian[:, :, free], fit.residuals, lags),
        )
        covariance[free_block] = inverse @ _larger_covariance(*both_covariances) @ inverse
        covariance[free_block] += _undetermined_variance(inner[free_block])
    return Uncertainty(fit, covariance, inner, free, staying * problem.clock.stride * problem.clock.period)


def _information_inverse(information: np.ndarray) -> np.ndarray:
    """Inverse of an information matrix (p, p), without its undetermined directions."""
    values, vectors = np.linalg.eigh(information)
    known = values > SINGULAR_EIGENVALUE_SHARE * values[-1]
    return (vectors[:, known] / values[known]) @ vectors[:, known].T


def _undetermined_variance(information: np.ndarray) -> np.ndarray:
    """Very large variance (p, p) for directions of parameters that do not affect the residuals."""
    values, vectors = np.linalg.eigh(information)
    blind = vectors[:, values <= SINGULAR_EIGENVALUE_SHARE * values[-1]]
    return 1e12 * blind @ blind.T


def _longest_lags(residuals: np.ndarray) -> tuple[int, float]:
    """Largest lag to be summed, and the integral scale of the residuals in samples, both for the most slowly varying
    channel."""
    staying = 1.0
    for row in residuals:
        count, centred = len(row), row - row.mean()
        spectrum = np.abs(np.fft.rfft(centred, 2 * count)) ** 2
        autocorrelation = np.fft.irfft(spectrum)[:count]
        if autocorrelation[0] > 0.0:
            autocorrelation /= autocorrelation[0]
            negative = np.flatnonzero(autocorrelation <= 0.0)
            staying = max(
                staying, float(1.0 + 2.0 * autocorrelation[1 : negative[0] if len(negative) else count].sum())
            )
    lag_limit = max(1, int(LAG_COUNT_LIMIT * residuals.shape[1]))
    return min(lag_limit, int(np.ceil(LONGEST_LAG_FACTOR * staying))), staying


def _long_run_covariance(scores: np.ndarray, lag_count: int) -> np.ndarray:
    """Long-run covariance (p, p) of the sum of scores (m, p), with weights that fall linearly with the lag
    (Bartlett)."""
    total = scores.T @ scores
    for lag in range(1, lag_count + 1):
        product = scores[lag:].T @ scores[:-lag]
        total += (1.0 - lag / (lag_count + 1.0)) * (product + product.T)
    count, p = scores.shape
    return total * count / max(count - p, 1)


def _stationary_covariance(jacobian: np.ndarray, residuals: np.ndarray, lag_count: int) -> np.ndarray:
    """Long-run covariance (p, p) as in ``_long_run_covariance``, for stationary residuals: from each channel's own
    autocovariance."""
    total = np.zeros((jacobian.shape[2],) * 2)
    for rows, error in zip(jacobian, residuals, strict=True):
        for lag in range(lag_count + 1):
            autocovariance = float(error[lag:] @ error[: len(error) - lag]) / len(error)
            product = rows[lag:].T @ rows[: len(rows) - lag]
            total += (1.0 - lag / (lag_count + 1.0)) * autocovariance * (product if lag == 0 else product + product.T)
    return total


def _larger_covariance(first_covariance: np.ndarray, second_covariance: np.ndarray) -> np.ndarray:
    """A covariance (p, p) that is at least as large as both given ones in every direction. Scores account for where
    residuals are large, but scatter more."""
    values, vectors = np.linalg.eigh(second_covariance)
    values = np.maximum(values, SINGULAR_EIGENVALUE_SHARE * values[-1])
    root, back = (vectors * np.sqrt(values)) @ vectors.T, (vectors / np.sqrt(values)) @ vectors.T
    ratios, principal_axes = np.linalg.eigh(back @ first_covariance @ back)
    return root @ (principal_axes * np.maximum(ratios, 1.0)) @ principal_axes.T @ root


@dataclass(frozen=True, eq=False)
class LikelihoodProfile:
    """Likelihood profile of one parameter: its values (k,), and the rise of the misfit (k,) at each after all other
    parameters are refitted, in units in which 3.84 is the 95 % limit; ``parabolic_rise`` (k,) : the rise according to
    the standard error."""

    name: str
    values: np.ndarray
    misfit_rise: np.ndarray
    parabolic_rise: np.ndarray

    @property
    def is_quadratic(self) -> bool:
        """Whether profile and parabola agree to within one half; the standard error then describes the uncertainty
        fully."""
        return bool(
            np.all(np.abs(self.misfit_rise - self.parabolic_rise) <= 0.5 * np.maximum(self.parabolic_rise, 1.0))
        )


def likelihood_profile(uncertainty: Uncertainty, parameter_index: int) -> LikelihoodProfile:
    """Likelihood profile of parameter ``parameter_index``. The misfit is weighted as in the covariance, so that
    correlated residuals do not count as independent ones."""
    solved, problem = uncertainty.fit, uncertainty.fit.problem
    scale, parameter = problem.scales[parameter_index], problem.parameters[parameter_index]
    spread = uncertainty.deviations[parameter_index] if np.isfinite(uncertainty.deviations[parameter_index]) else scale
    spread = min(spread, 0.5 * scale)
    naive = _information_inverse(uncertainty.information)[parameter_index, parameter_index] * scale**2
    weight = (
        naive / uncertainty.deviations[parameter_index] ** 2
        if np.isfinite(uncertainty.deviations[parameter_index]) and naive > 0.0
        else 1.0
    )
    values = [
        v
        for v in solved.values[parameter_index] + spread * np.array(PROFILED_DEVIATIONS)
        if parameter.lower_bound < v < parameter.upper_bound
    ]
    rises = []
    for value in values:
        held_fit = fit(_fixed_parameter_problem(problem, parameter_index, value, solved.values))
        rises.append(2.0 * (held_fit.cost - solved.cost) * weight)
    parabola = ((np.array(values) - solved.values[parameter_index]) / uncertainty.deviations[parameter_index]) ** 2
    return LikelihoodProfile(parameter.name, np.array(values), np.array(rises), parabola)


def _fixed_parameter_problem(
    identification_problem: IdentificationProblem, parameter_index: int, fixed_value: float, start_values: np.ndarray
) -> IdentificationProblem:
    """The problem with parameter ``parameter_index`` fixed at a value; the others start from ``start_values`` (p,),
    moved inside their bounds."""
    low, high = identification_problem.bounds
    start_inside = np.clip(
        start_values, low + 1e-6 * identification_problem.scales, high - 1e-6 * identification_problem.scales
    )
    return problem_with_fixed_parameter(identification_problem, parameter_index, fixed_value, start_inside)
