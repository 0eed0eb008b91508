"""Roads under two tracks: levels, signs, cases, isotropy by hand, measured tracks, refusals."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import csd

from models.core.errors import InputError
from models.road.fitted import fit_road
from models.road.iso8608 import DENSITY_OF_CLASS, level_of_class
from models.road.isotropic import DensityTerm, IsotropicRoad
from models.road.measured_tracks import MeasuredTracks, read_tracks, track_spectra
from models.road.shape_filter import ShapeFilter
from models.road.two_track import (
    CORRELATION_CASES,
    FRONT_REAR,
    TRACK_CORRELATIONS,
    TwoTrackRoad,
    half_track,
    input_covariance,
    road_excitation,
    road_of_level,
    wheels_on_track,
)
from models.vehicles.linear_vehicle import WheelPosition
from validation.cases.ride_road import ASYMMETRIC_WHEEL_POSITIONS, measure, wheel_heights_covariance

ROAD = TwoTrackRoad(ShapeFilter(0.3, 5e-5), ShapeFilter(1.5, 8e-5))


def test_every_row_of_the_case_passes(tmp_path):
    rows, _ = measure(True, tmp_path)
    assert [row.id for row in rows if row.status in ("failed", "not run")] == []


@pytest.mark.grounds("closed form")
def test_a_positive_roll_lifts_the_left_wheels_and_each_has_its_own_arm():
    road = road_excitation(ROAD, ASYMMETRIC_WHEEL_POSITIONS)
    heights = sum(road.heights) @ np.array([0.0, 1.0])  # z_M = 0, theta = 1 rad: about x forward, left goes up
    assert heights.tolist() == [wheel.y for wheel in ASYMMETRIC_WHEEL_POSITIONS]
    assert road.lengths == pytest.approx((0.0, 2.6, 3.9))
    for axle, rows in enumerate(road.heights):
        assert [bool(row.any()) for row in rows] == [wheel.axle == axle for wheel in ASYMMETRIC_WHEEL_POSITIONS]


def test_equal_tracks_are_those_of_the_left():
    heights = sum(road_excitation(ROAD, ASYMMETRIC_WHEEL_POSITIONS, "equal").heights) @ np.array([0.0, 1.0])
    assert heights.tolist() == [abs(wheel.y) for wheel in ASYMMETRIC_WHEEL_POSITIONS]


@pytest.mark.parametrize("case", list(itertools.product(TRACK_CORRELATIONS, FRONT_REAR)))
def test_delayed_noise_gives_the_delayed_output(case):
    """Also the pairs that are none of the paper's five."""
    by_noise, by_output = (
        f(*x)
        for f, x in (
            (wheel_heights_covariance, (road_excitation(ROAD, ASYMMETRIC_WHEEL_POSITIONS, *case),)),
            (input_covariance, (ROAD, ASYMMETRIC_WHEEL_POSITIONS, *case)),
        )
    )
    assert np.abs(by_noise - by_output).max() < 1e-13 * np.abs(by_output).max()  # rounding


def test_cases_differ_only_where_they_should():
    case = {
        number: input_covariance(ROAD, ASYMMETRIC_WHEEL_POSITIONS, *words)
        for number, words in CORRELATION_CASES.items()
    }
    assert all(np.diag(P) == pytest.approx(np.diag(case[3]), rel=1e-15) for P in case.values())
    assert case[1][0, 2] == 0 and case[4][0, 1] == 0 and case[4][0, 2] == case[3][0, 2] == case[5][0, 2]
    assert case[3][0, 1] == pytest.approx(5e-5 / 0.6 - 0.7 * 0.6 * 8e-5 / 3.0, rel=1e-14)  # q1/2O1 - b1 b2 q2/2O2
    assert case[5][0, 1] == pytest.approx(5e-5 / 0.6 + 0.7 * 0.6 * 8e-5 / 3.0, rel=1e-14)


def test_a_cutoff_makes_the_road_differentiable():
    """No white noise in the rate: H G = 0; and the rate's variance is finite, that of the spectrum times Omega^2."""
    f = ShapeFilter(0.3, 5e-5, 40.0)
    _, G, H = f.matrices()
    assert (H @ G)[0, 0] == 0.0 and (ShapeFilter(0.3, 5e-5).matrices()[2] @ ShapeFilter(0.3, 5e-5).matrices()[1])[0, 0]
    by_spectrum = 2 * quad(lambda k: float(k**2 * f.spectrum(k)), 0, np.inf)[0]
    step = 1e-4  # m: minus the second derivative of the covariance at 0, by a difference exact to step times cutoff
    by_covariance = 2 * float(-np.diff(f.covariance(np.array([0.0, step])))[0]) / step**2
    assert by_covariance == pytest.approx(by_spectrum, rel=0.01)


@pytest.mark.grounds("closed form")
def test_a_quarter_car_meets_a_track_and_not_the_mean():
    road, centre = road_of_level(0.8), (WheelPosition("one", 0.0, 0.0, 0),)
    assert half_track(centre) == 0.0
    on_a_track = input_covariance(road, wheels_on_track(centre, 0.8))[0, 0]
    assert on_a_track == pytest.approx(np.pi * 1.6e-5 / 2 * (1 / 0.3 + 1 / 1.5), rel=1e-14)  # the paper's track
    assert input_covariance(road, centre)[0, 0] == pytest.approx(np.pi * 1.6e-5 / 2 / 0.3, rel=1e-14)


