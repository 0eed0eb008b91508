"""Stationary covariance: closed forms, limits, other routes, and outputs that have no variance."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError
from models.ride.closed_forms import QuarterCar, half_car_acceleration, quarter_cars_of_half_car
from models.ride.covariance import DIFFUSING, FINITE, INFINITE, stationary_covariance
from models.ride.excited import DelayedSystem, vehicle_with_road
from models.ride.frequency import spectral_densities, variances_by_quadrature
from models.ride.marginal import UnstableVehicle, split_marginal
from models.ride.sweep import DIRECT_BY_REQUEST, variance_sweep
from models.ride.weighting import WEIGHTINGS, system_with_weightings
from models.road.excitation import RoadExcitation
from models.road.two_track import CORRELATION_CASES, road_excitation, road_of_level
from models.vehicles.linear_vehicle import LinearOutput
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.ride.rides import quarter_car_vehicle

CORNER = QuarterCar(300.0, 40.0, 2e4, 1500.0, 2e5)
Q = 1e-4
"""Intensity of the walking road, m^2 per m."""


def walk(corner=0.0, places=(0.0,)):
    """One track under axles at ``places`` (m), z' = -corner z + w in path."""
    heights = tuple(np.eye(len(places))[:, [i]] for i in range(len(places)))
    return RoadExcitation(np.array([[-corner]]), np.array([[Q**0.5]]), heights, tuple(places[0] - x for x in places))


def system(A, B, delays=(0.0,), C=None, D=None, independent=False):
    """A small delayed system, all its states put out."""
    C = np.eye(len(A)) if C is None else C
    D = D or tuple(np.zeros((len(C), b.shape[1])) for b in B)
    return DelayedSystem(A, tuple(B), delays, C, D, tuple(map(str, range(len(C)))), independent)


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("corner", [0.0, 1e-6, 1e-3, 0.3, 3.0])
def test_quarter_car_has_its_closed_forms_down_to_a_walking_road(corner):
    found = stationary_covariance(vehicle_with_road(quarter_car_vehicle([(0.0, CORNER)]), walk(corner), 20.0))
    q, w = 20.0 * Q, 20.0 * corner
    # the matrices themselves are rounded to 1e-16, which the ratio of height to travel multiplies
    assert found.variance[0] == pytest.approx(CORNER.body_acceleration_variance(q, w), rel=1e-10)
    assert found.variance[1] == pytest.approx(CORNER.suspension_travel_variance(q, w), rel=1e-10)
    if corner == 0.0:
        assert found.variance[2] == pytest.approx(CORNER.tyre_deflection_variance(q), rel=1e-10)
        assert found.status[3] == DIFFUSING
        assert (found.rate[3], found.power[3]) == (pytest.approx(q, rel=1e-9), 1)  # the body walks with the road


@pytest.mark.grounds("closed form")
def test_half_car_splits_into_quarter_cars():
    a, b, v = 1.2, 1.5, 17.0
    front, rear, inertia = quarter_cars_of_half_car(CORNER, a, b)
    vehicle = quarter_car_vehicle([(a, front), (-b, rear)], np.diag([front.m_s + rear.m_s, inertia]))
    found = stationary_covariance(vehicle_with_road(vehicle, walk(0.0, (a, -b)), v)).variance[0]
    assert found == pytest.approx(half_car_acceleration(CORNER, v * Q, a, b, v), rel=1e-10)


@pytest.mark.grounds("closed form")
def test_scalar_delay_of_the_notes():
    a, tau = 0.7, 1.3
    found = stationary_covariance(system(np.array([[-a]]), [np.ones((1, 1))] * 2, (0.0, tau)))
    assert found.variance[0] == pytest.approx((1 + np.exp(-a * tau)) / a, rel=1e-14)


@pytest.fixture(scope="module")
def truck():
    """Three axles, linear, and the road under it in the paper's five cases."""
    vehicle = linearise(load_vehicle("three_axle_truck"))
    return vehicle, {
        str(i): road_excitation(road_of_level(1.0), vehicle.wheels, *case) for i, case in CORRELATION_CASES.items()
    }


def test_delay_of_zero_is_one_input_and_a_very_long_one_is_independence(truck):
    vehicle, roads = truck
    one = vehicle_with_road(vehicle, roads["3"], 20.0)
    at_once = stationary_covariance(replace(one, delays=(0.0, 0.0, 0.0)))
    joined = stationary_covariance(replace(one, B=(sum(one.B),), D=(sum(one.D),), delays=(0.0,)))
    np.testing.assert_array_equal(at_once.variance, joined.variance)
    apart = stationary_covariance(replace(one, independent=True))
    late = stationary_covariance(replace(one, delays=(0.0, 1e6, 2e6)))
    np.testing.assert_allclose(late.variance, apart.variance, rtol=1e-14)
    assert abs(at_once.variance / apart.variance - 1).max() > 0.1  # the limits differ, or the test says nothing


