"""Where a measured road begins and ends: height, slope and curvature stay continuous."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.road import SplineProfile
from models.road.continuation import continued_road, reference_height, road_with_run_in
from models.road.polyline import PolylineProfile, polyline_through
from models.road.study import study_road

STATION = np.cumsum(np.random.default_rng(3).uniform(0.1, 0.4, 61)) + 2.0
HEIGHT = np.random.default_rng(4).normal(size=61) * 0.02 - 200.0  # zeta is down: 200 m above the sea
ROAD = SplineProfile.through(STATION, HEIGHT, "survey.csv")


def jumps_at(profile, s, h=1e-4):
    """Jumps of height, slope and curvature at ``s``; curvature by one-sided differences of slopes, O(h^2)."""
    offsets = h * np.array([0.0, 1.0, 2.0])
    nudge = 1e-9  # stay on one's own side of a corner
    right = profile.height_and_slope(s + nudge + offsets)
    left = profile.height_and_slope(s - nudge - offsets)
    curvatures = [(-3 * g[0] + 4 * g[1] - g[2]) / (2 * h) for g in (right[1], left[1])]
    return abs(right[0][0] - left[0][0]), abs(right[1][0] - left[1][0]), abs(curvatures[0] + curvatures[1])


def assert_c2(profile, s):
    """Heights of cm over 0.1 m: slopes of 1, curvatures of 10 /m, fourth derivatives of 1e4 times h^2."""
    height, slope, curvature = jumps_at(profile, s)
    assert height < 1e-8  # slope 1 times the nudge, and the rounding of 200 m
    assert slope < 1e-6
    assert curvature < 1e-2


def test_the_measure_sees_corners():
    """Planted faults: a corner of the slope, and the spline folded at its end, which has a slope there."""
    assert jumps_at(polyline_through(ROAD), STATION[30])[1] > 0.05

    class Folded:
        def height_and_slope(self, s):
            back = np.where(s > ROAD.end, 2 * ROAD.end - s, s)
            height, slope = ROAD.height_and_slope(back)
            return height, np.where(s > ROAD.end, -slope, slope)

    assert jumps_at(Folded(), ROAD.end)[1] > 0.02  # 1e4 times what a C2 road may show


def test_mirrored_is_c2_at_every_turn():
    length = ROAD.end - ROAD.start
    road = continued_road(ROAD, "mirrored", 75.0)
    assert road.extent[1] >= 75.0
    for i in range(1, 5):
        assert_c2(road, ROAD.start + i * length)
    assert_c2(road, STATION[20])


def test_mirrored_passes_through_the_points_forth_and_back():
    length = ROAD.end - ROAD.start
    road = continued_road(ROAD, "mirrored", 75.0)
    np.testing.assert_allclose(road.height_and_slope(STATION)[0], HEIGHT, atol=1e-10)
    back = ROAD.end + (ROAD.end - STATION)
    np.testing.assert_allclose(road.height_and_slope(back)[0], HEIGHT, atol=1e-10)
    np.testing.assert_allclose(road.height_and_slope(STATION + 2 * length)[0], HEIGHT, atol=1e-10)
    # the slope at the turn is 0 by symmetry, up to what the far ends add: 0.27^60
    assert abs(road.height_slope_at(ROAD.end)[1]) < 1e-10


def test_the_measured_part_changes_only_near_its_end():
    road = continued_road(ROAD, "mirrored", ROAD.end + 1.0)
    s = np.linspace(STATION[0], STATION[-20], 500)
    # 20 stations before the end the influence of the end has fallen by about 0.27^20 = 4e-12, times 0.1 m
    np.testing.assert_allclose(road.height_and_slope(s)[0], ROAD.height_and_slope(s)[0], atol=1e-10)


def test_long_enough_or_endless_roads_are_left_alone():
    assert continued_road(ROAD, "refused", ROAD.end) is ROAD
    assert continued_road(ROAD, "refused", ROAD.end * (1 + 1e-15)) is ROAD  # a run to the end, with v t rounded up
    study = study_road()
    assert continued_road(study, "refused", 1e6) is study


def test_refusal_names_both_distances():
    with pytest.raises(InputError, match=r"scene\.toml: survey\.csv: the road ends at s = .* run needs 1200 m"):
        continued_road(ROAD, "refused", 1200.0, "scene.toml")


@pytest.mark.parametrize(
    ("rule", "needed", "words"),
    [("mirored", 10.0, "did you mean 'mirrored'"), ("mirrored", np.inf, "finite"), ("mirrored", 1e9, "points")],
)
def test_wrong_rules_and_distances_are_refused(rule, needed, words):
    with pytest.raises(InputError, match=words):
        continued_road(ROAD, rule, needed, "scene.toml")


@pytest.mark.parametrize("length", [0.5, 5.0])
def test_run_in_starts_at_rest_and_stays_c2(length):
    road = road_with_run_in(ROAD, length)
    np.testing.assert_array_equal(road.height_and_slope([-1e6, -2.0, ROAD.start])[0], 0.0)
    np.testing.assert_array_equal(road.height_and_slope([-1e6, -2.0, ROAD.start])[1], 0.0)
    for s in (ROAD.start, ROAD.start + length, STATION[1]):
        assert_c2(road, s)
    assert np.abs(road.sample_uniform(-3.0, 0.01, 500)[0]).max() < 0.1  # no cliff of 200 m


def test_beyond_the_run_in_the_road_is_the_measured_one():
    road, s = road_with_run_in(ROAD, 2.0), np.linspace(ROAD.start + 2.0, ROAD.end, 300)
    level = reference_height(ROAD, 2.0)
    height, slope = road.height_and_slope(s)
    np.testing.assert_allclose(height, ROAD.height_and_slope(s)[0] - level, atol=1e-10)
    np.testing.assert_allclose(slope, ROAD.height_and_slope(s)[1], atol=1e-12)
    fine = ROAD.height_and_slope(np.linspace(ROAD.start, ROAD.start + 2.0, 20_001))[0]
    assert level == pytest.approx(fine.mean(), abs=1e-4)


def test_two_tracks_with_one_reference_keep_their_bank():
    other = SplineProfile.through(STATION, HEIGHT + 0.05)
    level = reference_height(ROAD)
    s = ROAD.start + 6.0
    heights = [road_with_run_in(track, reference_height_value=level).height_slope_at(s)[0] for track in (ROAD, other)]
    assert heights[1] - heights[0] == pytest.approx(0.05, abs=1e-10)


def test_run_in_and_continuation_may_come_in_either_order():
    s = np.linspace(-3.0, 60.0, 700)
    one = road_with_run_in(continued_road(ROAD, "mirrored", 60.0), 2.0, -200.0).height_and_slope(s)
    two = continued_road(road_with_run_in(ROAD, 2.0, -200.0), "mirrored", 60.0).height_and_slope(s)
    np.testing.assert_allclose(one[0], two[0], atol=1e-10)
    np.testing.assert_allclose(one[1], two[1], atol=1e-8)


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, 100.0])
def test_impossible_run_ins_are_refused(length):
    for reference in (None, 0.0):
        with pytest.raises(InputError, match="run-in length"):
            road_with_run_in(ROAD, length, reference)


def test_a_polyline_stays_a_polyline():
    road = road_with_run_in(continued_road(polyline_through(ROAD), "mirrored", 40.0), 2.0)
    assert isinstance(road, PolylineProfile)
    assert road.height_slope_at(-1.0) == (0.0, 0.0)