def test_a_class_keeps_its_variance_when_its_density_changes_sides():
    """One-sided over waves per metre and two-sided over rad/m: the same band has the same variance."""
    low, high = 0.05, 2.0
    one_sided = DENSITY_OF_CLASS["C"] * 0.1**2 * (1 / low - 1 / high)
    two_sided = 2 * level_of_class("C") * (1 / low - 1 / high) / (2 * np.pi)
    assert two_sided == pytest.approx(one_sided, rel=1e-14)
    assert "1.99 times the mean of ISO 8608 class C, one-sided" in road_of_level(0.7).label(0.7)


@pytest.mark.grounds("closed form")
def test_isotropic_coherency_by_hand():
    """x K1(x) at x = 1 and 2 (Abramowitz and Stegun, Table 9.8: K1 = 0.6019072302, 0.1398658818)."""
    road = IsotropicRoad((DensityTerm(1e-5),))
    assert road.coherency(np.array([1.0, 2.0]), 1.0) == pytest.approx([0.6019072302, 2 * 0.1398658818], rel=1e-9)
    assert road.coherency(np.array([1e-6, 1.0]), 0.0).tolist() == [1.0, 1.0]


@pytest.mark.grounds("closed form")
def test_mean_and_roll_spectra_are_those_of_the_processes():
    left, right = np.random.default_rng(3).standard_normal((2, 400)).cumsum(axis=1)
    found = track_spectra(MeasuredTracks(left, right, 0.1, 0.7, "walk"))
    mean, roll = (left + right) / 2, (left - right) / 1.4
    size = 2 * round(np.pi / (found.wavenumber[0] * 0.1))  # the window that was taken, in stations
    for own, pair in ((found.mean, (mean, mean)), (found.roll, (roll, roll)), (found.mean_roll, (mean, roll))):
        direct = csd(*pair, 10.0, "hann", size, size // 2, detrend="linear")[1][1 : len(own) + 1] / (4 * np.pi)
        assert np.abs(own - direct).max() < 1e-12 * np.abs(direct).max()


def test_measured_tracks_are_heights_up_and_keep_their_sides(tmp_path):
    s = np.arange(200) * 0.1
    left, right = np.sin(s), 0.5 * np.cos(3 * s)
    rows = "\n".join(f"{a:.17g}, {b:.17g}, {c:.17g}" for a, b, c in zip(s, left, right, strict=True))
    (tmp_path / "road.csv").write_text("s [m], left [m], right [m]\n" + rows + "\n")
    tracks = read_tracks(tmp_path / "road.csv", 1.4, first_station=1.0, last_station=10.0)
    assert np.abs(tracks.left - left[10:101]).max() < 1e-12 and np.abs(tracks.right - right[10:101]).max() < 1e-12
    assert tracks.half_track == 0.7 and tracks.length == pytest.approx(9.0)


def test_what_a_road_cannot_tell_is_said():
    walk = np.random.default_rng(4).standard_normal(2000).cumsum() * 1e-3
    same = fit_road(MeasuredTracks(walk, walk, 0.1, 0.7, "same"))
    assert same.roll is None and same.road.roll.intensity == 0.0
    assert any("same heights" in note for note in same.notes)
    assert not same.mean.corner_is_resolved and any(
        "corner of the mean process is not told" in note for note in same.notes
    )
    assert same.mean.filter.intensity == pytest.approx(1e-6 / 0.1, rel=0.3)  # steps of 1 mm every 0.1 m; 20 waves


WRONG = {
    "word": (lambda: road_excitation(ROAD, ASYMMETRIC_WHEEL_POSITIONS, "modeled"), "did you mean 'modelled'"),
    "order": (
        lambda: road_excitation(ROAD, (ASYMMETRIC_WHEEL_POSITIONS[0], WheelPosition("r", 2.0, 0.7, 1))),
        "must not lie before axle 0",
    ),
    "one axle, two places": (
        lambda: road_excitation(ROAD, (ASYMMETRIC_WHEEL_POSITIONS[0], WheelPosition("r", 1.0, -0.7, 0))),
        "must stand at one x",
    ),
    "gap": (
        lambda: road_excitation(ROAD, (ASYMMETRIC_WHEEL_POSITIONS[0], ASYMMETRIC_WHEEL_POSITIONS[4])),
        "must be numbered 0, 1",
    ),
    "neither side": (
        lambda: road_excitation(ROAD, (*ASYMMETRIC_WHEEL_POSITIONS, WheelPosition("m", -2.7, 0.0, 2)), "uncorrelated"),
        "neither left",
    ),
    "cutoff": (lambda: ShapeFilter(0.3, 1e-5, 0.2), "above the corner"),
    "corner": (lambda: ShapeFilter(-0.3, 1e-5), "0 or more"),
    "track": (lambda: road_of_level(0.0), "half_track"),
    "waviness": (lambda: DensityTerm(1e-5, 0.1, 1.0), "above 1"),
    "short": (lambda: track_spectra(MeasuredTracks(np.zeros(30), np.zeros(30), 0.1, 0.7, "x")), "two windows or more"),
    "flat": (lambda: fit_road(MeasuredTracks(np.zeros(3000), np.zeros(3000), 0.1, 0.7, "x")), "there is no road"),
    "class": (lambda: level_of_class("I"), "class of ISO 8608"),
    "file": (lambda: read_tracks("road.txt"), "OpenCRG"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_roads_are_refused_in_words(name):
    build, said = WRONG[name]
    with pytest.raises(InputError, match=said):
        build()