@pytest.mark.grounds("plain counterpart")
@pytest.mark.parametrize("case", ["1", "2", "3", "4", "5"])
def test_frequency_quadrature_agrees(truck, case):
    vehicle, roads = truck
    found = stationary_covariance(vehicle_with_road(vehicle, roads[case], 13.0))
    other = variances_by_quadrature(vehicle, roads[case], 13.0)
    assert found.residual < 1e-15 and found.error.max() < 1e-11
    np.testing.assert_allclose(found.variance, other.variance, rtol=1e-10)  # both claim 1e-11
    assert other.error.max() < 1e-10


def test_spectra_hold_the_delays(truck):
    vehicle, roads = truck
    omega = np.linspace(0.01, 400.0, 4_000)
    dense = 2 * np.trapezoid(spectral_densities(vehicle, roads["3"], 13.0, omega)[:, 0], omega)
    # a body acceleration has all but 1e-4 of its variance below 400 rad/s
    assert dense == pytest.approx(variances_by_quadrature(vehicle, roads["3"], 13.0).variance[0], rel=1e-3)


@pytest.mark.grounds("closed form")
def test_the_five_covariances_of_the_road_itself(truck):
    vehicle, roads = truck
    rows = np.eye(len(vehicle.wheels))
    no = np.zeros(len(vehicle.mass))
    heights = tuple(LinearOutput(f"z{i}", "m", "road", no, no, no, row, 0 * row) for i, row in enumerate(rows))
    heights += tuple(
        LinearOutput(f"z{i}+z{i + 2}", "m", "road", no, no, no, rows[i] + rows[i + 2], no[:6]) for i in (0, 1)
    )
    from models.road.two_track import input_covariance

    for case, (left_right, front_rear) in CORRELATION_CASES.items():
        found = stationary_covariance(
            vehicle_with_road(replace(vehicle, outputs=heights), roads[str(case)], 13.0)
        ).variance
        wanted = input_covariance(road_of_level(1.0), vehicle.wheels, left_right, front_rear)
        np.testing.assert_allclose(found[:6], np.diag(wanted), rtol=1e-12)
        both = [wanted[i, i] + wanted[i + 2, i + 2] + 2 * wanted[i, i + 2] for i in (0, 1)]
        np.testing.assert_allclose(found[6:], both, rtol=1e-12)


def test_tyre_damping_under_a_road_of_first_order_leaves_wheel_and_load_without_a_variance():
    vehicle = quarter_car_vehicle([(0.0, CORNER)], tyre_damping=100.0)
    found = stationary_covariance(vehicle_with_road(vehicle, walk(0.3), 20.0))
    assert found.status == (FINITE, FINITE, FINITE, FINITE, INFINITE, INFINITE)
    assert np.isinf(found.variance[4:]).all() and np.isfinite(found.variance[:4]).all()
    assert "white noise" in found.reason[4] and "second order" in found.reason[4]
    other = variances_by_quadrature(vehicle, walk(0.3), 20.0)
    assert np.isinf(other.variance[4:]).all()
    np.testing.assert_allclose(found.variance[:4], other.variance[:4], rtol=1e-10)
    quick = variance_sweep(lambda speed: vehicle, {"track": walk(0.3)}, [20.0])
    assert tuple(quick.status[0, 0]) == found.status and not quick.direct_counts


def test_a_free_heading_turns_into_a_lateral_walk():
    """Heading psi' = w, place y' = v psi: variances t and v^2 t^3 / 3."""
    v = 20.0
    found = stationary_covariance(system(np.array([[0.0, v], [0.0, 0.0]]), [np.array([[0.0], [1.0]])]))
    assert found.status == (DIFFUSING, DIFFUSING) and np.isinf(found.variance).all()
    np.testing.assert_allclose(found.rate, [v**2 / 3, 1.0])
    assert tuple(found.power) == (3, 1)
    assert "standard deviation of 1.15e+04 after 100 s" in found.reason[0]


