"""A road that comes to a constant grade: closed forms, and a vehicle that climbs it."""

import math

import numpy as np
import pytest

from models.core.errors import InputError
from models.engines.assembly import Settings
from models.engines.catalogue import RECOMMENDED
from models.engines.protocol import build
from models.road import SineProfile, SplineProfile
from models.road.grade import TRANSITION_LENGTH, GradedRoad
from models.road.signal import RoadUnderWheels
from models.road.study import hills_road
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene

FLAT = SineProfile(np.zeros(1), np.ones(1), np.zeros(1), 0.0, "flat")


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("grade", [0.1, -0.3])
def test_height_is_that_of_its_definition(grade):
    road, slope = GradedRoad(FLAT, grade, 40.0), math.tan(grade)
    s = np.array([-5.0, 40.0, 40.0 + TRANSITION_LENGTH, 1000.0])
    # up to rounding of some 100 m
    climbed = np.array([0.0, 0.0, TRANSITION_LENGTH / 2, 940.0])
    np.testing.assert_allclose(road.height_and_slope(s)[0], -slope * climbed, atol=1e-13)
    np.testing.assert_allclose(road.height_and_slope(s)[1], -slope * np.array([0, 0, 1, 1]), atol=1e-15)


def test_slope_is_the_derivative_and_both_have_no_jump():
    road, step = GradedRoad(hills_road(), 0.2, 40.0), 1e-4
    s = 60.0 + step * np.arange(-250_000, 250_000)
    height, slope = road.height_and_slope(s)
    # trapezoidal rule: third derivatives of about 1e-3 / m^2 times 1e-12 m^3 / 12 per step, then rounding of heights
    assert np.abs(np.diff(height) - step * (slope[1:] + slope[:-1]) / 2).max() < 1e-14
    curvature = np.diff(slope) / step
    # C2: from one step to the next the curvature changes by its own slope, under 0.01 / m^2, times 1e-4 m
    assert np.abs(np.diff(curvature)).max() < 1e-6


def test_three_ways_to_ask_agree():
    road = GradedRoad(hills_road(), 0.1, 40.0)
    uniform = np.array(road.sample_uniform(3.0, 0.7, 200))
    every = np.array([road.height_slope_at(3.0 + 0.7 * i) for i in range(200)]).T
    np.testing.assert_allclose(uniform, np.array(road.height_and_slope(3.0 + 0.7 * np.arange(200))), atol=1e-12)
    np.testing.assert_allclose(uniform, every, atol=1e-12)


@pytest.mark.grounds("closed form")
def test_its_extent_and_finest_detail_are_the_profiles():
    spline = SplineProfile.through(np.arange(9.0), np.zeros(9))
    assert GradedRoad(spline, 0.1, 1.0).extent == (0.0, 8.0)
    assert GradedRoad(spline, 0.1, 1.0).finest == 1.0
    assert GradedRoad(FLAT, 0.1, 0.0).finest == math.pi / 2


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
@pytest.mark.parametrize(
    ("parameters", "geometry"), [("itwm_drift", "exact"), ("asymmetric_twin", "exact"), ("itwm_drift", "linear")]
)
def test_steady_climb_has_the_pitch_of_the_grade(engine, parameters, geometry):
    """All moves at one rate, so no damper acts and every spring is as at rest: sin(pitch) grows by tan(grade).

    The axles are a wheelbase apart along the horizontal at every pitch, because wheels move vertically: hence the
    sine on one side and the tangent on the other, which differ by half a per cent at 0.1 rad.
    """
    grade, duration = 0.1, 8.0
    own = build_scene(
        {"title": "climb", "vehicle": {"parameters": parameters, "geometry": geometry}, "run": {"duration": duration}}
    )
    assembly = assembly_of_scene(own)
    rest, wheelbase = assembly.initial[3], assembly.parameters.a + assembly.parameters.b
    road = RoadUnderWheels(GradedRoad(FLAT, grade, 0.0), 20.0, wheelbase)
    run = build(engine, assembly.with_input("road", road), Settings(RECOMMENDED[engine], 1e-3, duration)).run()
    exact = geometry == "exact"
    pitch = math.asin(math.sin(rest) + math.tan(grade)) if exact else rest + math.tan(grade)
    # the slowest mode dies like exp(-5 t), over 6 s: 1e-13
    assert run.states[-1, 3] == pytest.approx(pitch, abs=1e-10)
    assert abs(run.states[-1, 3] - rest - grade) < 0.01 * grade
    np.testing.assert_allclose(run.states[-1, 4:7], -20.0 * math.tan(grade), rtol=1e-9)


def scene(source, **keys):
    return build_scene(
        {"title": "grade", "run": {"duration": 5.0}, "effects": {"road": {"source": source, "speed": 20.0, **keys}}}
    )


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize(("source", "keys"), [("study", {}), ("hills", {}), ("iso8608", {"road_class": "C"})])
def test_grade_of_a_scene_is_added_after_the_fade_in(source, keys):
    plain, graded = (assembly_of_scene(scene(source, **keys, **more)).input for more in ({}, {"grade": 0.1}))
    difference = graded.sample(0.0, 1e-3, 5001) - plain.sample(0.0, 1e-3, 5001)
    np.testing.assert_array_equal(difference[:2001], 0.0)  # up to 40 m
    np.testing.assert_allclose(difference[-1, :2], -math.tan(0.1) * np.array([40.0, 38.0]), atol=1e-12)
    np.testing.assert_allclose(graded.knots(5.0), [0.1, 2.0, 2.1, 4.0, 4.1])


def test_a_grade_that_is_not_named_is_not_computed():
    assert not isinstance(assembly_of_scene(scene("hills")).input.profile, GradedRoad)


@pytest.mark.parametrize("grade", [0.5, -0.6, float("nan")])
def test_impossible_grades_are_refused(grade):
    with pytest.raises(InputError, match=r"effects\.road\.grade"):
        scene("hills", grade=grade)


def test_a_measured_road_takes_no_grade(tmp_path):
    with pytest.raises(InputError, match="has no meaning for source = 'csv'"):
        assembly_of_scene(scene("csv", file="road.csv", beyond_end="refused", grade=0.1))
