"""Profiles: closed forms, order of approximation, recurrence against direct evaluation, C2."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.core.errors import InputError
from models.road import SineProfile, SplineProfile, kernels
from models.road.iso8608 import DENSITY_OF_CLASS, iso8608_road, random_phases, rough_road
from models.road.polyline import polyline_through
from models.road.study import STUDY_GD, hills_road, study_road


def jumps(profile):
    """Largest jump of height, slope and curvature at the inner stations of a spline."""
    d = np.diff(profile.station)[:-1]
    a, b, c, e = profile.coefficients[:-1].T
    ends = np.array([((a * d + b) * d + c) * d + e, (3 * a * d + 2 * b) * d + c, 6 * a * d + 2 * b])
    starts = profile.coefficients[1:, [3, 2, 1]].T * np.array([[1.0], [1.0], [2.0]])
    return np.abs(ends - starts).max(axis=1)


def written_out(s, gd):
    """The study road once more, straight from its definition, in plain loops."""
    if s <= 0.0:
        return 0.0
    total = sum(amp * np.sin(2 * np.pi * s / length) for amp, length in [(1.2, 400.0), (0.6, 150.0), (0.2, 60.0)])
    ratio = (2.0 / 0.05) ** (1 / 60)
    for i in range(1, 61):
        low = 0.05 * ratio ** (i - 1)
        n, dn = low * ratio**0.5, low * (ratio - 1.0)
        total += np.sqrt(2 * gd * (n / 0.1) ** -2 * dn) * np.sin(2 * np.pi * (n * s + i * (5**0.5 - 1) / 2 % 1.0))
    x = min(s / 40.0, 1.0)
    return -(10 * x**3 - 15 * x**4 + 6 * x**5) * total


@pytest.mark.grounds("written equations")
@pytest.mark.parametrize("gd", [STUDY_GD, 6e-4])
def test_study_road_is_its_definition(gd):
    stations = [-2.0, 0.0, 0.3, 7.0, 39.9, 40.0, 41.0, 200.0, 1199.0]
    expected = [written_out(s, gd) for s in stations]
    height, _ = study_road(gd).height_and_slope(stations)
    # 63 terms of at most 1.2 m, phases rounded at up to 1.5e4 rad: 2e-12 rad times 2 cm is far below 1e-12
    np.testing.assert_allclose(height, expected, rtol=0.0, atol=1e-12)


def test_a_rise_is_negative():
    """The first hill rises: z is down, so its height is below 0 and so is its slope."""
    height, slope = hills_road().height_slope_at(30.0)
    assert height < -0.5
    assert slope < 0.0


def test_rough_level_of_the_study_road_is_a_density():
    rough, smooth = study_road(4 * STUDY_GD).amplitude, study_road(STUDY_GD).amplitude
    np.testing.assert_allclose(rough[:60], 2.0 * smooth[:60], rtol=1e-15)
    np.testing.assert_array_equal(rough[60:], smooth[60:])
    np.testing.assert_array_equal(study_road(0.0).height_and_slope(33.0)[0], hills_road().height_and_slope(33.0)[0])


@pytest.mark.parametrize("road", [study_road(), SplineProfile.through(np.arange(5.0), [0.0, 1.0, 0.5, -1.0, 2.0])])
def test_slopes_are_derivatives_of_heights(road):
    s, h = np.linspace(0.3, 3.7, 41), 1e-5
    difference = (road.height_and_slope(s + h)[0] - road.height_and_slope(s - h)[0]) / (2 * h)
    # central difference: third derivative <= 50 /m^2 times h^2 / 6 is 1e-9, rounding 1e-16 / 1e-5 is 1e-11
    np.testing.assert_allclose(road.height_and_slope(s)[1], difference, rtol=0.0, atol=2e-9)


def test_window_meets_the_flat_with_height_slope_and_curvature():
    """The quintic begins as s^3 and the hills as s, so the height near 0 grows as s^4."""
    height, slope = hills_road().height_and_slope([0.0, 1e-3, 1e-2])
    assert height[0] == slope[0] == 0.0
    assert height[2] / height[1] == pytest.approx(1e4, rel=1e-2)
    assert slope[2] / slope[1] == pytest.approx(1e3, rel=1e-2)


# Agreement of rotation and direct evaluation. Each of the 128 turns rounds by about 1.1e-16 in either
# part and the turn itself is rounded once, so 128 (1 + 1) 1.1e-16 = 3e-14 bounds a single wave; the sum of
# many waves gets 1e-14. Rounding of s and of the angle k s, common to both ways, adds 4 eps k s.
@settings(max_examples=60, deadline=None)
@given(
    start=st.floats(-50.0, 1500.0),
    step=st.floats(1e-4, 0.05),
    count=st.integers(0, 700),
    window=st.sampled_from([0.0, 40.0]),
)
def test_rotation_agrees_with_direct_evaluation(start, step, count, window):
    base = study_road()
    road = SineProfile(base.amplitude, base.wavenumber, base.phase, window)
    s = start + step * np.arange(count)
    fast, direct = road.sample_uniform(start, step, count), road.height_and_slope(s)
    farthest = np.abs(s).max(initial=1.0)
    for values, wanted, weight in zip(fast, direct, (base.amplitude, base.amplitude * base.wavenumber), strict=True):
        allowed = 1e-14 * weight.sum() + 4 * 2.2e-16 * farthest * (weight * base.wavenumber).sum()
        assert np.abs(values - wanted).max(initial=0.0) <= allowed


def test_rotation_is_within_1e_14_on_exact_stations():
    """Stations that are exact in binary leave the rotation's own error alone: the figure of the docstring."""
    road, step = study_road(), 2.0**-7
    fast, direct = road.sample_uniform(0.0, step, 2000), road.height_and_slope(step * np.arange(2000))
    assert np.abs(fast[0] - direct[0]).max() < 1e-14 * road.amplitude.sum()
    assert np.abs(fast[1] - direct[1]).max() < 2e-14 * (road.amplitude * road.wavenumber).sum()


