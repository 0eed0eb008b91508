"""Measures of ride from standard deviations: how often a travel exceeds its limit, how much a wheel load varies about
its mean.

All for Gaussian processes of zero mean, which the linear vehicle makes of a Gaussian road. Deviations and limits below
0, and what is not finite, are refused (InputError).
"""

import math

from models.core.errors import InputError


def time_share_beyond(standard_deviation: float, threshold: float) -> float:
    """Share of time for which abs(x) exceeds a threshold, from the standard deviation of a Gaussian x; both in the unit
    of x."""
    _check_value(deviation=standard_deviation, limit=threshold)
    return 0.0 if standard_deviation == 0.0 else math.erfc(threshold / (math.sqrt(2.0) * standard_deviation))


def exceedance_rate(standard_deviation: float, rate_deviation: float, threshold: float) -> float:
    """Number of times per second that abs(x) exceeds a threshold, from the standard deviations of x and of its rate x'
    (per s).

    Rice's formula, both sides together: (sd x' / sd x) exp(-threshold^2 / (2 sd^2)) / pi.
    """
    _check_value(deviation=standard_deviation, rate_deviation=rate_deviation, limit=threshold)
    if standard_deviation == 0.0:
        return 0.0
    return rate_deviation / (math.pi * standard_deviation) * math.exp(-((threshold / standard_deviation) ** 2) / 2.0)


def dynamic_load_factor(standard_deviation: float, static_load: float) -> float:
    """Ratio of the standard deviation of a wheel's load to its static load (both N): at 0.33 the tyre begins to lift
    off.

    At three standard deviations the load is then gone, which a linear vehicle does not notice.
    """
    _check_value(deviation=standard_deviation)
    if not 0.0 < static_load < math.inf:
        raise InputError("", "static", static_load, "must be a wheel's load above 0, in N")
    return standard_deviation / static_load


def _check_value(**named_values: float) -> None:
    """Raise InputError for a negative value or one that is not a number."""
    for name, value in named_values.items():
        if not 0.0 <= value < math.inf:
            raise InputError("", name, value, "must be 0 or more, and finite")
