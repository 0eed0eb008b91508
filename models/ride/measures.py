"""What engineers read from variances: how often a travel runs out, how much a wheel load moves about its mean.

All for Gaussian processes of zero mean, which the linear vehicle makes of a Gaussian road.
"""

import math


def share_beyond(deviation: float, limit: float) -> float:
    """Share of time for which abs(x) > limit, from the standard deviation of x; the unit of both is that of x."""
    return 0.0 if deviation == 0.0 else math.erfc(limit / (math.sqrt(2.0) * deviation))


def exceedances(deviation: float, rate_deviation: float, limit: float) -> float:
    """How often per second abs(x) passes the limit outwards, from the deviations of x and of its rate x' (1/s).

    Rice's formula, both sides together: (sd x' / sd x) exp(-limit^2 / (2 sd^2)) / pi.
    """
    if deviation == 0.0:
        return 0.0
    return rate_deviation / (math.pi * deviation) * math.exp(-((limit / deviation) ** 2) / 2.0)


def dynamic_load_factor(deviation: float, static: float) -> float:
    """Standard deviation of a wheel's load by its static load (both N): 0.33 is where a tyre begins to lift off.

    At three standard deviations the load is then gone, which a linear vehicle does not notice.
    """
    return deviation / static
