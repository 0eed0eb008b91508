"""Small functions of roads, vehicles and rails that engines share, by closed forms and by numbers written out."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from models.contact.fastsim_grid import ellipse_grid
from models.contact.linear_theory import kalker_coefficients
from models.core.systems import scene_of_table
from models.engines.native_parts import AxialTravel
from models.engines.spatial_protocol import EngineKinematics, difference_step
from models.multibody.numbers import _last_coordinate_of_frame, _put_curves
from models.multibody.parts import ON_RATE, ON_TRAVEL, PER_PART, curve_numbers
from models.multibody.plain.motion import motion_generator
from models.rail.equations import ROLL, YAW, WheelsetEquations, Y
from models.rail.linear import (
    _contact_kinematics,
    critical_speed_or_reason,
    kalker_matrix,
    largest_growth_rate,
    linear_matrices,
)
from models.rail.wheel_forces import plain_rails
from models.rail.wheelset import CHOSEN_WHEELSET
from models.ride.covariance import rounding_thresholds
from models.ride.excited import _range_and_kernel
from models.ride.sweep import modes_of_matrix, variance_sweep
from models.road.shape_filter import ShapeFilter
from models.road.two_track import TwoTrackRoad, _both_filters, half_track
from models.systems.bicycle.run import bicycle_assumptions
from models.systems.ride.of_scene import excitation_of, half_track_of, placed_wheels
from models.systems.ride.watched import SpectralMotion, checked_speeds, static_loads
from models.systems.wheelset.of_scene import equations_and_start, path_speeds
from models.vehicles.cut_vehicle import CutVehicleElement
from models.vehicles.free_vehicle import CARRIER
from models.vehicles.kinematics import Kinematics
from models.vehicles.linear_vehicle import WheelPosition
from models.vehicles.spatial import Curve
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle

pytestmark = pytest.mark.grounds("closed form")
CAR, GRAVITY = load_vehicle("r19_free"), 9.81
FRONT = [tyre for tyre in CAR.tyres if tyre.axle == 0]
WHEELS = tuple(WheelPosition(tyre.name, tyre.point[0], tyre.point[1], tyre.axle) for tyre in CAR.tyres)
W = CHOSEN_WHEELSET


def test_the_first_travel_of_an_element_is_the_way_from_end_to_end_along_its_axis():
    foot, tip, axis = np.array([0.25, -0.5, 0.75]), np.array([0.5, 0.25, 1.5]), np.array([0.6, 0.0, 0.8])
    element = CutVehicleElement("a", "body", "fl", foot, tip, axis, 1.0, 0.0, 0.0, "body")
    for travel in (element, AxialTravel("body", foot, "fl", tip, axis)):
        assert travel.design == pytest.approx(0.6 * 0.25 + 0.8 * 0.75, rel=1e-12)


def test_a_turn_of_an_engine_is_handed_on_and_differences_are_wide_where_laws_are_smooth():
    turn = np.full((3, len(CAR.coordinates())), 0.75)
    kinematics = EngineKinematics(CAR, lambda body, point: turn, lambda body: turn)
    assert kinematics.turn("body").tolist() == turn.tolist()
    cornered = replace(CAR, springs=(replace(CAR.springs[0], friction=10.0), *CAR.springs[1:]))
    assert (difference_step(CAR), difference_step(cornered)) == (4e-3, 1e-5)


def test_points_of_a_body_move_by_its_levers():
    """q = (x, y, z, rx, ry, rz) of the chassis: shift + turn x lever."""
    kinematics, chassis, point = Kinematics(CAR), CAR.body("body"), (0.5, -0.25, 1.25)
    q = np.zeros(kinematics.size)
    q[:6] = 0.125, 0.25, 0.5, 0.75, -0.375, 0.625
    assert CAR.coordinates()[:6] == tuple(("body", freedom) for freedom in ("x", "y", "z", "rx", "ry", "rz"))
    moved = q[:3] + np.cross(q[3:6], np.subtract(point, chassis.position))
    assert kinematics.shift("body", point) @ q == pytest.approx(moved, rel=1e-12)
    assert kinematics.turn("body") @ q == pytest.approx(q[3:6], rel=1e-12)
    assert kinematics.coordinate("body", "ry") @ q == -0.375 and not kinematics.coordinate("fl", "ry").any()
    assert {*kinematics.turn("fl").flat, *kinematics.coordinate("body", "ry")} == {0.0, 1.0}


def test_generators_of_skew_axes_move_along_them_and_turn_about_them():
    axes = ((0.6, 0.0, 0.8), (0.0, 1.0, 0.0), (-0.8, 0.0, 0.6))
    point, shifted = np.array([0.5, -0.25, 0.75, 1.0]), np.array([0.6, 0.0, 0.8])
    assert (motion_generator("x", axes) @ point).tolist() == [*shifted, 0.0]
    assert (motion_generator("rx", axes) @ point)[:3] == pytest.approx(np.cross(shifted, point[:3]), rel=1e-12)


def test_numbers_of_a_table_that_name_places_are_whole():
    """The last coordinate of a body's joint, and where each curve begins."""
    towed = SimpleNamespace(name="t", towed=("trailer",), coordinates=lambda: (("body", "x"), ("trailer", "x")))
    towed.body = lambda name: SimpleNamespace(position=(0.0, 0.0, 0.0), parent=None)
    assert (
        _last_coordinate_of_frame(towed, "springs", "trailer") == 1.0
        and _last_coordinate_of_frame(towed, "springs", CARRIER) == 0.0
    )
    curve, rows = Curve((-0.5, 0.0, 0.25), (-1.5, 0.5, 2.5)), np.zeros(2 * PER_PART)
    laid, numbers = _put_curves([(None, (None, curve)), (None, (curve, None))], rows, 40), curve_numbers(curve)
    assert laid.tolist() == [*numbers, *numbers]
    assert (rows[ON_RATE], rows[PER_PART + ON_TRAVEL]) == (40.0, 40.0 + len(numbers))


