"""Removal of spikes: a few successive samples far off the samples around them."""

import numpy as np

RUNNING_MEDIAN_SAMPLES = 9
"""Number of samples of the running median; up to four successive outliers are detected."""
FAR_RATIO, USUAL_OUTLIER_SHARE = 3.0, 0.99
"""Ratio of an outlier's distance from the running median to the distance that 99 % of the samples do not exceed: 7.7
deviations of Gaussian noise."""


def without_outliers(samples: np.ndarray) -> np.ndarray:
    """Values (n,) with NaN in place of those farther from the running median than noise explains; NaN stays NaN."""
    known = np.flatnonzero(np.isfinite(samples))
    cleaned = samples.astype(float, copy=True)
    if len(known) <= RUNNING_MEDIAN_SAMPLES:
        return cleaned
    from scipy.ndimage import median_filter

    distances = np.abs(samples[known] - median_filter(samples[known], RUNNING_MEDIAN_SAMPLES, mode="nearest"))
    usual = float(np.quantile(distances, USUAL_OUTLIER_SHARE))
    if usual > 0.0:
        cleaned[known[distances > FAR_RATIO * usual]] = np.nan
    return cleaned
