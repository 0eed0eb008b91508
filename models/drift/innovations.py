"""Consistency check of a Kalman filter: whether its innovations are as large as stated, without mean, and white.

Of a filter that is right, the innovations divided by the root of their covariance are independent and normal with
deviation 1, whatever the measurement was. Three figures of a run are held against that law, each with its own share of
a level that is stated for the run as a whole: their mean square (a chi-square sample), the mean of every column (a bias
of the sensor, an offset of the forces), and its correlation over the next samples (a wrong inertia, a late sensor).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

FALSE_ALARM_SHARE = 1e-3
"""Share of the runs of a correct filter that are called inconsistent."""
CORRELATION_LAGS = 20
"""Largest lag, in samples, at which innovations are checked for correlation."""
FEWEST_INNOVATIONS = 100
"""Number of innovations in a column below which their mean and correlation are not judged."""


@dataclass(frozen=True)
class InnovationStatistic:
    """A statistic of a filter's innovations with its acceptance interval. If the filter is right, a run has any
    statistic outside only with the probability FALSE_ALARM_SHARE."""

    name: str
    value: float
    lower_limit: float
    upper_limit: float

    @property
    def is_within_interval(self) -> bool:
        """Whether the statistic lies within its acceptance interval."""
        return self.lower_limit <= self.value <= self.upper_limit

    def __str__(self) -> str:
        """The statistic with its acceptance interval, as text for an engineer."""
        return f"{self.name} {self.value:.3g} ({self.lower_limit:.3g} to {self.upper_limit:.3g})"


@dataclass(frozen=True)
class FilterConsistency:
    """Statistics of the innovations of a filter's run; the first is the mean square of all normalised innovations."""

    statistics: tuple[InnovationStatistic, ...]

    @property
    def is_consistent(self) -> bool:
        """Whether all statistics lie within their acceptance intervals."""
        return all(figure.is_within_interval for figure in self.statistics)

    def __str__(self) -> str:
        """Sentence on the statistics outside their acceptance intervals, or that all are inside."""
        if self.is_consistent:
            return f"its innovations are as stated: {self.statistics[0]}"
        wrong = "; ".join(map(str, (figure for figure in self.statistics if not figure.is_within_interval)))
        return (
            f"its innovations are not what model and stated deviations make: {wrong}; in brackets where those "
            f"of a right filter lie, but for one run in {1 / FALSE_ALARM_SHARE:.0f}"
        )


def consistency(innovations: np.ndarray, column_names: Sequence[str]) -> FilterConsistency:
    """Consistency statistics of normalised innovations (n, columns), which are independent and of standard deviation 1
    if the filter is right; NaN where nothing was measured."""
    known = np.isfinite(innovations)
    tail = FALSE_ALARM_SHARE / (1 + 2 * len(column_names)) / 2
    count = int(known.sum())
    if not count:
        return FilterConsistency(())
    square = float(np.mean(innovations[known] ** 2))
    figures = [InnovationStatistic("mean square", square, *(chi2.ppf([tail, 1 - tail], count) / count).tolist())]
    for name, column in zip(column_names, innovations.T, strict=True):
        if np.isfinite(column).sum() >= FEWEST_INNOVATIONS:
            figures += [_mean_statistic(name, column, tail), _correlation(name, column, tail)]
    return FilterConsistency(tuple(figures))


def _mean_statistic(column_name: str, innovations: np.ndarray, tail_probability: float) -> InnovationStatistic:
    """Statistic of the mean of one column's normalised innovations."""
    known = innovations[np.isfinite(innovations)]
    wide = float(norm.isf(tail_probability)) / math.sqrt(len(known))
    return InnovationStatistic(f"mean of {column_name}", float(known.mean()), -wide, wide)


def _correlation(column_name: str, innovations: np.ndarray, tail_probability: float) -> InnovationStatistic:
    """Statistic of the serial correlation of innovations: root mean square of the correlations at lags 1 to
    CORRELATION_LAGS.

    For white samples each correlation is normal, with a variance of one over the number of pairs (Box and Pierce).
    """
    column_with_zeros = np.where(np.isfinite(innovations), innovations, 0.0)
    is_known = np.isfinite(innovations).astype(float)
    lags = range(1, min(CORRELATION_LAGS, len(innovations) // 5) + 1)
    pairs = np.array([float(is_known[lag:] @ is_known[:-lag]) for lag in lags])
    power = float(column_with_zeros @ column_with_zeros) / is_known.sum()
    correlations = (
        np.array([float(column_with_zeros[lag:] @ column_with_zeros[:-lag]) for lag in lags])
        / np.maximum(pairs, 1.0)
        / power
    )
    size = math.sqrt(float(np.sum(pairs * correlations**2)) / float(pairs.sum()))
    high = math.sqrt(float(chi2.isf(tail_probability, len(lags))) / float(pairs.sum()))
    return InnovationStatistic(f"correlation of {column_name}", size, 0.0, high)