def test_filters_of_a_road_are_its_corners_and_the_roots_of_its_intensities():
    plain, cut = ShapeFilter(0.25, 6.25), ShapeFilter(0.5, 2.25, cutoff=3.0)
    assert [part.tolist() for part in plain.matrices()] == [[[-0.25]], [[2.5]], [[1.0]]]
    assert [part.tolist() for part in cut.matrices()] == [[[-0.5, 1.0], [0.0, -3.0]], [[0.0], [4.5]], [[1.0, 0.0]]]
    F, G, mean, roll = _both_filters(TwoTrackRoad(plain, cut))
    assert F.tolist() == [[-0.25, 0.0, 0.0], [0.0, -0.5, 1.0], [0.0, 0.0, -3.0]]
    assert G.tolist() == [[2.5, 0.0], [0.0, 0.0], [0.0, 4.5]]
    assert (mean.tolist(), roll.tolist()) == ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])


def ride_scene(**road):
    """A scene of the shipped car."""
    table = {"title": "t", "system": "ride", "vehicle": {"file": "r19_free"}, "road": road}
    return scene_of_table({**table, "speeds": {"values": [20.0]}}, "s.toml", Path())


def test_wheels_run_where_the_scene_says():
    front, rear = 0.69342, 0.68199
    assert half_track(WHEELS) == pytest.approx(front, rel=1e-12)
    assert half_track_of(ride_scene(iso8608="C"), WHEELS) == pytest.approx(front, rel=1e-12)
    assert half_track_of(ride_scene(iso8608="C", half_track=0.75), WHEELS) == 0.75
    own, tracks = (placed_wheels(ride_scene(iso8608="C", wheels=word), WHEELS) for word in ("own", "tracks"))
    assert own == WHEELS and [wheel.y for wheel in own] == [front, -front, rear, -rear]
    assert [wheel.y for wheel in tracks] == [front, -front, front, -front]
    assert [wheel.x for wheel in tracks] == [wheel.x for wheel in WHEELS]


def test_the_road_under_a_wheel_has_the_density_of_its_level():
    """S0 / (corner^2 + Omega^2) of mean and roll in halves at the track: two-sided, over rad/m."""
    level, wavenumber = 2.5e-6, 2.0
    scene = ride_scene(level=level, corner_mean=0.25, corner_roll=0.5, cutoff=None)
    road = excitation_of(scene, WHEELS)
    for axle, y in ((0, 0.69342), (1, 0.68199)):
        row = road.heights[axle][2 * axle]
        response = row @ np.linalg.solve(1j * wavenumber * np.eye(len(road.F)) - road.F, road.G)
        roll = (y / 0.69342) ** 2 / (0.5**2 + wavenumber**2)
        density = level / 2.0 * (1.0 / (0.25**2 + wavenumber**2) + roll)
        assert np.sum(np.abs(response) ** 2) / (2.0 * math.pi) == pytest.approx(density, rel=1e-9)
    assert road.lengths == pytest.approx((0.0, 1.1561957064 + 1.4227170936), rel=1e-12)


