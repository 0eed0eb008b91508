"""Functions of plain Python that engines share, by closed forms: a car's loads and speeds at rest and in a straight
line, roads, brakes, steering, and the phases of a controller at their thresholds."""

import math

import numpy as np
import pytest

from models.brake.brake import Brake, brakes_of_wheels, torques_of_pressures
from models.brake.controller import SAMPLING_PERIOD, Sample
from models.brake.controllers.five_phase import FivePhase
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, plane_of_truck
from models.brake.port.ask import checked_command
from models.brake.pressure import BrakeChambers, air_at_rest
from models.brake.steering import Steering
from models.drift.score import low_pass, root_mean_square
from models.multibody.numbers import Handling
from models.road.iso8608 import level_of_class
from models.road.plane_waves import plane_waves
from models.vehicles.free_vehicle import joint_table, last_coordinate_and_joint
from models.vehicles.vehicle_file import load_vehicle

pytestmark = pytest.mark.grounds("closed form")
NEAR = 0.02
"""m/s^2: how near to a threshold a wheel's acceleration comes; 1 % of the smallest that is tried here is more."""
SLOWING = 8.0
"""m/s^2 by which the vehicle slows down."""
MEMORY = 0.1
"""s of the mean of the vehicle's acceleration."""


def test_loads_of_a_braked_truck_balance_its_weight_and_its_inertia():
    """Forces, moments about the axle across (x), and about the axis along (y) of the four wheels."""
    plane = plane_of_truck(PAPER_TRUCK)
    x, y = plane.place.T
    m, lever = PAPER_TRUCK.mass, PAPER_TRUCK.mass * PAPER_TRUCK.height
    assert plane.masses == pytest.approx([m]) and plane.inertias == pytest.approx([PAPER_TRUCK.yaw_inertia])
    assert (plane.static_loads.sum(), plane.static_loads @ x, plane.static_loads @ y) == pytest.approx(
        (m * GRAVITY, 0.0, 0.0), abs=1e-8
    )
    assert (
        plane.load_per_x_acceleration.sum(),
        plane.load_per_x_acceleration @ x,
        plane.load_per_x_acceleration @ y,
    ) == pytest.approx((0.0, -lever, 0.0), abs=1e-9)
    assert (
        plane.load_per_y_acceleration.sum(),
        plane.load_per_y_acceleration @ y,
        plane.load_per_y_acceleration @ x,
    ) == pytest.approx((0.0, -lever, 0.0), abs=1e-9)
    assert (plane.load_per_y_acceleration * y)[:2].sum() == pytest.approx(-0.3 * lever, rel=1e-12)
    assert x == pytest.approx([1.42, 1.42, -2.19, -2.19]) and y == pytest.approx([0.95, -0.95, 0.9, -0.9])
    assert plane.radius == pytest.approx([0.5] * 4) and plane.spin_inertia == pytest.approx([13.35, 13.35, 27.0, 27.0])
    assert PAPER_TRUCK.wheelbase == pytest.approx(3.61, rel=1e-12)


def test_torque_rises_and_falls_along_the_lines_of_its_own_brake():
    """From none to 4 bar, and back to 1 bar: rising (p - push out), then at most falling (p - release)."""
    both = brakes_of_wheels(
        Brake(push_out=0.75, release=0.5, rising=1500.5, falling=1800.5),
        Brake(push_out=0.25, release=0.125, rising=900.5, falling=990.5),
    )
    one, other = (type(both)(*(column[i : i + 1] for column in both)) for i in (0, 1))
    along = np.array([0.0, 4.0, 1.0])
    assert torques_of_pressures(along, one) == pytest.approx([0.0, 1500.5 * 3.25, 1800.5 * 0.5], rel=1e-12)
    assert torques_of_pressures(along, other) == pytest.approx([0.0, 900.5 * 3.75, 990.5 * 0.875], rel=1e-12)


def test_nothing_is_under_pressure_at_the_start_but_the_supply():
    air = air_at_rest(BrakeChambers(np.array([0.15]), np.array([0.1]), 6.25), SAMPLING_PERIOD)
    assert air.supply == pytest.approx([6.25], rel=1e-12)
    assert not np.any(air[0]) and not np.any(air[1])


def test_steering_goes_from_knot_to_knot_on_the_wheels_that_steer():
    steering = Steering(np.array([1.0, 3.0]), np.array([0.02, 0.06]), np.array([1.0, 1.0, 0.0, 0.0]))
    for time, angle in ((0.5, 0.02), (1.5, 0.03), (9.0, 0.06)):
        assert steering(time) == pytest.approx([angle, angle, 0.0, 0.0], rel=1e-12)


def followed(accelerations, speed=20.0):
    """Pressures that a five-phase controller asks for while a wheel has such accelerations (m/s^2) beside those of its
    vehicle, which slows down all the while and whose mean acceleration lags behind."""
    controller = FivePhase(1, e1=20.0, e2=30.0, e3=25.0, e4=3.0, e5=60.0, falling=60.0, fast=40.0, slow=8.0)
    wheel, pressures = speed, []
    for k, beside in enumerate(accelerations):
        mean = -SLOWING * (1.0 - (1.0 - SAMPLING_PERIOD / MEMORY) ** k)
        wheel += (beside + mean) * SAMPLING_PERIOD if k else 0.0
        sample = Sample(
            k, round(1e9 * k * SAMPLING_PERIOD), np.array([wheel]), True, 6.0, speed - SLOWING * k * SAMPLING_PERIOD
        )
        pressures.append(float(checked_command(controller, sample).pressures[0]))
    return np.array(pressures)


