"""Statistics of values that arrive block by block, with memory that does not grow with their number.

Means and central moments are merged as in P. Pebay, Formulas for robust, one-pass parallel computation of covariances
and arbitrary-order statistical moments, SAND2008-6212 (2008), eqs. 1.1, 3.1 to 3.3. Quantiles of values on a grid are
exact; those of other values are known to a stated share, by bins of a geometric width: C. Masson, J. E. Rim, H. K. Lee,
DDSketch, PVLDB 12 (2019), section 2.1. Blocks that come in the same order give the same bits.
"""

from collections import Counter

import numpy as np

from models.ensemble.statistics import deviation_from_moments, quantile_ranks

QUANTILE_ACCURACY = 0.005
"""Largest relative error of a quantile by ``MagnitudeQuantiles``."""
SMALLEST_MAGNITUDE, LARGEST_MAGNITUDE = 1e-15, 1e9
"""Magnitudes between which ``MagnitudeQuantiles`` distinguishes values; smaller ones count as 0."""


class StreamedMoments:
    """Count, mean (k,), and sums of the second to fourth powers of deviations from the mean, for values (n, k) that
    arrive in batches."""

    def __init__(self) -> None:
        self.count = 0
        self.mean = self.second = self.third = self.fourth = np.zeros(())

    def add(self, samples: np.ndarray) -> None:
        """Include a batch of values (n, ...) in the moments."""
        n, m, total = self.count, len(samples), self.count + len(samples)
        mean = samples.mean(axis=0)
        second, third, fourth = (((samples - mean) ** power).sum(axis=0) for power in (2, 3, 4))
        d = mean - self.mean
        self.fourth = (
            self.fourth
            + fourth
            + d**4 * n * m * (n * n - n * m + m * m) / total**3
            + 6.0 * d**2 * (n * n * second + m * m * self.second) / total**2
            + 4.0 * d * (n * third - m * self.third) / total
        )
        self.third = (
            self.third + third + d**3 * n * m * (n - m) / total**2 + 3.0 * d * (n * second - m * self.second) / total
        )
        self.second = self.second + second + d**2 * n * m / total
        self.mean, self.count = self.mean + d * m / total, total

    def deviation(self, *array_index: int) -> tuple[float, float]:
        """Standard deviation of the values at an array index, and its standard error, as by
        ``statistics.deviation_with_error``."""
        return deviation_from_moments(
            self.count, float(self.second[array_index]) / self.count, float(self.fourth[array_index]) / self.count
        )


class StreamedCovariance:
    """Mean (..., p) and covariance (..., p, p) of values (n, ..., p) that arrive in batches."""

    def __init__(self) -> None:
        self.count, self.mean, self._sums = 0, np.zeros(()), np.zeros(())

    def add(self, samples: np.ndarray) -> None:
        """Include a batch of values (n, ..., p) in mean and covariance."""
        n, m, total = self.count, len(samples), self.count + len(samples)
        mean = samples.mean(axis=0)
        deviations, d = samples - mean, mean - self.mean
        mean_shift = d[..., :, None] * d[..., None, :] * (n * m / total)
        self._sums = self._sums + np.einsum("n...i,n...j->...ij", deviations, deviations) + mean_shift
        self.mean, self.count = self.mean + d * m / total, total

    @property
    def covariance(self) -> np.ndarray:
        """Sample covariance: sums of products of deviations divided by the count less one."""
        return self._sums / max(self.count - 1, 1)


class ValueCounts:
    """Numbers of occurrences of distinct values, which should lie on a grid, so that few of them differ. No value may
    be NaN."""

    def __init__(self) -> None:
        self._counts: Counter[float] = Counter()

    def add(self, samples: np.ndarray) -> None:
        """Count a batch of values (n,), some of which may be infinite."""
        distinct_values, counts = np.unique(samples, return_counts=True)
        self._counts.update(dict(zip(distinct_values.tolist(), counts.tolist(), strict=True)))

    @property
    def values(self) -> np.ndarray:
        """The distinct values (m,), ascending."""
        return np.array(sorted(self._counts))

    @property
    def counts(self) -> np.ndarray:
        """Number of occurrences (m,) of each of the distinct values."""
        return np.array([self._counts[value] for value in sorted(self._counts)])

    def quantile(self, probability: float) -> tuple[float, float, float]:
        """Quantile of all counted values and the ends of its 95 % interval, identical to
        ``statistics.quantile_with_interval``."""
        upto = np.cumsum(self.counts)
        ranks = np.searchsorted(upto, np.array(quantile_ranks(int(upto[-1]), probability)), side="right")
        quantile, low, high = (float(self.values[rank]) for rank in ranks)
        return quantile, low, high


class MagnitudeQuantiles:
    """Quantiles of the magnitudes of values (n, k) that arrive in batches, each within QUANTILE_ACCURACY of the exact
    quantile; NaN is ignored."""

    def __init__(self) -> None:
        self._width = np.log1p(2.0 * QUANTILE_ACCURACY / (1.0 - QUANTILE_ACCURACY))
        self._bins = int(np.ceil(np.log(LARGEST_MAGNITUDE / SMALLEST_MAGNITUDE) / self._width)) + 2
        self._counts = np.zeros((0, self._bins), dtype=np.int64)

    def add(self, samples: np.ndarray) -> None:
        """Count a batch of values (n, k)."""
        columns = samples.shape[1]
        if not len(self._counts):
            self._counts = np.zeros((columns, self._bins), dtype=np.int64)
        sizes = np.clip(np.abs(samples), 0.0, LARGEST_MAGNITUDE)
        with np.errstate(divide="ignore"):
            bin_numbers = np.ceil(np.log(sizes / SMALLEST_MAGNITUDE) / self._width)
        bin_numbers = np.clip(np.nan_to_num(bin_numbers, nan=0.0, neginf=0.0), 0, self._bins - 1).astype(np.int64)
        known = ~np.isnan(samples)
        cells = (np.arange(columns) * self._bins + bin_numbers)[known]
        self._counts += np.bincount(cells, minlength=self._counts.size).reshape(self._counts.shape)

    def percentiles(self, percentages: tuple[float, ...]) -> np.ndarray:
        """Percentiles (percentages, k) of the magnitudes; NaN where a column has no values."""
        upto = self._counts.cumsum(axis=1)
        wanted = np.array(percentages)[:, None] / 100.0 * (upto[:, -1] - 1)
        bin_numbers = (upto[None] <= np.floor(wanted)[:, :, None]).sum(axis=2)
        middle = SMALLEST_MAGNITUDE * np.exp(self._width * bin_numbers) * (1.0 - QUANTILE_ACCURACY)
        return np.where(upto[:, -1] > 0, np.where(bin_numbers == 0, 0.0, middle), np.nan)
