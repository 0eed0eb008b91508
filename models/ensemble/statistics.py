"""Statistics of an ensemble with their standard errors or intervals."""

import math

import numpy as np

from models.core.errors import InputError

FEWEST_PATHS = 3
"""Least number of values from which a standard deviation and its error are computed."""
STANDARD_ERRORS_95 = 1.959964
"""Number of standard errors on either side of a 95 % interval."""
FAN_PERCENTILES = (5, 25, 50, 75, 95)
"""Percentiles of errors that figures show."""


def deviation_with_error(samples: np.ndarray) -> tuple[float, float]:
    """Standard deviation of values (n,) and its standard error, for any distribution of finite fourth moment.

    By Var(s^2) = (mu4 - sigma^4) / n to first order; 1/sqrt(2 n) of it for a normal law. Not a number if any
    value is none. Raises InputError for fewer than ``FEWEST_PATHS`` values, of which two have an error of 0 by this.
    """
    if not len(samples):
        return deviation_from_moments(0, 0.0, 0.0)
    centred = samples - samples.mean()
    return deviation_from_moments(len(samples), float(np.mean(centred**2)), float(np.mean(centred**4)))


def deviation_from_moments(value_count: int, second_moment: float, fourth_moment: float) -> tuple[float, float]:
    """Standard deviation and its standard error, from the second and fourth central moments of ``value_count``
    values."""
    if value_count < FEWEST_PATHS:
        raise InputError(
            "", "values", value_count, f"a standard deviation and its error need {FEWEST_PATHS} values or more"
        )
    spread = math.sqrt(second_moment * value_count / (value_count - 1))
    if spread == 0.0:
        return 0.0, 0.0
    return spread, math.sqrt(max(fourth_moment - second_moment**2, 0.0) / value_count) / (2 * math.sqrt(second_moment))


def percentiles(errors: np.ndarray) -> np.ndarray:
    """Percentiles FAN_PERCENTILES of the magnitudes of errors (paths, times), shape (5, times); NaN of failed paths is
    left out."""
    return np.nanpercentile(np.abs(errors), FAN_PERCENTILES, axis=0)


def quantile_with_interval(samples: np.ndarray, probability: float) -> tuple[float, float, float]:
    """Quantile of values (n,), some of which may be infinite, and the ends of the quantile's 95 % interval.

    Order statistics, so no law is assumed; the ranks of the interval by the normal limit of the binomial. Raises
    InputError without a value, for one that is no number, and for a probability that is not between 0 and 1.
    """
    if not len(samples) or np.isnan(samples).any():
        raise InputError("", "values", None, "must be numbers, one or more; infinite ones are allowed")
    ordered = np.sort(samples)
    middle, low, high = (float(ordered[rank]) for rank in quantile_ranks(len(samples), probability))
    return middle, low, high


def quantile_ranks(value_count: int, probability: float) -> tuple[int, int, int]:
    """Ranks, from 0, of a quantile of ``value_count`` values and of the ends of its 95 % interval; InputError for a
    probability that is not between 0 and 1."""
    if not 0.0 < probability < 1.0:
        raise InputError("", "level", probability, "must be between 0 and 1")
    half = STANDARD_ERRORS_95 * math.sqrt(value_count * probability * (1 - probability))
    unrounded_ranks = (
        value_count * probability,
        math.floor(value_count * probability - half),
        value_count * probability + half,
    )
    middle, low, high = (min(max(math.ceil(rank) - 1, 0), value_count - 1) for rank in unrounded_ranks)
    return middle, low, high
