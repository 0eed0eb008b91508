"""Statistics as a stream: those of all values at once, in any cut of the blocks, in memory that does not grow."""

import tracemalloc

import numpy as np
import pytest

from models.core.noise import normal_samples
from models.ensemble.runner import PathBlocks, arrays_by_block
from models.ensemble.statistics import FAN_PERCENTILES, deviation_with_error, percentiles, quantile_with_interval
from models.ensemble.streamed import (
    QUANTILE_ACCURACY,
    MagnitudeQuantiles,
    StreamedCovariance,
    StreamedMoments,
    ValueCounts,
)

VALUES = normal_samples(11, 0, 3000 * 4, 1).reshape(1000, 3, 4) * [1.0, 1e3, 1e-6, 1.0] + [0.0, 5e3, 1.0, 1e4]


def streamed(kind, values, cuts):
    statistic = kind()
    for block in np.split(values, cuts):
        statistic.add(block)
    return statistic


@pytest.mark.parametrize("cuts", [[], [1, 10, 700], list(range(50, 1000, 50))], ids=len)
def test_moments_and_covariances_are_those_of_all_values(cuts):
    """To rounding of sums about a mean that lies up to 1e6 deviations away: 1e6 eps of a deviation, 1e-10."""
    moments, both = (streamed(kind, VALUES, cuts) for kind in (StreamedMoments, StreamedCovariance))
    for place in np.ndindex(3, 4):
        assert moments.deviation(*place) == pytest.approx(deviation_with_error(VALUES[:, *place]), rel=1e-9)
    for row in range(3):
        expected = np.cov(VALUES[:, row].T)
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.abs(both.covariance[row] - expected).max() < 1e-9 * scale.max()
    assert both.mean == pytest.approx(VALUES.mean(axis=0), rel=1e-13)


def test_a_correction_that_is_left_out_is_seen():
    class Faulty(StreamedMoments):
        def add(self, values):
            before = self.second
            super().add(values)
            self.second = before + ((values - values.mean(axis=0)) ** 2).sum(axis=0)  # no term of the two means

    faulty = streamed(Faulty, VALUES, [1, 10, 700])
    assert faulty.deviation(0, 0) != pytest.approx(deviation_with_error(VALUES[:, 0, 0]), rel=1e-4)


@pytest.mark.parametrize("level", [0.05, 0.5, 0.95])
def test_quantiles_of_a_grid_are_exact_with_their_intervals(level):
    times = np.round(np.abs(VALUES[:, 0, 0]), 2)
    times[::7] = np.inf
    assert streamed(ValueCounts, times, [3, 500]).quantile(level) == quantile_with_interval(times, level)


def test_percentiles_are_within_the_stated_share():
    """Of the value of the rank; numpy's lies between two ranks, which here are at most 2 % apart in the middle."""
    errors = VALUES[:, :, 0].copy()
    errors[::10, 1], errors[:, 2] = np.nan, 0.0
    spread = streamed(MagnitudeQuantiles, errors, [1, 400]).percentiles(FAN_PERCENTILES)
    for i, level in enumerate(FAN_PERCENTILES):
        for k in (0, 1):
            lower = np.nanpercentile(np.abs(errors[:, k]), level, method="lower")
            assert spread[i, k] == pytest.approx(lower, rel=1.001 * QUANTILE_ACCURACY)
    assert (spread[:, 2] == 0.0).all()
    assert spread[:, 0] == pytest.approx(percentiles(errors)[:, 0], rel=0.05)


class Paths:
    """A job whose blocks have 16 kB of states."""

    def __call__(self, paths):
        return {"states": np.array([np.full((2, 100), float(path)) for path in paths])}

    def facts(self):
        return {}


def peak(paths, folder):
    tracemalloc.start()
    moments = StreamedMoments()
    for block in arrays_by_block(Paths(), paths, folder, path_blocks=PathBlocks(10)):
        moments.add(block["states"])
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert moments.count == paths and moments.mean[0, 0] == pytest.approx((paths - 1) / 2, rel=1e-12)
    return most


def test_ten_times_the_paths_need_no_more_memory():
    """Within 10 %. Kept whole, 10,000 paths would be 16 MB."""
    peak(100, None)  # what is loaded once
    few, many = peak(1000, None), peak(10_000, None)
    assert many < 1.1 * few
