"""Covariances of the point mass: beside printed figures, beside plain sums, and where they do not hold."""

import numpy as np
import pytest

from models.drift.point_mass import continuous_covariance, euler_covariance, monte_carlo_errors
from validation.cases.point_mass import measure


def test_every_row_of_the_case_passes(tmp_path):
    rows, _ = measure(True, tmp_path)
    assert [row.id for row in rows if row.status in ("failed", "not run")] == []


def test_without_damping_the_covariances_are_the_printed_polynomials():
    # eq. (8) with s^2 = 3^2 0.5 / 2^2 and t = 4; the scheme after 8 steps by its own sums of i and i^2
    assert continuous_covariance(4.0, 3.0, 0.5, 2.0) == pytest.approx(
        1.125 * np.array([[64 / 3, 8], [8, 4]]), rel=1e-15
    )
    kick = (3.0 * 0.5 / 2.0) ** 2
    assert euler_covariance(8, 3.0, 0.5, 2.0) == pytest.approx(
        kick * np.array([[0.25 * 140, 0.5 * 28], [14, 8]]), rel=1e-15
    )


@pytest.mark.parametrize("h", [1e-9, 0.02, 0.1, 0.5, 1.0, 1.7, 1.999])
def test_discrete_covariance_is_a_sum_of_squares(h):
    """Each kick lives on as r^i in the velocity and as the sum of that in the position; a sum of positive terms."""
    n, step = 40, 0.25
    velocity = (1 - h) ** np.arange(n)
    position = step * np.concatenate([[0.0], np.cumsum(velocity)[:-1]])
    found = euler_covariance(n, 2.0, step, 4.0, h / step)
    truth = (2.0 * step / 4.0) ** 2 * np.array(
        [[position @ position, position @ velocity], [position @ velocity, velocity @ velocity]]
    )
    assert found == pytest.approx(truth, rel=1e-11)  # the plain sum of 40 terms of alternating sign loses some digits


@pytest.mark.parametrize("x", [1e-12, 0.9999999, 1.0000001])
def test_series_and_closed_form_meet(x):
    """Both sides of the switch: a jump there would be a wrong coefficient."""
    low, high = continuous_covariance(x, 1.0, 1.0, 1.0, 1.0), continuous_covariance(x * (1 + 1e-9), 1.0, 1.0, 1.0, 1.0)
    assert high == pytest.approx(low, rel=4e-9, abs=0.0)  # t^3 times 1 + 1e-9


def test_paths_follow_the_scheme():
    """One path, step by step."""
    x = v = 0.0
    from models.core.noise import normal_samples

    for kick in normal_samples(3, 0, 5, 1)[:, 0]:
        x, v = x + 0.5 * v, v + 0.5 * (3.0 * kick / 2.0 - 0.4 * v)
    assert monte_carlo_errors(1, 5, 3.0, 0.5, 2.0, 0.4, seed=3)[0] == pytest.approx([x, v], rel=1e-14)


def test_what_is_no_point_mass_is_refused():
    for own in (
        {"mass": 0.0},
        {"damping_rate": -1.0},
        {"force_deviation": -1.0},
        {"time_step": 0.0},
        {"damping_rate": np.nan},
    ):
        values = {"force_deviation": 1.0, "time_step": 0.1, **own}
        with pytest.raises(ValueError, match="point mass: none"):
            continuous_covariance(1.0, **values)
    with pytest.raises(ValueError, match="unstable"):
        euler_covariance(5, 1.0, 0.1, 1.0, 20.0)
    assert not euler_covariance(0, 1.0, 0.1).any() and not continuous_covariance(0.0, 1.0, 0.1).any()
