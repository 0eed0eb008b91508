"""Statistics judged as statistics: rows that pass inside a band that the law itself leaves with a stated chance."""

from scipy.stats import chi2

from validation.common.rows import Observed, Row

CONFIDENCE_LEVEL = 0.999
"""Chance that a true law passes; the seeds are fixed, so a row either always passes or never does."""


def mean_square(observed: Observed, expected: float, freedom: int, tolerance_reason: str) -> Row:
    """Row for a mean square of ``freedom`` independent normal values with the variance ``expected``, by the chi-square
    distribution.

    freedom times value by expected is chi-square with that many degrees of freedom; the row passes inside the
    central band of CONFIDENCE_LEVEL, and says how wide that is.
    """
    low, high = (
        float(chi2.ppf(probability, freedom)) / freedom
        for probability in ((1 - CONFIDENCE_LEVEL) / 2, (1 + CONFIDENCE_LEVEL) / 2)
    )
    note = (
        f"{tolerance_reason}; {100 * CONFIDENCE_LEVEL:g} % band of {freedom:,} degrees of freedom: {low:.4f} to "
        f"{high:.4f} times the law"
    )
    middle, half = expected * (low + high) / 2, expected * (high - low) / 2
    return observed.within(middle, half, note, "closed form")
