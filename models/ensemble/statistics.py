"""Statistics of an ensemble with their own errors."""

import math

import numpy as np

from models.core.errors import InputError

FEWEST = 3
ERRORS_95 = 1.959964
"""Standard errors on either side of a 95 % interval."""
FAN = (5, 25, 50, 75, 95)
"""Percentiles of a figure."""


def deviation(values: np.ndarray) -> tuple[float, float]:
    """Standard deviation of values (n,) and its standard error, for any law of finite fourth moment.

    By Var(s^2) = (mu4 - sigma^4) / n to first order; 1/sqrt(2 n) of it for a normal law. Not a number if any
    value is none. Raises InputError for fewer than ``FEWEST`` values, of which two have an error of 0 by this.
    """
    if len(values) < FEWEST:
        raise InputError("", "values", len(values), f"a standard deviation and its error need {FEWEST} values or more")
    centred = values - values.mean()
    second, fourth = np.mean(centred**2), np.mean(centred**4)
    spread = math.sqrt(second * len(values) / (len(values) - 1))
    if spread == 0.0:
        return 0.0, 0.0
    return spread, math.sqrt(max(fourth - second**2, 0.0) / len(values)) / (2 * math.sqrt(second))


def percentiles(errors: np.ndarray) -> np.ndarray:
    """Percentiles FAN of the magnitude of errors (paths, times), shape (5, times); failed paths are left out."""
    return np.nanpercentile(np.abs(errors), FAN, axis=0)


def quantile(values: np.ndarray, level: float) -> tuple[float, float, float]:
    """Quantile of values (n,), some of which may be infinite, and the ends of its 95 % interval.

    Order statistics, so no law is assumed; the ranks of the interval by the normal limit of the binomial. Raises
    InputError without a value, for one that is no number, and for a level that is not between 0 and 1.
    """
    if not len(values) or np.isnan(values).any():
        raise InputError("", "values", None, "must be numbers, one or more; infinite ones are allowed")
    if not 0.0 < level < 1.0:
        raise InputError("", "level", level, "must be between 0 and 1")
    ordered, count = np.sort(values), len(values)
    half = ERRORS_95 * math.sqrt(count * level * (1 - level))
    ranks = (math.ceil(count * level) - 1, math.floor(count * level - half) - 1, math.ceil(count * level + half) - 1)
    quantiles = [float(ordered[min(max(rank, 0), count - 1)]) for rank in ranks]
    return quantiles[0], quantiles[1], quantiles[2]
