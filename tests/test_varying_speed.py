"""Ride at varying speed: limits in closed form, an adjoint as the other route, standstill, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError
from models.ride.covariance import stationary_covariance
from models.ride.road_in_path import system_at_speed
from models.ride.speed_profile import SpeedProfile
from models.ride.varying_speed import quasi_stationary, varying_speed
from models.road.two_track import CORRELATION_CASES, half_track, road_excitation, road_of_level
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.cases.ride_varying_speed import STOP_AND_GO_PROFILE, deviation_by_adjoint, vehicle_and_road

STOPS = SpeedProfile((0.0, 0.2, 1.2, 2.2, 8.0), (0.0, 0.0, 20.0, 0.0, 0.0))


def test_a_place_is_passed_when_the_path_says_so():
    profile = SpeedProfile((1.0, 3.0, 5.0, 6.0, 9.0), (4.0, 10.0, 0.0, 0.0, 6.0))
    moving = np.array([-2.0, 1.0, 1.5, 3.0, 4.9, 6.5, 9.0, 11.0])
    assert profile.time(profile.path(moving)) == pytest.approx(moving, abs=1e-7)  # a root at the stop: 1e-16^(1/2)
    assert profile.path(np.array([3.0, 5.5, 9.0])) == pytest.approx([14.0, 24.0, 33.0])
    assert profile.time(24.0) == 5.0, "at a place of standstill the time of arrival"
    still = SpeedProfile((0.0, 1.0), (0.0, 2.0))
    assert np.isneginf(still.time(-0.1)), "a vehicle that has always stood has never been elsewhere"


@pytest.mark.parametrize("case", CORRELATION_CASES.values(), ids=str)
def test_at_an_even_speed_every_instant_is_stationary(case):
    vehicle = linearise(load_vehicle("seven_freedoms"))
    road = road_excitation(road_of_level(half_track(vehicle.wheels)), vehicle.wheels, *case)
    found = varying_speed(vehicle, road, SpeedProfile((0.0, 0.2), (11.0, 11.0)))
    exact = stationary_covariance(system_at_speed(vehicle, road, 11.0))
    rolling = exact.deviation > 1e-6 * exact.deviation.max()  # equal tracks: nothing rolls
    assert found.deviation[:, rolling] == pytest.approx(
        np.tile(exact.deviation[rolling], (len(found.time), 1)), rel=1e-10
    )
    assert np.abs(found.P - exact.P).max() < 1e-10 * np.abs(exact.P).max()


@pytest.mark.parametrize("damping", [0.0, 500.0])
def test_a_stop_between_the_axles_agrees_with_the_adjoint(damping):
    vehicle, road = vehicle_and_road("half_car", damping)
    found = varying_speed(vehicle, road, STOP_AND_GO_PROFILE).of("body rear")[-1]
    # 1e-8: the adjoint's solver at 1e-10; without its stop the drive would give another 10 %
    assert found == pytest.approx(deviation_by_adjoint(vehicle, road, STOP_AND_GO_PROFILE, "body rear"), rel=1e-8)


def test_three_axles_at_distances_without_a_common_measure_agree_with_the_adjoint():
    vehicle, road = vehicle_and_road("three_axle_truck")
    odd = replace(road, lengths=(0.0, 0.5, 0.5 * 2.0**0.5))
    brake = SpeedProfile((0.0, 0.4), (9.0, 5.0))
    found = varying_speed(vehicle, odd, brake).of("travel second rear left")[-1]
    assert found == pytest.approx(deviation_by_adjoint(vehicle, odd, brake, "travel second rear left"), rel=1e-8)


def test_the_road_keeps_its_variance_and_the_vehicle_comes_to_rest():
    vehicle, road = vehicle_and_road("seven_freedoms")
    found = varying_speed(vehicle, road, STOPS)
    assert found.height == pytest.approx(np.tile(found.height[0], (len(found.time), 1)), rel=1e-12)
    rest = quasi_stationary(vehicle, road, np.array([0.0]))[0]
    moving = found.deviation.max(axis=0)
    before = found.time <= 0.2
    # of a variance that rounding keeps above 0 the root is 1e-8 of its terms
    assert (np.abs(found.deviation[before] - rest).max(axis=0) / moving).max() < 1e-6
    accelerations = found.deviation[:, :3]
    assert accelerations[-1].max() < 1e-3 * moving[:3].max(), "5.8 s after the stop, e^-11 of the slowest motion"
    assert accelerations[np.isclose(found.time, 2.2)].max() > 0.1, "it still swings when it has just stopped"


def test_the_road_is_cut_where_an_axle_passes_the_place_of_a_stop():
    vehicle, road = vehicle_and_road("half_car")
    halt = SpeedProfile((0.0, 0.3, 0.8, 1.3), (10.0, 0.0, 0.0, 15.0))  # the rear axle is there at 1.2 s
    coarse, fine = (
        varying_speed(vehicle, road, halt, instants=(1.25,), largest_rate_times_step=reach) for reach in (1.0, 0.2)
    )
    # seen: 5e-11; 1e-8 if cells did not shrink towards that place, 5e-4 if they ran across it
    assert coarse.at([1.25])[0] == pytest.approx(fine.at([1.25])[0], rel=1e-9)


def test_a_road_of_second_order_shows_its_rate_to_the_tyre():
    vehicle, road = vehicle_and_road("half_car", 500.0, 10.0)
    found = varying_speed(vehicle, road, STOP_AND_GO_PROFILE).of("tyre force rear left")[-1]
    assert found == pytest.approx(
        deviation_by_adjoint(vehicle, road, STOP_AND_GO_PROFILE, "tyre force rear left"), rel=1e-8
    )


def test_white_noise_is_off_at_standstill():
    found = varying_speed(*vehicle_and_road("half_car", 100.0), STOPS)
    force = found.of("tyre force front left")
    assert np.array_equal(np.isinf(force), found.speed > 0.0)
    assert np.isfinite(found.of("body rear")).all()


def test_weighted_outputs_run_along():
    vehicle, road = vehicle_and_road("half_car", 100.0)
    found = varying_speed(vehicle, road, SpeedProfile((0.0, 0.1), (15.0, 15.0)), weightings={"body centre": "Wk"})
    exact = stationary_covariance(system_at_speed(vehicle, road, 15.0, {"body centre": "Wk"}))
    assert found.of("body centre Wk")[-1] == pytest.approx(exact.deviation[-1], rel=1e-10)


def test_what_cannot_be_driven_is_refused():
    vehicle, road = vehicle_and_road("half_car")
    with pytest.raises(InputError, match=r"drive\.speed\.1 = -1\.0: must be 0 or above"):
        SpeedProfile((0.0, 1.0), (3.0, -1.0))
    with pytest.raises(InputError, match=r"drive\.time\.2 = 1\.0: must rise"):
        SpeedProfile((0.0, 1.0, 1.0), (3.0, 3.0, 3.0))
    with pytest.raises(InputError, match="two points or more"):
        SpeedProfile((0.0,), (3.0,))
    with pytest.raises(InputError, match="at standstill nothing moves"):
        varying_speed(vehicle, road, SpeedProfile((0.0, 1.0), (0.0, 0.0)))
    free = replace(vehicle, stiffness=vehicle.stiffness * 0.0, road_stiffness=vehicle.road_stiffness * 0.0)
    with pytest.raises(InputError, match="knows no state of rest"):
        varying_speed(free, road, STOPS)
    with pytest.raises(InputError, match="must be an output"):
        varying_speed(vehicle, road, SpeedProfile((0.0, 0.1), (9.0, 9.0))).of("boot lid")