def test_rotation_does_not_drift_along_the_road():
    """One wave whose angles are exact: 128 turns of 2.2e-16 each, over 20,000 samples; without the exact
    values in between the error would grow with the distance, to about 1e-12.
    """
    wave, step = SineProfile([1.0], [3.0], [0.0]), 2.0**-7
    fast, direct = wave.sample_uniform(0.0, step, 20_000), wave.height_and_slope(step * np.arange(20_000))
    assert np.abs(fast[0] - direct[0]).max() < 128 * 2.2e-16


def test_a_wrong_turn_would_be_seen():
    """Planted fault: a step wrong by 1e-12 of itself must break the comparison above."""
    road, step = study_road(), 2.0**-7
    direct = road.height_and_slope(step * np.arange(2000))[0]
    assert np.abs(road.sample_uniform(0.0, step * (1 + 1e-12), 2000)[0] - direct).max() > 1e-14 * road.amplitude.sum()


def test_one_wave_no_waves_and_standing_still():
    flat = SineProfile(np.zeros(0), np.zeros(0), np.zeros(0))
    np.testing.assert_array_equal(flat.sample_uniform(0.0, 0.1, 5), np.zeros((2, 5)))
    one = SineProfile([0.1], [2.0], [0.0])
    still = one.sample_uniform(1.0, 0.0, 300)
    np.testing.assert_allclose(still[0], -0.1 * np.sin(2.0), rtol=1e-15)
    np.testing.assert_allclose(one.sample_uniform(1.0, -0.25, 3)[0], -0.1 * np.sin([2.0, 1.5, 1.0]), rtol=1e-14)


@pytest.mark.parametrize("road", [study_road(), SplineProfile.through(np.arange(9.0), np.arange(9.0) ** 2 % 5)])
def test_all_ways_of_asking_agree(road):
    s = np.array([[0.5, 3.25], [7.0, 6.125]])
    height, slope = road.height_and_slope(s)
    assert height.shape == slope.shape == s.shape
    for i in np.ndindex(2, 2):
        assert road.height_slope_at(float(s[i])) == pytest.approx((height[i], slope[i]), rel=1e-15)
    uniform = road.sample_uniform(0.25, 0.5, 15)
    np.testing.assert_allclose(uniform, road.height_and_slope(0.25 + 0.5 * np.arange(15)), atol=1e-13)


def test_spline_is_c2_and_fourth_order_up_to_its_ends():
    worst = []
    for n in (80, 160):
        s = np.linspace(0.0, 10.0, n + 1)
        road = SplineProfile.through(s, np.sin(s))
        assert jumps(road).max() < 1e-12
        fine = np.linspace(0.0, 10.0, 2001)
        worst.append(np.abs(road.height_and_slope(fine)[0] - np.sin(fine)).max())
    # halving the distance of points tends to 2^4 = 16 (14 here) for not-a-knot ends, 2^2 = 4 for natural ones
    assert worst[0] / worst[1] > 12.0


@given(st.lists(st.floats(0.01, 3.0), min_size=4, max_size=40), st.floats(-1.0, 2.0))
@settings(max_examples=60, deadline=None)
def test_pieces_are_found_on_uneven_stations(gaps, place):
    station = np.cumsum(gaps)
    s = station[0] + (station[-1] - station[0]) * np.clip(place, 0.0, 1.0)
    expected = min(max(int(np.searchsorted(station, s, side="right")) - 1, 0), station.size - 2)
    for guess in range(station.size - 1):
        assert kernels.piece_index(station, s, guess) == expected


def test_a_polyline_passes_its_points_and_has_corners():
    road = SplineProfile.through([0.0, 1.0, 3.0, 4.0], [0.0, -1.0, 1.0, 0.0], "bumps")
    corners = polyline_through(road)
    np.testing.assert_allclose(corners.height_and_slope(road.station)[0], road.points[1], atol=1e-15)
    assert corners.height_slope_at(2.0) == (0.0, 1.0)
    # at a point the slope is that of the piece that follows
    assert [corners.height_slope_at(s)[1] for s in (0.0, 1.0, 3.0, 4.0)] == [-1.0, 1.0, -1.0, -1.0]
    assert jumps(corners)[1] == 2.0  # what a C2 test must catch: the slope goes from -1 to 1


