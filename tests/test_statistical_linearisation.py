"""Statistical linearisation: gains, a case with an exact answer, means, roads in time, copies and engines."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.ride.copies_kernel import COPIES_SIDE_BY_SIDE, fill_state_rates, march_copies
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.frequency import standard_errors
from models.ride.gaussian_laws import mean_force_and_slope, mean_friction_slope
from models.ride.nonlinear_copies import copies_in_time, force_laws
from models.ride.road_path import road_path
from models.ride.statistical_linearisation import (
    ERROR_GRADES,
    largest_error_seen,
    nonlinear_springs,
    statistically_linear,
)
from models.road.two_track import (
    CORRELATION_CASES,
    half_track,
    input_covariance,
    road_excitation,
    road_of_level,
    wheels_on_track,
)
from models.systems.ride.nonlinear import drive_over_road
from models.vehicles.spatial import Curve
from models.vehicles.spatial_linear import linearise, wheels
from models.vehicles.vehicle_file import load_vehicle
from validation.cases.ride_nonlinear import normal_expectation
from validation.ride.in_engines import NONLINEAR_VEHICLE, vehicle_and_road

SPEED = 20.0


def sprung(vehicle, **laws):
    """The vehicle with these laws in its first spring."""
    return replace(vehicle, springs=(replace(vehicle.springs[0], **laws), *vehicle.springs[1:]))


def test_hinges_are_the_curve():
    curve = Curve((-1.0, -0.2, 0.0, 0.3, 2.0), (-500.0, -300.0, 0.0, 60.0, 90.0))
    offset, slope, corners, bends = curve.hinges()
    for x in (-3.0, -0.5, -0.1, 0.1, 1.0, 5.0):
        hinged = offset + slope * x + sum(b * max(x - c, 0.0) for c, b in zip(corners, bends, strict=True))
        assert hinged == pytest.approx(curve(x), rel=1e-12)


@pytest.mark.parametrize(("mean", "deviation"), [(0.0, 0.5), (0.4, 0.05), (-2.0, 3.0)])
def test_moments_of_a_curve_are_their_integrals(mean, deviation):
    curve = Curve((-1.0, -0.2, 0.0, 0.3, 2.0), (-500.0, -300.0, 0.0, 60.0, 90.0))
    cuts = [(x - mean) / deviation for x in curve.arguments[1:-1]]
    force, gain = mean_force_and_slope(curve, mean, deviation)
    assert force == pytest.approx(normal_expectation(lambda x: curve(mean + deviation * x), cuts), rel=1e-9)
    assert gain == pytest.approx(
        normal_expectation(lambda x: curve(mean + deviation * x) * x, cuts) / deviation, rel=1e-9
    )


@pytest.mark.parametrize("ratio", [0.05, 1.0, 300.0])
def test_gain_of_friction_is_its_integral(ratio):
    """Deviations of the rate from far below that of friction, where it is a damper, to far above, Coulomb's law."""
    gain = normal_expectation(lambda x: np.tanh(ratio * x) * x, (-1.0 / ratio, 0.0, 1.0 / ratio)) / ratio
    assert mean_friction_slope(40.0, 0.01, 0.01 * ratio) == pytest.approx(4000.0 * gain, rel=1e-9)


def test_still_springs_have_their_slope_at_rest():
    curve = Curve((-1.0, 0.0, 1.0), (-500.0, 0.0, 100.0))
    assert mean_force_and_slope(curve, 0.0, 0.0) == (0.0, 300.0)
    assert mean_force_and_slope(curve, 0.5, 0.0) == pytest.approx((50.0, 100.0))
    assert mean_force_and_slope(curve, 0.0, 1e-9)[1] == pytest.approx(300.0)
    assert mean_friction_slope(40.0, 0.01, 0.0) == 4000.0
    assert mean_friction_slope(40.0, 0.01, 1e-9) == pytest.approx(4000.0)


def test_laws_that_are_lines_give_the_linear_vehicle():
    """A spring and a damper written as curves: the covariance itself, nothing left out, no mean."""
    vehicle, road = vehicle_and_road("quarter_car")
    spring = vehicle.springs[0]
    lines = {
        "travel_force": Curve((-1.0, 0.0, 1.0), (-spring.stiffness, 0.0, spring.stiffness)),
        "rate_force": Curve((-1.0, 1.0), (-spring.damping, spring.damping)),
    }
    found = statistically_linear(sprung(vehicle, stiffness=0.0, damping=0.0, **lines), road, SPEED)
    exact = stationary_covariance(vehicle_with_road(linearise(vehicle), road, SPEED))
    assert found.covariance.deviation == pytest.approx(exact.deviation, rel=1e-12)
    assert found.left_out.max() < 1e-12
    assert np.abs(found.mean).max() < 1e-12
    assert all("good to 2 %" in sentence for sentence in found.sentences)