def test_the_five_phases_end_at_their_thresholds_and_have_their_rates():
    """A wheel that passes each threshold after it has come near: its pressure rises by rates of ours until then."""
    begins = [0.0] * 12
    passed = [(-60.0, -1.0), (20.0, 1.0), (30.0, 1.0), (25.0, -1.0), (3.0, -1.0), (-60.0, -1.0)]
    near = [threshold + way * off for threshold, way in passed for off in (-NEAR, NEAR)]
    rates = [40.0] * 13 + [-60.0, -60.0, 0.0, 0.0, 40.0, 40.0, 0.0, 0.0, 8.0, 8.0, -60.0]
    assert followed(begins + near) == pytest.approx(SAMPLING_PERIOD * np.cumsum(rates), rel=1e-9)


def test_a_wheel_beyond_the_deep_slip_is_released_and_a_slow_vehicle_is_braked():
    """Slip of 0.299 and 0.301 about the limit of 0.3; below the speed at which control ends it is the supply's."""
    for slip, pressures in ((0.299, [40.0, 80.0]), (0.301, [0.0, 0.0])):
        controller, wheel = FivePhase(1, fast=40.0), np.array([10.0 * (1.0 - slip)])
        asked = [
            float(checked_command(controller, Sample(k, k, wheel, True, 6.0, 10.0)).pressures[0]) for k in range(2)
        ]
        assert np.array(asked) == pytest.approx(SAMPLING_PERIOD * np.array(pressures), rel=1e-12)
    assert checked_command(FivePhase(1), Sample(0, 0, np.array([1.0]), True, 6.25, 1.49)).pressures == pytest.approx(
        [6.25]
    )


def test_a_class_of_road_has_the_variance_of_its_density():
    """Class C has 256e-6 m^3 at 0.1 waves per metre, one-sided (ISO 8608): the integral over a band is that of the
    two-sided level / Omega^2 over both signs."""
    first, last = 0.2, 1.3
    of_class = 256e-6 * 0.1**2 * (1.0 / first - 1.0 / last)
    of_level = 2.0 * level_of_class("C") * (1.0 / first - 1.0 / last) / (2.0 * math.pi)
    assert of_level == pytest.approx(of_class, rel=1e-12)


def test_waves_of_a_road_have_the_variances_of_their_bands():
    """pi level / k^2 over each band of wave numbers. A mean of 200,000 squares is within 4.5 standard errors of
    sqrt(2 / 200000); heights 1 % off would be 2 % in it."""
    level, count = 3e-6, 10_000
    edges = 2.0 * math.pi / 60.0 * (60.0 / 0.5) ** (np.arange(count + 1) / count)
    bands = math.pi * level * (1.0 / edges[:-1] - 1.0 / edges[1:])
    shares = []
    for seed in range(10):
        kx, ky, cosine, sine = plane_waves(level, count, seed).T
        assert np.hypot(kx, ky) == pytest.approx(np.sqrt(edges[:-1] * edges[1:]), rel=1e-9)
        shares.append((cosine**2 + sine**2) / bands)
    assert np.mean(shares) / 2.0 == pytest.approx(1.0, abs=4.5 * math.sqrt(2.0 / 200_000))


def test_a_car_rolls_straight_ahead_under_the_weight_of_its_slope():
    car = Handling(load_vehicle("r19_free"), slope=0.1)
    assert car.gravity == pytest.approx([-9.81 * math.sin(0.1), 0.0, -9.81 * math.cos(0.1)], rel=1e-12)
    places, rates = car.straight(12.5)
    named = dict(zip(car.vehicle.coordinates(), rates, strict=True))
    spins = {f"{tyre.name} rotor": 12.5 / tyre.point[2] for tyre in car.given.tyres}
    assert not places.any() and rates[0] == pytest.approx(12.5)
    assert {body: named[body, "ry"] for body in spins} == pytest.approx(spins, rel=1e-12)
    assert np.count_nonzero(rates) == 1 + len(spins)


def test_arms_from_joint_to_joint_end_where_each_body_is():
    """The sum of all arms below a coordinate is the design position of its body."""
    car = Handling(load_vehicle("r19_free")).vehicle
    rows, ends = joint_table(car), list[np.ndarray]()
    for _, below, *arm in rows:
        ends.append(np.array(arm) + (ends[int(below)] if below >= 0.0 else 0.0))
    for (name, _), end in zip(car.coordinates(), ends, strict=True):
        assert end == pytest.approx(car.body(name).position, abs=1e-12)
    wheel = next(body for body in car.bodies if body.name == car.tyres[0].body)
    coordinate, place = last_coordinate_and_joint(car, wheel.name)
    assert car.coordinates()[coordinate][0] == wheel.name and place == pytest.approx(ends[coordinate], abs=1e-12)


def test_a_slow_sine_passes_the_band_of_a_score_and_has_its_root_mean_square():
    """A Butterworth filter of order 4 that runs twice leaves 1 / (1 + (f / 15 Hz)^8), 0.99985 of 5 Hz; the ripple of
    its warped frequencies is below 1e-4 there."""
    times = 1e-3 * np.arange(20_000)
    passed = low_pass(2.5 * np.sin(2.0 * math.pi * 5.0 * times), 1e-3)[5000:15_000]
    assert root_mean_square(2.5 * np.sin(2.0 * math.pi * 5.0 * times)) == pytest.approx(2.5 / math.sqrt(2.0), rel=1e-12)
    assert np.sqrt(np.mean(passed**2)) == pytest.approx(2.5 / math.sqrt(2.0) / (1.0 + 3.0**-8), rel=5e-4)