def test_three_integrators_in_a_row_walk_with_the_fifth_power():
    """The response t^2 / 2 to a unit of noise has the square integral t^5 / 20."""
    found = stationary_covariance(system(np.eye(3, k=1), [np.array([[0.0], [0.0], [1.0]])]))
    np.testing.assert_allclose(found.rate, [1 / 20, 1 / 3, 1.0])
    assert tuple(found.power) == (5, 3, 1)


def test_what_the_first_axle_starts_the_second_may_stop():
    """psi' = w(t) - w(t - tau) stays: variance tau; y' = v psi then walks by v tau; b' = -a b + w(t) goes with it."""
    v, tau, a = 20.0, 0.13, 2.0
    A = np.array([[0.0, v, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -a]])
    C = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    first, second = np.array([[0.0], [1.0], [1.0]]), np.array([[0.0], [-1.0], [0.0]])
    found = stationary_covariance(system(A, [first, second], (0.0, tau), C))
    assert found.status == (DIFFUSING, FINITE, FINITE)
    assert (found.rate[0], found.power[0]) == (pytest.approx((v * tau) ** 2, rel=1e-9), 1)
    assert found.variance[1] == pytest.approx(tau, rel=1e-12)
    assert found.variance[2] == pytest.approx(tau + 1 / (2 * a) + 2 * (1 - np.exp(-a * tau)) / a, rel=1e-12)
    put_back = np.array([[-v * tau], [-1.0], [0.0]])  # y returns to where it was: nothing is left of the first hit
    stopped = stationary_covariance(system(A, [first, put_back], (0.0, tau), C))
    assert stopped.status == (FINITE,) * 3
    assert stopped.variance[0] == pytest.approx(v**2 * tau**3 / 3, rel=1e-12)
    apart = stationary_covariance(system(A, [first, second], (0.0, tau), C, independent=True))
    assert apart.status == (DIFFUSING,) * 3 and apart.rate[1] == pytest.approx(2.0)


def test_an_undamped_spring_swings_ever_more_unless_the_delay_is_half_its_period():
    """x'' + w^2 x = noise: the variance of x grows by 1 / (2 w^2) per second."""
    w = 9.0
    A, B = np.array([[0.0, 1.0], [-(w**2), 0.0]]), np.array([[0.0], [1.0]])
    found = stationary_covariance(system(A, [B]))
    assert found.status == (DIFFUSING,) * 2
    np.testing.assert_allclose(found.rate, [1 / (2 * w**2), 0.5], rtol=1e-9)
    stopped = stationary_covariance(system(A, [B, B], (0.0, np.pi / w)))
    assert stopped.status == (FINITE,) * 2
    assert stopped.variance[0] == pytest.approx(np.pi / (2 * w**3), rel=1e-12)


@pytest.fixture(scope="module")
def free():
    """R19-free at 20 m/s, as it is and with front roll steer, and its delayed road."""
    from models.vehicles.spatial_linear import linearise as linear

    vehicle = load_vehicle("r19_free")
    steered = tuple(replace(f, roll_steer=0.05 if f.name in ("fl", "fr") else 0.0) for f in vehicle.side_forces)
    plain = linear(vehicle, 20.0)
    return (
        plain,
        linear(replace(vehicle, side_forces=steered), 20.0),
        road_excitation(road_of_level(0.69342), plain.wheels),
    )


def test_a_free_vehicle_has_its_three_zeros_and_no_output_minds(free):
    plain, _, road = free
    one = vehicle_with_road(plain, road, 20.0)
    split = split_marginal(one.A)
    assert (split.count_of_marginal_states, split.zero_count) == (3, 3)
    assert np.linalg.matrix_rank(split.M, 1e-6) == 1  # y and yaw are one Jordan pair
    found = stationary_covariance(one)
    assert set(found.status) == {FINITE}
    assert "nothing pulls back" in found.reason[0]
    other = variances_by_quadrature(plain, road, 20.0)
    # the place to the side feels the rounding of a stiffness that should vanish, and says so
    assert (abs(found.variance / other.variance - 1) < other.error + 1e-10).all()
    assert other.error.max() < 1e-6 and np.median(other.error) < 1e-10


def test_what_symmetry_keeps_at_rest_does_not_diffuse_by_rounding(free):
    """Alike tracks move nothing sideways, with roll steer or without: such variances are zero, up to rounding."""
    for vehicle in free[:2]:
        alike = road_excitation(road_of_level(0.69342), vehicle.wheels, "equal", "delayed")
        found = stationary_covariance(vehicle_with_road(vehicle, alike, 30.0))
        assert set(found.status) == {FINITE}
        assert found.variance[found.names.index("lateral position")] < 1e-24  # m^2