def test_thresholds_of_rounding_grow_with_the_square_of_the_terms():
    """Of y = 0.5 a - 0.5 b, each of deviation 2: terms that sum up to 2 in absolute values."""
    few, many = (rounding_thresholds(size * np.array([[0.5, -0.5]]), 4.0 * np.eye(2))[0] for size in (1.0, 3.0))
    assert many == pytest.approx(9.0 * few, rel=1e-12, abs=0.0)
    assert few == pytest.approx((1e-9 * 2.0) ** 2, rel=1e-12, abs=0.0)


def test_a_singular_matrix_is_split_into_its_range_and_its_null_space():
    """4 along the first coordinate alone: unit vectors of the scaled matrix, divided by the scale 2."""
    on, off = _range_and_kernel(np.array([[4.0, 0.0], [0.0, 0.0]]))
    assert np.abs(on) == pytest.approx(np.array([[0.5], [0.0]])) and np.abs(off) == pytest.approx(
        np.array([[0.0], [1.0]])
    )
    on, off = _range_and_kernel(np.array([[4.0, 1.0], [1.0, 9.0]]))
    assert on.tolist() == np.eye(2).tolist() and off.shape == (2, 0)


def test_rounding_of_the_slowest_decay_is_that_of_the_fastest_motion():
    """An uncoupled system, whose eigenvectors are perpendicular: 8 against 0.25."""
    system = modes_of_matrix(np.diag([-8.0, -0.25, -2.0]))
    assert system.condition == 1.0
    assert system.rate_rounding == pytest.approx(np.finfo(float).eps * 8.0 / 0.25, rel=1e-12, abs=0.0)


def test_a_bicycle_is_judged_until_it_leans_by_a_radian():
    (upright,) = bicycle_assumptions(None)
    assert {abs(value) for value in vars(upright).values() if isinstance(value, float)} == {1.0}


def test_a_car_stands_on_loads_that_balance_its_weight():
    mass = sum(body.mass for body in CAR.bodies)
    centre = sum(body.mass * body.position[0] for body in CAR.bodies) / mass
    front, rear = FRONT[0].point[0], CAR.tyres[-1].point[0]
    share = (centre - rear) / (front - rear)
    expected = {tyre.name: mass * GRAVITY / 2.0 * (share if tyre.axle == 0 else 1.0 - share) for tyre in CAR.tyres}
    assert static_loads(CAR) == pytest.approx(expected, rel=1e-9)


def test_a_few_of_many_speeds_are_evenly_among_them():
    assert checked_speeds([30.5, 10.5, *np.linspace(11.5, 29.5, 19)]) == [10.5, 15.5, 20.5, 25.5, 30.5]


@pytest.mark.grounds("plain counterpart")
def test_deviations_of_parts_are_those_of_outputs_that_ask_for_the_same():
    """Tyre forces and travels as outputs of the vehicle file."""
    road, speeds = excitation_of(ride_scene(iso8608="C"), WHEELS), [15.0, 25.0]
    spectral = SpectralMotion(
        CAR, lambda speed: linearise(CAR, speed), road, speeds, {"load fl": np.array([0.5, 0.75])}
    )
    sweep = variance_sweep(lambda speed: linearise(CAR, speed), {"c": road}, speeds)
    for name, output in (("load fl", "tyre force front left"), ("travel rear right", "travel rear right")):
        assert spectral.motion_of_part(name).deviation == pytest.approx(sweep.of("c", output), rel=1e-9)
    assert spectral.motion_of_part("load fl").mean.tolist() == [0.5, 0.75]


def test_pressure_of_a_grid_falls_along_its_ellipse_and_sums_up_to_the_load():
    """4 cells in each of 2 strips, 1 - y^2 = 3/4 of the ellipse; (1 - x^2)(1 - y^2) where the bound is parabolic."""
    made = ellipse_grid(4, 2, "parabolic")
    strips, cells = made.records
    assert strips.y.tolist() == [0.5, -0.5] and strips.half == pytest.approx([math.sqrt(0.75)] * 2, rel=1e-12)
    assert cells.centre.tolist() == [0.75, 0.25, -0.25, -0.75]
    outer, inner = 1.0 - 0.75**2, 1.0 - 0.25**2
    assert cells.bound == pytest.approx([outer, inner, inner, outer], rel=1e-12)
    area = 1.0 * 2.0 * math.sqrt(0.75) / 4.0
    assert 2.0 * made.middle * 0.75 * cells.bound.sum() * area == pytest.approx(1.0, rel=1e-12)


def test_creep_forces_of_a_wheel_are_kalker_s_coefficients_times_its_ellipse():
    ellipse, rigidity = W.ellipse, W.material.E / (2.0 * (1.0 + W.material.nu))
    c, c2 = kalker_coefficients(ellipse.a / ellipse.b, W.material.nu), ellipse.a * ellipse.b
    expected = [[c2 * c.c11, 0.0, 0.0], [0.0, c2 * c.c22, c2**1.5 * c.c23], [0.0, -(c2**1.5) * c.c23, c2**2 * c.c33]]
    assert kalker_matrix(W) == pytest.approx(rigidity * np.array(expected), rel=1e-9)


