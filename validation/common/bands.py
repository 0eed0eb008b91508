"""Report rows for random quantities, which pass inside a confidence band of a stated probability."""

from scipy.stats import chi2

from validation.common.rows import Observed, Row

CONFIDENCE_LEVEL = 0.999
"""Probability that a row passes if the expected value is right. Seeds are fixed, so that a row always passes or always
fails."""


def mean_square(observed: Observed, expected_variance: float, degrees_of_freedom: int, tolerance_reason: str) -> Row:
    """Row for a mean square of ``degrees_of_freedom`` independent normal values with the variance
    ``expected_variance``, by the chi-square distribution.

    degrees_of_freedom times value divided by expected is chi-square distributed; the row passes inside the central band
    of CONFIDENCE_LEVEL, and states the band.
    """
    low, high = (
        float(chi2.ppf(probability, degrees_of_freedom)) / degrees_of_freedom
        for probability in ((1 - CONFIDENCE_LEVEL) / 2, (1 + CONFIDENCE_LEVEL) / 2)
    )
    note = (
        f"{tolerance_reason}; {100 * CONFIDENCE_LEVEL:g} % band of {degrees_of_freedom:,} degrees of freedom: "
        f"{low:.4f} to {high:.4f} times the law"
    )
    middle, half = expected_variance * (low + high) / 2, expected_variance * (high - low) / 2
    return observed.within(middle, half, note, "closed form")
