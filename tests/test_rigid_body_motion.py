"""Motion from accelerometers: exact with clean data, planes named and repaired, loose mounts found."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.sensors import rigid_body_motion as motion
from models.sensors.rate_filter import filter_rates
from models.sensors.rigid_body_motion import high_pass
from models.sensors.rotations import quaternion_from_cardan, rotation_matrix
from models.sensors.sensor_array import sensor_array
from validation.spatial.spatial_motion import PATH, SENSOR_ARRANGEMENTS, sensor_readings, tilted_sensors

RANDOM = np.random.default_rng(8)


@pytest.fixture(scope="module", params=SENSOR_ARRANGEMENTS)
def case(request):
    array = sensor_array(SENSOR_ARRANGEMENTS[request.param])
    return array, sensor_readings(array.positions)


def test_everything_that_needs_no_integration_is_exact(case):
    array, clean = case
    found = motion.body_rotation_from_readings(array, clean)
    # readings of 20 m/s^2 over a spread of 0.8 m: some 1e-15 of rounding, amplified by at most 20
    assert np.abs(motion.angular_acceleration(found, PATH.rates) - PATH.alpha).max() < 1e-12
    # squares, because a root loses half the digits where a rate passes through zero
    assert (
        np.abs(
            (motion.rates_up_to_sign(found) @ array.principal_axes) ** 2 - (PATH.rates @ array.principal_axes) ** 2
        ).max()
        < 1e-13
    )
    assert motion.fit_quality(array, clean).unexplained_share < 1e-14


def test_the_whole_motion_comes_back(case):
    array, clean = case
    found = motion.recovered_motion(array, clean, PATH.period, PATH.start)
    # order 4 at 1 ms: h^4 w'''' / 720 over 2 s
    assert np.abs(found.rates - PATH.rates).max() < 1e-11
    assert np.abs(rotation_matrix(found.orientation) - rotation_matrix(PATH.orientation)).max() < 1e-11
    assert np.abs(found.position - PATH.position).max() < 1e-9
    place = np.array([0.7, -0.2, 0.4])
    assert np.abs(found.point(place) - PATH.position - rotation_matrix(PATH.orientation) @ place).max() < 1e-9


def test_integration_falls_with_the_fourth_power_of_the_period(case):
    array, clean = case
    errors = [
        np.abs(
            motion.integrate_rates(
                motion.body_rotation_from_readings(array, clean[::every]), every * PATH.period, PATH.rates[0]
            )[-1]
            - PATH.rates[::every][-1]
        ).max()
        for every in (20, 10)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


def test_in_a_plane_the_plain_formula_would_give_half_and_a_bias():
    """The trap, and that it is never walked into."""
    floor = np.array(list(SENSOR_ARRANGEMENTS["5 in a plane"].values()))
    relative = sensor_readings(floor) - sensor_readings(floor).mean(axis=1, keepdims=True)
    m = np.swapaxes(relative, 1, 2) @ np.linalg.pinv((floor - floor.mean(axis=0)).T)
    w, plain = PATH.rates, 0.5 * (m[:, 2, 1] - m[:, 1, 2])
    assert np.abs(plain - 0.5 * (PATH.alpha[:, 0] + w[:, 1] * w[:, 2])).max() < 1e-13
    array = sensor_array(SENSOR_ARRANGEMENTS["5 in a plane"])
    assert array.is_planar and "lie in a plane" in " ".join(array.description_sentences())
    with pytest.raises(InputError, match="half of the angular acceleration"):
        sensor_array(SENSOR_ARRANGEMENTS["5 in a plane"], "spatial")


def test_both_formulas_agree_where_both_hold():
    places = SENSOR_ARRANGEMENTS["5, one 1 m up"]
    clean = sensor_readings(np.array(list(places.values())))
    alphas = [
        motion.angular_acceleration(
            motion.body_rotation_from_readings(sensor_array(places, formula), clean), PATH.rates
        )
        for formula in ("spatial", "plane")
    ]
    assert np.abs(alphas[0] - alphas[1]).max() < 1e-13


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ({"a": (0, 0, 0), "b": (1, 0, 0)}, "at least three"),
        ({"a": (0, 0, 0), "b": (1, 0, 0), "c": (2, 5e-4, 0)}, "on a line"),
        ({"a": (0, 0, 0), "b": (0, 0, 0), "c": (0, 0, 0)}, "on a line"),
        ({"a": (0, 0, 0), "b": (1, 0, 0), "c": (0, 1, np.nan)}, "finite numbers"),
        ({"a": (0, 0), "b": (1, 0), "c": (0, 1)}, "three finite numbers"),
    ],
)
def test_arrays_that_cannot_see_a_turn_are_refused(places, words):
    with pytest.raises(InputError, match=words):
        sensor_array(places)


def test_noise_gains_are_those_of_a_car_floor():
    """2 m by 1.2 m, a fifth sensor at height h: 0.69 at 1 m, 18.9 at 0.03 m relative to the last sensor."""
    for height, wanted in ((1.0, 0.69), (0.3, 1.9), (0.1, 5.8), (0.03, 18.9)):
        array = sensor_array(tilted_sensors(height, np.eye(3)), "spatial")
        # relative to the mean of all sensors up to 3 % less
        assert 0.96 * wanted < array.noise_gains().max() < 1.02 * wanted
        assert array.noise_gains()[2] == pytest.approx(0.486, abs=1e-3)
        assert array.noise_gains(with_plane_formula=True).max() == pytest.approx(1 / 1.2)


@pytest.mark.parametrize("loose", range(5))
def test_a_loose_sensor_is_named(loose):
    array = sensor_array(SENSOR_ARRANGEMENTS["5, one 1 m up"])
    clean = sensor_readings(array.positions)
    shaken = clean.copy()
    shaken[:, loose] += 0.5 * RANDOM.normal(size=(len(clean), 3))
    found = motion.fit_quality(array, shaken)
    assert found.rigid is False and found.suspect_sensor == array.names[loose]
    noisy = clean + 0.5 * RANDOM.normal(size=clean.shape)  # as much on all: noise, if it is known to be
    assert motion.fit_quality(array, noisy, reading_deviation=0.5).rigid and not motion.fit_quality(array, noisy).rigid


@pytest.mark.parametrize("height", [1.0, 0.4, 0.2, 0.1, 0.03, 0.0])
def test_misfit_of_noise_is_what_the_redundancy_says(height):
    array = sensor_array(tilted_sensors(height, np.eye(3)))
    noisy = sensor_readings(array.positions) + 0.05 * RANDOM.normal(size=(len(PATH.rates), 5, 3))
    found = motion.fit_quality(array, noisy, reading_deviation=0.05)
    # 2001 samples of 6 equations: 1 % standard error; the rates are not quite those of least squares
    assert 0.96 < np.sqrt(np.mean(found.unexplained_rms**2)) / found.expected_misfit < 1.2


def test_three_sensors_say_that_nothing_can_be_said():
    array = sensor_array(SENSOR_ARRANGEMENTS["3"])
    assert motion.fit_quality(array, sensor_readings(array.positions)).rigid is None
    assert "nothing over to check" in array.description_sentences()[-1]


def test_a_reading_that_is_no_number_is_named():
    array = sensor_array(SENSOR_ARRANGEMENTS["5 in a plane"])
    bad = sensor_readings(array.positions).copy()
    bad[17, 3, 2] = np.nan
    with pytest.raises(InputError, match="sensor s4, sample 17 along z"):
        motion.recovered_motion(array, bad, PATH.period)
    with pytest.raises(InputError, match="shape"):
        motion.body_rotation_from_readings(array, bad[:, :4])


def test_zeroed_sensors_give_the_same_motion():
    array = sensor_array(SENSOR_ARRANGEMENTS["4"])
    clean = sensor_readings(array.positions)
    raw = motion.recovered_motion(array, clean, PATH.period, PATH.start)
    zeroed = motion.recovered_motion(
        array, clean + np.array([0.0, 0.0, 9.81]), PATH.period, PATH.start, gravity_corrected=True
    )
    assert np.abs(raw.position - zeroed.position).max() < 1e-11


def test_a_tilt_error_becomes_a_displacement():
    """At rest, level, but believed to be tilted by 1 mrad."""
    array, count, tilt = sensor_array(SENSOR_ARRANGEMENTS["4"]), 10001, 1e-3
    still = np.broadcast_to([0.0, 0.0, -9.81], (count, 4, 3))
    start = motion.BodyStartState(orientation=tuple(quaternion_from_cardan(0.0, tilt, 0.0)))
    found = motion.recovered_motion(array, still, 1e-3, start)
    law = motion.tilt_displacement(tilt, 1e-3 * np.arange(count))
    assert np.abs(-found.position[:, 0] - law).max() < 1e-9
    assert law[-1] == pytest.approx(0.4905, abs=1e-4)  # half a metre after 10 s


def test_the_symmetric_part_bounds_the_rate():
    """100 Hz, 0.3 m/s^2 of noise: integration walks off, the filter stays at its own figure."""
    array, period = sensor_array(SENSOR_ARRANGEMENTS["5, one 1 m up"]), 0.01
    t = period * np.arange(6001)
    rates = np.column_stack([0.5 * np.sin(2 * t), 0.4 * np.cos(1.3 * t), 0.3 + 0.1 * np.sin(t)])
    alpha = np.column_stack([np.cos(2 * t), -0.52 * np.sin(1.3 * t), 0.1 * np.cos(t)])
    lever = motion.skew_matrix(alpha) + motion.skew_matrix(rates) @ motion.skew_matrix(rates)
    noisy = np.einsum("nij,sj->nsi", lever, array.positions) + 0.3 * RANDOM.normal(size=(len(t), 5, 3))
    found = motion.body_rotation_from_readings(array, noisy)
    filtered, stated = filter_rates(found, period, rates[0], 0.3)
    late = slice(3000, None)
    walked = np.abs(motion.integrate_rates(found, period, rates[0]) - rates)[late].max()
    error = np.sqrt(np.mean((filtered - rates)[late] ** 2))
    assert walked > 0.08 and error < 0.02
    assert error == pytest.approx(np.sqrt(np.mean(stated[late] ** 2)), rel=0.5)
    with pytest.raises(InputError, match="above 0"):
        filter_rates(found, period, rates[0], 0.0)


def test_high_pass_halves_at_its_cut_off_and_refuses_what_is_too_short():
    t = 0.01 * np.arange(20001)
    for frequency, left in ((0.5, 0.5), (5.0, 1.0), (0.05, 1e-4)):
        wave = np.sin(2 * np.pi * frequency * t)
        passed = high_pass(wave, 0.01, 0.5)[5000:-5000]
        # 1 / (1 + (fc/f)^4) and no phase
        assert np.abs(passed - left * wave[5000:-5000]).max() < 0.002
    for cut_off in (0.0, 50.0, 0.004):
        with pytest.raises(InputError, match="cut-off"):
            high_pass(t, 0.01, cut_off)
