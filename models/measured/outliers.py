"""Samples that stand far off those around them: spikes of a few samples, which a fit must not see."""

import numpy as np

MEDIAN_SAMPLES = 9
"""Samples of the running median; up to four that stand off together are seen."""
FAR_RATIO, USUAL_SHARE = 3.0, 0.99
"""Times the distance from the running median that 99 % of samples keep: 7.7 deviations of Gaussian noise."""


def without_outliers(values: np.ndarray) -> np.ndarray:
    """Values (n,) with NaN in place of those farther from the running median than noise explains; NaN stays NaN."""
    known = np.flatnonzero(np.isfinite(values))
    cleaned = values.astype(float, copy=True)
    if len(known) <= MEDIAN_SAMPLES:
        return cleaned
    from scipy.ndimage import median_filter

    distances = np.abs(values[known] - median_filter(values[known], MEDIAN_SAMPLES, mode="nearest"))
    usual = float(np.quantile(distances, USUAL_SHARE))
    if usual > 0.0:
        cleaned[known[distances > FAR_RATIO * usual]] = np.nan
    return cleaned