def test_roll_steer_makes_it_diffuse_sideways(free):
    _, steered, road = free
    found = stationary_covariance(vehicle_with_road(steered, road, 20.0))
    diffusing = [name for name, status in zip(found.names, found.status, strict=True) if status == DIFFUSING]
    assert diffusing == ["lateral position"]
    at = found.names.index("lateral position")
    assert found.power[at] == 3
    assert np.sqrt(found.rate[at] * 100.0**3) == pytest.approx(7.0, abs=0.1)  # m after 100 s; known to one digit


@pytest.mark.parametrize("installed", [False, True])
def test_results_do_not_depend_on_slycot(free, truck, monkeypatch, installed):
    plain, _, road = free
    one = stationary_covariance(vehicle_with_road(plain, road, 20.0)).variance

    def never(*_, **__):
        raise AssertionError("slycot was asked")

    monkeypatch.setattr("control.exception.slycot_installed", installed)
    for name in ("sb03md", "sb04md"):
        monkeypatch.setattr(f"control.mateqn.{name}", never)
    np.testing.assert_array_equal(stationary_covariance(vehicle_with_road(plain, road, 20.0)).variance, one)


def test_an_unstable_vehicle_is_refused_in_words():
    with pytest.raises(UnstableVehicle, match=r"swings at 11\.8\d? Hz grows at a rate of 0\.06\d+ 1/s") as told:
        stationary_covariance(vehicle_with_road(quarter_car_vehicle([(0.0, replace(CORNER, c=-5.0))]), walk(0.3), 20.0))
    assert told.value.growth == pytest.approx(0.064, rel=0.01)
    with pytest.raises(UnstableVehicle, match="does not swing"):
        stationary_covariance(system(np.array([[0.5]]), [np.ones((1, 1))]))


def test_a_sweep_names_the_speed_at_which_a_vehicle_is_unstable():
    vehicle = quarter_car_vehicle([(0.0, replace(CORNER, c=-5.0))])
    with pytest.raises(UnstableVehicle, match="must be stable at 20 m/s"):
        variance_sweep(lambda speed: vehicle, {"": walk(0.3)}, [20.0])


def test_slow_motions_beside_a_wheel_of_no_mass_are_not_called_free():
    """1e12 1/s beside 10 1/s: they fall below the accuracy of the matrix, and no load diffuses because of that."""
    vehicle = quarter_car_vehicle([(0.0, replace(CORNER, m_u=1e-9))])
    with pytest.raises(InputError, match=r"vehicle: has a motion so fast, [\d.]+e\+12 1/s, that its slow ones"):
        stationary_covariance(vehicle_with_road(vehicle, walk(0.3), 20.0))


def test_a_weighted_output_is_that_of_the_quadrature(truck):
    vehicle, roads = truck
    found = stationary_covariance(
        system_with_weightings(vehicle_with_road(vehicle, roads["3"], 20.0), {"driver": "Wk"})
    )
    factor = {"driver": WEIGHTINGS["Wk"].response}
    other = variances_by_quadrature(vehicle, roads["3"], 20.0, factor)
    at = [output.name for output in vehicle.outputs].index("driver")
    assert found.variance[-1] == pytest.approx(other.variance[at], rel=1e-10)


@pytest.mark.grounds("plain counterpart")
def test_the_fast_route_equals_the_direct_one(truck):
    vehicle, roads = truck
    filters = {"driver": "Wk", "cab": "Wk", "frame centre": "Wd"}  # repeated poles
    quick = variance_sweep(lambda speed: vehicle, roads, [3.0, 30.0], filters)
    slow = variance_sweep(lambda speed: vehicle, roads, [3.0, 30.0], filters, by_modes=False)
    assert quick.direct_counts == {} and slow.direct_counts == {DIRECT_BY_REQUEST: 10}
    assert quick.outputs[-1] == "frame centre Wd" and (quick.status == slow.status).all()
    told = slow.variance > 1e-20  # below, an output is zero by symmetry
    np.testing.assert_allclose(quick.variance[told], slow.variance[told], rtol=1e-10)


def test_the_fast_route_says_when_it_is_not_taken(free):
    plain, _, road = free
    found = variance_sweep(lambda speed: plain, {"3": road}, [20.0])
    assert sum(found.direct_counts.values()) == 1 and "parallel" in next(iter(found.direct_counts))
    np.testing.assert_array_equal(
        found.variance[0, 0], stationary_covariance(vehicle_with_road(plain, road, 20.0)).variance
    )
