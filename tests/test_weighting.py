"""Weighted outputs: white noise through a weighting, several at once, delays kept, refusals."""

import numpy as np
import pytest
from scipy.integrate import quad

from models.core.errors import InputError
from models.ride.covariance import stationary_covariance
from models.ride.excited import DelayedSystem
from models.ride.weighting import HEALTH_FACTORS, WEIGHTINGS, system_with_weightings, total_value

DELAY = 0.13


def two_hits() -> DelayedSystem:
    """Outputs a = w(t) + w(t - DELAY), white itself, and b, which passes a pole at 5 1/s first."""
    B = (np.array([[5.0]]), np.array([[5.0]]))
    D = (np.array([[1.0], [0.0]]), np.array([[1.0], [0.0]]))
    return DelayedSystem(np.array([[-5.0]]), B, (0.0, DELAY), np.array([[0.0], [1.0]]), D, ("a", "b"))


def by_quadrature(name: str, pole: float) -> float:
    """Variance from |1 + exp(-i w DELAY)|^2 |pole/(pole + i w)|^2 |W|^2, over x = ln f."""

    def density(x: float) -> float:
        f = np.exp(x)
        w = 2 * np.pi * f
        passed = 1.0 / (1.0 + (w / pole) ** 2) if pole else 1.0
        return float((2 + 2 * np.cos(w * DELAY)) * passed * abs(WEIGHTINGS[name].response(f)) ** 2 * f)

    return 2 * quad(density, np.log(1e-4), np.log(1e4), limit=4000, epsrel=1e-10)[0]


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("name", ["Wk", "Wd"])
def test_white_noise_through_a_weighting_has_a_variance_and_the_right_one(name):
    found = stationary_covariance(system_with_weightings(two_hits(), {"a": name, "b": "We"}))
    assert found.names == ("a", "b", f"a {name}", "b We")
    assert found.status == ("infinite", "finite", "finite", "finite")
    assert found.variance[2] == pytest.approx(by_quadrature(name, 0.0), rel=1e-8)
    assert found.variance[3] == pytest.approx(by_quadrature("We", 5.0), rel=1e-8)


def test_what_was_there_stays_as_it_was():
    before, after = two_hits(), system_with_weightings(two_hits(), {"b": "Wk"})
    assert after.delays == before.delays and not after.independent
    assert (after.C[:2, :1] == before.C).all() and not after.C[:2, 1:].any()
    assert all((a[:2] == b).all() and not a[2:].any() for a, b in zip(after.D, before.D, strict=True))
    assert stationary_covariance(after).variance[1] == pytest.approx(
        stationary_covariance(before).variance[1], rel=1e-13
    )  # rounding
    assert system_with_weightings(before, {}) is before


@pytest.mark.grounds("closed form")
def test_band_limits_and_plateaus():
    """Far inside its band a weighting is what its transition says: Wd 1 at 1 Hz and 2/f above 2 Hz, Wk 12.5/f."""
    f = np.array([1.0, 25.0])
    assert np.abs(WEIGHTINGS["Wd"].response(f)) == pytest.approx([1.0, 2.0 / 25.0], rel=0.02)
    assert np.abs(WEIGHTINGS["We"].response(np.array([20.0]))) == pytest.approx([1.0 / 20.0], rel=0.02)
    assert np.abs(WEIGHTINGS["Wj"].response(np.array([0.02, 30.0]))) == pytest.approx([0.00125, 1.0], rel=0.02)


@pytest.mark.grounds("closed form")
def test_total_value_counts_the_axes():
    assert total_value({"x": 3.0, "y": 0.0, "z": 4.0}, {"x": 1, "y": 1, "z": 1}) == 5.0
    assert total_value({"x": 1.0, "y": 1.0}, HEALTH_FACTORS) == pytest.approx(1.4 * 2**0.5)


@pytest.mark.parametrize(("filters", "said"), [({"c": "Wk"}, "must be an output"), ({"a": "wk"}, "did you mean 'Wk'")])
def test_wrong_weightings_are_refused_in_words(filters, said):
    with pytest.raises(InputError, match=said):
        system_with_weightings(two_hits(), filters)
