"""Choice among subsets of parameters: every subset is fitted to the measurement and ranked by an information criterion.

The deviations that a fit makes small are whitened: standard normal where the model is right. The criterion is that of
quasi-likelihood (Burnham and Anderson, Model selection, 2002, ch. 2.5): the sum of squares by the inflation that the
fullest subset leaves, c = chi^2 / degrees of freedom, at least 1.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import f as f_distribution

UNDETERMINED_SHARE = 1e-6
"""Share of the largest singular value of a fit's sensitivities below which a combination of parameters is not
determined."""
DIFFERENCE_STEP, LEAST_VALUE = 1e-4, 0.1
"""Relative step of finite differences, and the least magnitude of a value for it."""
HIGH_CORRELATION = 0.9
"""Correlation of two estimates above which they are hard to tell apart."""

DeviationFunction = Callable[[dict[str, float]], np.ndarray]
"""Function of parameter values by name, all others absent, that gives whitened deviations (n,)."""


@dataclass(frozen=True)
class CandidateParameter:
    """A parameter that a fit may include: start value, lower bound, and scale of steps."""

    start: float
    lower_bound: float = -np.inf
    scale: float = 0.1


@dataclass(frozen=True, eq=False)
class SubsetFit:
    """Fit of a subset of parameters (k,): their values and covariance (k, k), chi^2, and the number of fitted data.

    undetermined : of those that the data do not tell: names of parameters that no number depends on, or sums of them.
    """

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    chi_square: float
    data_count: int
    undetermined: tuple[str, ...]

    @property
    def named(self) -> dict[str, float]:
        """Fitted values by parameter name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def rank(self) -> int:
        """Number of parameters that the data determine."""
        return len(self.names) - len(self.undetermined)

    @property
    def degrees_of_freedom(self) -> int:
        """Number of fitted data less the number of determined parameters."""
        return self.data_count - self.rank

    def criterion(self, variance_inflation: float) -> float:
        """Quasi-likelihood information criterion (QAICc), with the correction for small samples."""
        k = self.rank + 1
        return self.chi_square / variance_inflation + 2.0 * k + 2.0 * k * (k + 1) / max(self.data_count - k - 1, 1)

    def prediction_and_variance(
        self, prediction_function: Callable[[dict[str, float]], np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Predictions (m,) of the function ``prediction_function`` at the fitted values, and their variances (m,) from
        the parameters' covariance."""
        fitted_predictions = prediction_function(self.named)
        slopes = np.zeros((len(fitted_predictions), len(self.names)))
        for i, (name, value) in enumerate(self.named.items()):
            step = DIFFERENCE_STEP * max(abs(value), LEAST_VALUE)
            slopes[:, i] = (prediction_function(self.named | {name: value + step}) - fitted_predictions) / step
        return fitted_predictions, np.einsum("ij,jk,ik->i", slopes, self.covariance, slopes)


@dataclass(frozen=True, eq=False)
class SubsetChoice:
    """All subsets of parameters in the order of their information criterion, their weights (probabilities), and the
    inflation factor c of chi^2.

    removal_tests : (F, p) of each parameter, of leaving it out of the fullest subset that can be told apart;
    undetermined_parameters : parameters on which no measured number depends.
    """

    subset_fits: list[SubsetFit]
    criteria: np.ndarray
    weights: np.ndarray
    variance_inflation: float
    removal_tests: dict[str, tuple[float, float]]
    undetermined_parameters: tuple[str, ...]

    @property
    def best_subset(self) -> SubsetFit:
        """The subset with the lowest information criterion."""
        return self.subset_fits[0]

    def importance(self, parameter_name: str) -> float:
        """Sum of the weights of all subsets that contain a parameter."""
        return float(
            sum(w for fit, w in zip(self.subset_fits, self.weights, strict=True) if parameter_name in fit.names)
        )

    def forecast(self, prediction_function: Callable[[dict[str, float]], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Predictions (m,) averaged over all subsets with their weights, and their standard deviations (m,).

        The variance is that within the subsets and that among them (Burnham and Anderson, ch. 4.3).
        """
        means, variances = map(
            np.array, zip(*(fit.prediction_and_variance(prediction_function) for fit in self.subset_fits), strict=True)
        )
        mean = self.weights @ means
        return mean, np.sqrt(self.weights @ (self.variance_inflation * variances + (means - mean) ** 2))

    def hard_to_tell_apart(self) -> list[tuple[str, str, float]]:
        """Pairs of parameters whose estimates in the fullest subset have a correlation above HIGH_CORRELATION, with
        that correlation."""
        fullest = max(self.subset_fits, key=lambda fit: len(fit.names))
        size = np.sqrt(np.diag(fullest.covariance))
        pairs = combinations(range(len(size)), 2)
        correlations = [(i, j, float(fullest.covariance[i, j] / (size[i] * size[j]))) for j, i in pairs]
        return [
            (fullest.names[i], fullest.names[j], c) for i, j, c in sorted(correlations) if abs(c) > HIGH_CORRELATION
        ]


def fit_all(deviation_function: DeviationFunction, candidates: Mapping[str, CandidateParameter]) -> SubsetFit:
    """``SubsetFit`` of all candidate parameters, fitted together."""
    names = tuple(candidates)
    if not names:
        left = deviation_function({})
        return SubsetFit((), np.empty(0), np.empty((0, 0)), float(np.sum(left**2)), len(left), ())
    start, lower, scale = (
        np.array([getattr(c, k) for c in candidates.values()]) for k in ("start", "lower_bound", "scale")
    )
    fit = least_squares(
        lambda values: deviation_function(dict(zip(names, values.tolist(), strict=True))),
        start,
        bounds=(lower, np.inf),
        x_scale=scale,
        diff_step=1e-5,
        method="dogbox",
    )
    _, sizes, rows = np.linalg.svd(fit.jac * scale)
    is_determined = sizes > UNDETERMINED_SHARE * max(sizes.max(initial=0.0), 1e-300)
    covariance = (
        (rows[: len(sizes)][is_determined].T / sizes[is_determined] ** 2)
        @ rows[: len(sizes)][is_determined]
        * np.outer(scale, scale)
    )
    undetermined = tuple(_combination_text(names, row) for row in rows[np.count_nonzero(is_determined) :])
    return SubsetFit(names, fit.x, covariance, float(np.sum(fit.fun**2)), len(fit.fun), undetermined)


def ranked_subsets(
    deviation_function: DeviationFunction,
    candidates: Mapping[str, CandidateParameter],
    joint_removals: Mapping[str, Sequence[str]] | None = None,
) -> SubsetChoice:
    """Fits of every subset of the candidate parameters, ranked by the information criterion; joint_removals : named
    sets of candidates whose joint removal is tested, too."""
    everything = fit_all(deviation_function, candidates)
    blind = tuple(name for name in candidates if name in everything.undetermined)
    names_seen = [name for name in candidates if name not in blind]
    subsets = [names for size in range(len(names_seen) + 1) for names in combinations(names_seen, size)]
    fits = [fit_all(deviation_function, {name: candidates[name] for name in names}) for names in subsets]
    determined = [fit for fit in fits if not fit.undetermined and fit.degrees_of_freedom > 0]
    fullest = max(determined, key=lambda fit: (len(fit.names), -fit.chi_square))
    inflation = max(fullest.chi_square / fullest.degrees_of_freedom, 1.0)
    ranked_fits = sorted(determined, key=lambda fit: fit.criterion(inflation))
    criteria = np.array([fit.criterion(inflation) for fit in ranked_fits])
    weights = np.exp(-0.5 * (criteria - criteria[0]))
    removal_tests = _removal_tests(fits, fullest, inflation, joint_removals or {})
    return SubsetChoice(ranked_fits, criteria, weights / weights.sum(), inflation, removal_tests, blind)


def _removal_tests(
    subset_fits: list[SubsetFit],
    fullest_subset: SubsetFit,
    variance_inflation: float,
    joint_removals: Mapping[str, Sequence[str]],
) -> dict[str, tuple[float, float]]:
    """F statistic and p value of removing each parameter, and each named set of parameters, from the fullest subset."""
    by_names = {fit.names: fit for fit in subset_fits}
    leaving: dict[str, Sequence[str]] = {name: (name,) for name in fullest_subset.names}
    leaving |= {set_name: names for set_name, names in joint_removals.items() if {*names} <= {*fullest_subset.names}}
    tests = {}
    for set_name, gone in leaving.items():
        reduced_fit = by_names[tuple(name for name in fullest_subset.names if name not in gone)]
        ratio = max(reduced_fit.chi_square - fullest_subset.chi_square, 0.0) / variance_inflation / len(gone)
        tests[set_name] = (ratio, float(f_distribution.sf(ratio, len(gone), fullest_subset.degrees_of_freedom)))
    return tests


def _combination_text(parameter_names: tuple[str, ...], coefficients: np.ndarray) -> str:
    """Text on a combination of parameters; those with coefficients below a hundredth are left out."""
    return " with ".join(
        name for name, coefficient in zip(parameter_names, coefficients, strict=True) if abs(coefficient) > 1e-2
    )