def test_gains_are_those_of_their_own_covariance():
    """The definition of the fixed point, read back from the answer; the spring carries what the damper pulls."""
    vehicle, road = vehicle_and_road(NONLINEAR_VEHICLE, 4.0)
    found = statistically_linear(vehicle, road, SPEED)
    spring, own = vehicle.springs[0], found.springs["front left"]
    travel = found.covariance.deviation[found.covariance.names.index("travel front left")]
    assert own.deviation == pytest.approx(travel, rel=1e-11)
    stops, damper = (
        mean_force_and_slope(spring.travel_force, own.travel, travel),
        mean_force_and_slope(spring.rate_force, 0.0, own.rate),
    )
    dry = mean_friction_slope(spring.friction, spring.friction_rate, own.rate)
    assert own.equivalent_gains == pytest.approx((spring.stiffness + stops[1], damper[1] + dry), rel=1e-11)
    assert spring.stiffness * own.travel + stops[0] + damper[0] == pytest.approx(0.0, abs=1e-8)
    assert own.travel > 0.005, "a damper that is harder in rebound pulls the body down: mm, in compression"
    assert found.mean[found.covariance.names.index("travel front left")] == pytest.approx(own.travel, rel=1e-12)
    assert 0.0 < found.contraction < 0.5
    assert found.fixed_point_distance < 1e-11


def test_sentences_say_when_the_covariance_is_no_longer_good():
    vehicle, road = vehicle_and_road(NONLINEAR_VEHICLE, 16.0)
    found = statistically_linear(vehicle, road, SPEED)
    assert all("no longer good" in sentence and "Monte Carlo" in sentence for sentence in found.sentences)
    assert (
        largest_error_seen(0.0) == ERROR_GRADES[0][1] < largest_error_seen(ERROR_GRADES[1][0]) < largest_error_seen(0.2)
    )


def test_no_fixed_point_is_told(monkeypatch):
    monkeypatch.setattr("models.ride.statistical_linearisation.LARGEST_ITERATION_COUNT", 3)
    with pytest.raises(RunFailed, match="no one way to move"):
        statistically_linear(*vehicle_and_road(NONLINEAR_VEHICLE), SPEED)


@pytest.mark.parametrize("case", [*CORRELATION_CASES.values()], ids=str)
def test_road_in_time_has_the_roads_covariance(case):
    """Heights at the first and the last of 200 half steps, over 4000 copies: 4.5 standard errors of 2.2 %."""
    vehicle = load_vehicle("seven_freedoms")
    own = wheels(vehicle)
    road = road_of_level(half_track(own))
    blocks = road_path(road_excitation(road, own, *case), SPEED, 4e-3).blocks(50, 4000, 1)
    first, second = next(blocks), next(blocks)
    assert np.array_equal(first[-1], second[0]), "blocks go on where they ended"
    exact = input_covariance(road, own, *case)
    for heights in (first[0, :4], second[-1, :4]):
        assert np.abs(heights @ heights.T / 4000 - exact).max() < 0.1 * exact.max()


def test_rear_wheels_meet_the_road_later_and_rates_are_its_slopes():
    vehicle = load_vehicle("half_car")
    own = wheels_on_track(wheels(vehicle), 1.0)
    road = road_path(road_excitation(road_of_level(1.0, cutoff_wavenumber=3.0), own), SPEED, 1e-3)
    table = road.wheel_heights_and_rates(400, 3)
    lag = round((own[0].x - own[1].x) / SPEED / road.half_step)
    assert np.abs(table[lag:, 1] - table[:-lag, 0]).max() == 0.0
    slope = (table[2:, 0] - table[:-2, 0]) / (2 * road.half_step)
    assert road.has_rates
    # the rate walks by cutoff v (q v h)^(1/2) = 0.06 m/s over a half step; a sum over 800 of them tells
    assert np.std(slope - table[1:-1, 2]) < 0.06 < np.std(table[:, 2])
    assert np.corrcoef(slope, table[1:-1, 2])[0, 1] > 0.98


def test_damped_tyres_need_a_road_with_rates():
    vehicle, road = vehicle_and_road("quarter_car")
    damped = replace(vehicle, tyres=tuple(replace(tyre, damping=50.0) for tyre in vehicle.tyres))
    for run in (
        lambda: copies_in_time(damped, road, SPEED, 1.0),
        lambda: drive_over_road("mujoco", damped, road_path(road, SPEED, 1e-3), 0.1),
    ):
        with pytest.raises(InputError, match=r"road.cutoff: is missing"):
            run()


def test_copies_of_a_linear_vehicle_have_its_covariance():
    """A half car with the delay between its axles, 60 copies of 3 s: variances and means within 4 standard errors."""
    vehicle, road = vehicle_and_road("half_car")
    copies = copies_in_time(vehicle, road, SPEED, 3.0, copy_count=60, seed=4)
    exact = stationary_covariance(vehicle_with_road(linearise(vehicle), road, SPEED))
    assert np.abs(copies.z(exact.deviation)).max() < 4.0
    assert np.abs(copies.mean / copies.mean_error).max() < 4.0
    assert copies.deviation == pytest.approx(exact.deviation, rel=0.1)


