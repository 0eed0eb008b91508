"""Whipple's bicycle: published matrices, eigenvalues and speeds; hard cases; what cannot be a bicycle."""

import numpy as np
import pytest

from models.bicycle.whipple import SteeringControl, Whipple, load_bicycle
from models.core.errors import InputError
from validation.common.bicycle_published import CAPSIZE_SPEED, PUBLISHED_EIGENVALUES, PUBLISHED_MATRICES, WEAVE_SPEED

BENCHMARK = load_bicycle("benchmark")
DELFT = load_bicycle("steer_by_wire")


@pytest.mark.grounds("published")
def test_matrices_are_the_published_ones():
    bicycle = load_bicycle("benchmark")
    M, C1, K0, K2 = bicycle.linear
    for here, there in zip((M, C1, bicycle.gravity * K0, K2), PUBLISHED_MATRICES.values(), strict=True):
        assert here == pytest.approx(np.array(there), abs=1e-12)


@pytest.mark.grounds("published")
@pytest.mark.parametrize("speed", PUBLISHED_EIGENVALUES)
def test_eigenvalues_are_the_published_ones(speed):
    # printed to 14 digits; castering, the largest, is 25 1/s
    assert np.abs(BENCHMARK.eigenvalues(speed) - PUBLISHED_EIGENVALUES[speed]).max() < 1e-12


@pytest.mark.grounds("published")
def test_weave_and_capsize_speed_are_the_published_ones():
    assert BENCHMARK.weave_speed == pytest.approx(WEAVE_SPEED, abs=1e-12)
    assert BENCHMARK.capsize_speed == pytest.approx(CAPSIZE_SPEED, abs=1e-12)
    for speed in (BENCHMARK.weave_speed, BENCHMARK.capsize_speed):
        assert np.abs(BENCHMARK.eigenvalues(speed).real).min() < 1e-12


def test_a_planted_fault_of_a_thousandth_is_seen():
    body = BENCHMARK.body
    heavier = BENCHMARK.changed(body=body.model_copy(update={"Ixz": 1.001 * body.Ixz}))
    assert np.abs(heavier.eigenvalues(5.0) - PUBLISHED_EIGENVALUES[5.0]).max() > 1e-4
    assert abs(heavier.weave_speed - WEAVE_SPEED) > 1e-4


def test_at_standstill_the_double_pairs_are_real_and_opposite():
    values = BENCHMARK.eigenvalues(0.0)
    assert np.abs(values.imag).max() == 0.0 and np.abs(values + values[::-1]).max() < 1e-12


def test_backwards_motion_is_forward_motion_in_reversed_time():
    assert np.abs(BENCHMARK.eigenvalues(-5.0) - np.sort_complex(-BENCHMARK.eigenvalues(5.0))).max() < 1e-12


def test_a_bicycle_without_weave_or_capsize_speed_says_none():
    level = BENCHMARK.changed(gravity=0.0)
    assert level.capsize_speed is None
    backwards = BENCHMARK.changed(trail=-0.2)
    assert backwards.weave_speed is None


def test_wheels_without_inertia_have_eigenvalues():
    wheels = {
        name: getattr(BENCHMARK, name).model_copy(update={"Ixx": 0.0, "Iyy": 0.0})
        for name in ("rear_wheel", "front_wheel")
    }
    values = BENCHMARK.changed(**wheels).eigenvalues(5.0)
    assert np.isfinite(values).all() and np.abs(values - BENCHMARK.eigenvalues(5.0)).max() > 0.1


def test_the_feedback_steadies_the_measured_bicycle():
    # without it unstable below 4.3 m/s, as its experimenters tell
    assert DELFT.eigenvalues(3.0).real.max() > 0.5
    assert DELFT.eigenvalues(3.0, SteeringControl(gain=2.0)).real.max() < 0.0


def test_feedback_ends_at_its_speed_and_reads_the_speed_sensor():
    control = SteeringControl(gain=2.0, speed_gain=1.1, speed_bias=0.1, torque_gain=0.5)
    assert control.lean_rate_gain(3.0) == pytest.approx(0.5 * 2.0 * (6.5 - 3.4))
    assert control.lean_rate_gain(6.0) == 0.0


@pytest.mark.parametrize(
    ("change", "place", "allowed"),
    [
        ({"wheelbase": 0.0}, "wheelbase", "must be above 0"),
        ({"tilt": 2.0}, "tilt", "must be at most 1.5"),
        ({"wheels": 2}, "wheels", "unknown key"),
        ({"trail": float("nan")}, "trail", "must be a finite number"),
        ({"rear_wheel": {"radius": 0.3, "mass": 2.0, "Ixx": 0.06, "Iyy": 0.2}}, "rear_wheel", "at most 2 Ixx"),
        ({"body": {"x": 0.3, "z": -0.9, "mass": 85.0, "Ixx": 1.0, "Izz": 1.0, "Ixz": 2.0}}, "body", "root of Ixx Izz"),
    ],
)
def test_what_is_no_bicycle_is_refused(change, place, allowed):
    with pytest.raises(InputError) as refused:
        BENCHMARK.changed(**change)
    assert place in str(refused.value) and allowed in str(refused.value)


def test_an_unknown_set_offers_the_nearest():
    with pytest.raises(InputError, match="did you mean 'benchmark'"):
        load_bicycle("benchmrk", ".", "mine.toml")


def test_a_speed_beyond_all_measure_is_refused():
    with pytest.raises(InputError, match="speed = nan: must be from -100 to 100 m/s"):
        BENCHMARK.eigenvalues(float("nan"))


def test_masses_of_nothing_are_refused():
    front = {"front_frame": BENCHMARK.front_frame.model_copy(update={"mass": 0.0})}
    wheel = {"front_wheel": BENCHMARK.front_wheel.model_copy(update={"mass": 0.0})}
    with pytest.raises(InputError, match="need a mass"):
        Whipple.linear.__get__(BENCHMARK.changed(**front, **wheel))