@pytest.mark.parametrize("s", [-0.1, 4.1, np.nan])
def test_a_finite_road_is_never_left_in_silence(s):
    road = SplineProfile.through(np.arange(5.0), np.zeros(5), "track.csv")
    with pytest.raises(InputError, match=r"track\.csv: arc length .*0 m to 4 m"):
        road.height_and_slope([1.0, s])
    with pytest.raises(InputError):
        road.height_slope_at(s)
    with pytest.raises(InputError):
        road.sample_uniform(1.0, (s - 1.0) / 10, 11)
    assert road.height_slope_at(4.0 + 1e-12) == (0.0, 0.0)  # rounding of v t is not the end of the road


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SineProfile([1.0], [1.0, 2.0], [0.0]), "wavenumber"),
        (lambda: SineProfile([np.nan], [1.0], [0.0]), "amplitude"),
        (lambda: SineProfile([1.0], [1.0], [0.0], -1.0), "window_length"),
        (lambda: SineProfile([1.0], [1.0], [0.0]).sample_uniform(np.inf, 1.0, 3), "start"),
        (lambda: SplineProfile.through([0, 1, 2], [0, 0, 0]), "4 or more"),
        (lambda: SplineProfile.through([0, 1, 1, 2], [0, 0, 0, 0]), "station 2.*greater than 1"),
        (lambda: SplineProfile.through([0, 1, 3, 2], [0, 0, 0, 0]), "station 3"),
        (lambda: SplineProfile.through([0, 1, 2, 3], [0, 0, np.inf, 0]), "finite"),
        (lambda: polyline_through(([0, 1, 1], [0, 1, 2])), "station 2"),
        (lambda: study_road(-1.0), "gd"),
        (lambda: iso8608_road("I"), "'I'.*allowed: A, B"),
        (lambda: iso8608_road("a"), "must be a class"),
        (lambda: iso8608_road("A", level_convention="onesided"), "did you mean 'one-sided'"),
        (lambda: iso8608_road("A", -1), "seed"),
        (lambda: iso8608_road("A", n_min=2.0, n_max=1.0), "n_min"),
        (lambda: iso8608_road("A", waves=0), "waves"),
        (lambda: rough_road(np.nan, 0, 0.01, 1.0, 5), "gd"),
    ],
)
def test_what_is_not_a_road_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_profiles_cannot_be_changed():
    road = study_road()
    with pytest.raises(ValueError, match="read-only"):
        road.amplitude[0] = 1.0


@pytest.mark.grounds("published")
@pytest.mark.parametrize(("level", "factor"), [("one-sided", 1.0), ("two-sided", 2.0)])
def test_power_of_a_class_is_the_integral_of_its_density(level, factor):
    road = iso8608_road("C", 3, n_min=0.05, n_max=1.5, waves=40, level_convention=level)
    band = 256e-6 * 0.1**2 * (1 / 0.05 - 1 / 1.5) * factor  # class C: 256e-6 m^3, one-sided
    assert (road.amplitude**2).sum() / 2 == pytest.approx(band, rel=1e-13)  # exact bin by bin, see roughness
    # the same from samples: over 4 km the mean products of different waves are below 1 / (pi L dn) = 2 %
    heights, _ = road.sample_uniform(100.0, 0.1, 40_000)
    assert heights.var() == pytest.approx(band, rel=0.02)


def test_density_of_a_generated_road_follows_the_class_octave_by_octave():
    """Periodogram, one-sided as in the standard: sum |Z|^2 over an octave against the integral of Gd."""
    road, step, count = iso8608_road("E", 11, n_min=0.02, n_max=2.56, waves=140), 0.1, 60_000
    heights, _ = road.sample_uniform(100.0, step, count)
    taper = np.hanning(count)
    power = 2.0 * np.abs(np.fft.rfft(heights * taper)) ** 2 / (count * (taper**2).sum())
    n = np.fft.rfftfreq(count, step)
    for low in 0.02 * 2.0 ** np.arange(7):
        found = power[(n >= low) & (n < 2 * low)].sum()
        # bins of the road and of the octave share their edges; the taper spreads 1e-3 of the power over them
        assert found == pytest.approx(4096e-6 * 0.01 * (1 / low - 1 / (2 * low)), rel=0.02)


def test_classes_and_seeds():
    assert DENSITY_OF_CLASS["A"] == 16e-6
    assert DENSITY_OF_CLASS["H"] == pytest.approx(262144e-6)
    np.testing.assert_array_equal(iso8608_road("B", 5).phase, iso8608_road("B", 5).phase)
    assert np.all(iso8608_road("B", 5).phase != iso8608_road("B", 6).phase)
    phases = random_phases(0, 4000)
    assert 0.0 <= phases.min() < phases.max() < 2 * np.pi
    # mean of 4000 unit vectors: |mean|^2 * 4000 is exponential with mean 1; 14 has a chance of 1e-6
    assert abs(np.exp(1j * phases).mean()) ** 2 * 4000 < 14.0