def test_engines_agree_where_springs_are_bent():
    vehicle, excitation_ = vehicle_and_road(NONLINEAR_VEHICLE, 4.0)
    road = road_path(excitation_, SPEED, 1e-3)
    one, other = (
        drive_over_road(engine, vehicle, road, 0.3, road_seed=5, steps_per_output=20) for engine in ("exudyn", "mujoco")
    )
    assert np.abs(one.run.positions - other.run.positions).max() < 1e-13
    assert np.abs(one.run.rates - other.run.rates).max() < 1e-12
    # the strut is all that pulls at the body: its output would be -m a, and is not read by a gain
    assert np.isnan(one.output_values("strut force front left")).all()
    assert one.output_interval == pytest.approx(20 * road.step)
    travel = one.run.positions[::20, 1] - one.run.positions[::20, 0]
    assert one.output_values("travel front left") == pytest.approx(travel, abs=1e-15)


def test_a_copy_goes_where_an_engine_goes():
    """The quarter car's motion is small at any size: the copies' laws step by step are MuJoCo's, so is the force."""
    vehicle, excitation_ = vehicle_and_road(NONLINEAR_VEHICLE, 16.0)
    road = road_path(excitation_, SPEED, 1e-3)
    run, table = drive_over_road("mujoco", vehicle, road, 0.3, road_seed=5).run, road.wheel_heights_and_rates(300, 5)
    springs = nonlinear_springs(vehicle)
    plain = linearise(vehicle, SPEED, {s.name: (s.stiffness, s.damping) for s in springs})
    laws, x = force_laws(vehicle, plain, springs, SPEED), np.zeros((4, 1))
    sums, force, rate = np.zeros((4, len(plain.outputs), 1)), np.empty((1, 1)), np.empty((4, 1))
    march_copies(x, table[:, :, None], road.step, 300, 1, laws, sums)
    assert not sums.any(), "nothing is read before its time"
    assert np.abs(x[:, 0] - [*run.positions[-1], *run.rates[-1]]).max() < 1e-12
    fill_state_rates(x.copy(), table[-1:].T.copy(), laws, force, rate, np.empty((2, 1)))
    assert abs(force[0, 0]) > 100.0, "N: the bent laws are at work"
    march_copies(x, np.repeat(table[-1:, :, None], 3, axis=0), 0.0, 0, 1, laws, sums)
    strut = vehicle.bodies[0].mass * rate[2, 0]  # all that pulls at the body
    assert sums[:, 2, 0] == pytest.approx(strut ** np.arange(1, 5), rel=1e-12)


def test_copies_side_by_side_go_where_each_goes_alone():
    """As many as two and a bit of the blocks that are stepped together, by bits: all do the same sums."""
    vehicle, excitation_ = vehicle_and_road(NONLINEAR_VEHICLE, 16.0)
    road, copies = road_path(excitation_, SPEED, 1e-3), 2 * COPIES_SIDE_BY_SIDE + 3
    springs = nonlinear_springs(vehicle)
    plain = linearise(vehicle, SPEED, {s.name: (s.stiffness, s.damping) for s in springs})
    laws, roads = force_laws(vehicle, plain, springs, SPEED), next(road.blocks(30, copies, 5))
    x, sums = np.zeros((4, copies)), np.zeros((4, len(plain.outputs), copies))
    march_copies(x, roads, road.step, 0, 4, laws, sums)
    for copy in (0, COPIES_SIDE_BY_SIDE - 1, COPIES_SIDE_BY_SIDE, copies - 1):
        one, of_one = np.zeros((4, 1)), np.zeros((4, len(plain.outputs), 1))
        march_copies(one, roads[:, :, copy : copy + 1].copy(), road.step, 0, 4, laws, of_one)
        assert (one[:, 0] == x[:, copy]).all() and (of_one[:, :, 0] == sums[:, :, copy]).all()


def test_standard_errors_of_a_run():
    """Of white noise through 1/(1 + s/a), R = P e^(-a t): var(mean) = 2 P / (a T), var(mean square) = 2 P^2 / (a T).

    The height under a quarter car's wheel on a road of one corner is that process.
    """
    vehicle, _ = vehicle_and_road("quarter_car")
    linear = linearise(vehicle)
    height = replace(
        linear.outputs[0],
        acceleration_factors=np.zeros(2),
        rate_factors=np.zeros(2),
        displacement_factors=np.zeros(2),
        road_factors=np.ones(1),
    )
    road = road_excitation(road_of_level(1.0, corner_wavenumbers=(0.3, 0.3)), wheels_on_track(wheels(vehicle), 1.0))
    P, a, T = (
        stationary_covariance(vehicle_with_road(replace(linear, outputs=(height,)), road, 10.0)).variance[0],
        3.0,
        200.0,
    )
    mean, square = standard_errors(replace(linear, outputs=(height,)), road, 10.0, T)
    assert mean[0] == pytest.approx(np.sqrt(2 * P / (a * T)), rel=0.01)  # ends cost 1 / (a T)
    assert square[0] == pytest.approx(np.sqrt(2 * P**2 / (a * T)), rel=1e-3)