def test_creepages_of_cones_are_those_of_their_rolling_radii():
    """Both wheels yaw by half a gauge times the yaw rate; a displacement changes the radii by L y; all at speed 1."""
    (right, right_place), (left, left_place) = _contact_kinematics(W)
    slope = math.atan(W.conicity)
    sideways = W.half_gauge / (W.half_gauge - W.conicity * W.radius) / math.cos(slope)
    radii = W.conicity * (W.half_gauge + W.head_radius * math.sin(slope)) / (W.half_gauge - W.conicity * W.radius)
    for side, motion, place in ((1.0, right, right_place), (-1.0, left, left_place)):
        expected = [[0.0, -side * W.half_gauge], [sideways, 0.0], [0.0, math.cos(slope)]]
        assert motion == pytest.approx(np.array(expected), rel=1e-12)
        assert place[0, 0] == pytest.approx(-side * radii / W.radius, rel=1e-12)
        assert place[1, 1] == pytest.approx(-1.0 / math.cos(slope), rel=1e-12)


def test_at_its_critical_speed_a_motion_neither_grows_nor_dies():
    critical, why = critical_speed_or_reason(W)
    assert why == "" and abs(largest_growth_rate(W, critical)) < 1e-9 * abs(largest_growth_rate(W, 0.9 * critical))
    assert largest_growth_rate(W, 0.995 * critical) < 0.0 < largest_growth_rate(W, 1.005 * critical)


def test_the_largest_growth_is_that_of_the_roots_of_the_characteristic_polynomial():
    """det(M s^2 + D s + K) of two coordinates, with polynomials in s as entries."""
    linear = linear_matrices(W, 50.0)
    (a, b), (c, d) = np.moveaxis(np.array([linear.mass, linear.damping, linear.stiffness]), 0, -1)
    roots = np.roots(np.convolve(a, d) - np.convolve(b, c))
    assert largest_growth_rate(W, 50.0) == pytest.approx(roots.real.max(), rel=1e-6)


def test_the_fastest_rate_of_a_wheelset_is_its_matrix_s_spectral_radius():
    """Gelfand's formula, |A^n|^(1/n), with n = 2^40 by squaring."""
    equations = WheelsetEquations(W, 20.0, "linear", 5)
    power, logarithm = equations.state_matrix, 0.0
    for doubling in range(40):
        size = np.linalg.norm(power)
        logarithm += math.log(size) / 2.0**doubling
        power = (power / size) @ (power / size)
    assert equations._fastest_rate == pytest.approx(math.exp(logarithm), rel=1e-9)


def test_a_growth_that_is_written_out_has_its_own_critical_speed():
    assert critical_speed_or_reason(W, lambda _, speed: speed - 62.5)[0] == pytest.approx(62.5, rel=1e-9)


def wheelset_scene(**run):
    """A scene of the chosen wheelset."""
    table = {"title": "t", "system": "wheelset", "speeds": {"values": [80.0]}, "run": {"duration": 0.1, **run}}
    return scene_of_table(table, "s.toml", Path())


def test_paths_of_a_wheelset_begin_where_their_scene_says_at_speeds_about_the_critical_one():
    assert path_speeds(wheelset_scene(speeds=[12.5, 30.25])) == [12.5, 30.25]
    critical, _ = critical_speed_or_reason(W)
    assert path_speeds(wheelset_scene()) == [round(0.9 * critical, 2), round(1.1 * critical, 2)]
    # the wheel that bears more yields more: 0.2 % of the roll
    scene = wheelset_scene(displacement=2.5e-3, yaw=1.25e-3, speeds=[12.5])
    equations, state = equations_and_start(scene, "reference", 12.5)
    assert equations.speed == 12.5 and (state[Y], state[YAW]) == (2.5e-3, 1.25e-3)
    assert state[ROLL] == pytest.approx(-2.5e-3 * W.conicity / (W.half_gauge - W.conicity * W.radius), rel=4e-3)


def test_tuples_of_rails_hold_the_fields_of_their_record():
    rails = WheelsetEquations(W, 20.0, "linear", 5).rails
    wheels, (head, *_), strips, cells, middle, _ = plain_rails(rails)
    assert wheels["radius"].tolist() == [W.radius] and head.tolist() == rails.profile.head.tolist()
    assert strips.tolist() == rails.strips.tolist() and cells.tolist() == rails.cells.tolist()
    assert middle == rails.middle
