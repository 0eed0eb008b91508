"""Signals: held, linear and smooth samples are read where and how a scene declares."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from models.core.signals import SampledSignal, Smooth, StackedSignal

RAMP = np.column_stack([np.arange(50.0), 2 * np.arange(50.0)])


@pytest.mark.grounds("closed form")
def test_held_ramp_is_replayed_exactly_at_any_step():
    held = SampledSignal(RAMP, 0.1, held=True)
    for parts in (1, 2, 4, 8, 10):
        got = held.sample(0.0, 0.1 / parts, 50 * parts)[:, 0]
        assert np.array_equal(got, np.repeat(np.arange(50.0), parts))


def test_index_survives_accumulated_time():
    held, t = SampledSignal(RAMP, 0.1, held=True), 0.0
    for i in range(49):
        assert held.at(t)[0] == i
        t += 0.1


@pytest.mark.parametrize("held", [True, False])
def test_one_instant_has_the_bits_of_a_grid(held):
    signal = SampledSignal(np.sin(1e3 * RAMP), 0.1, held)
    near = 0.1 * np.arange(-2, 53)
    times = np.concatenate([near, near + 0.9e-7, near - 0.9e-7, near + 1.1e-7, near + 0.05, near + 0.0314])
    assert all(np.array_equal(signal.at(t), signal.sample(t, 0.1, 1)[0]) for t in times)


@pytest.mark.grounds("closed form")
def test_linear_is_exact_on_a_ramp_between_samples():
    linear = SampledSignal(RAMP, 0.1, held=False)
    got = linear.sample(0.05, 0.1, 40)
    # the ramp has slope 10 per second in its first column
    assert np.abs(got[:, 0] - 10 * (0.05 + 0.1 * np.arange(40))).max() < 1e-12


@pytest.mark.grounds("closed form")
def test_impulse_of_held_samples_is_conserved():
    values = np.random.default_rng(0).normal(size=(40, 2))
    fine = SampledSignal(values, 0.1, held=True).sample(0.0, 0.01, 400)
    assert np.allclose(fine.sum(0) * 0.01, values.sum(0) * 0.1, rtol=1e-13)


@pytest.mark.grounds("closed form")
def test_smooth_is_the_cubic_spline_with_its_derivatives():
    values = np.random.default_rng(1).normal(size=(30, 2))
    smooth = Smooth(values, 0.1, derivatives=2)
    spline = CubicSpline(0.1 * np.arange(30), values)
    times = 0.013 + 0.05 * np.arange(55)
    got = smooth.sample(0.013, 0.05, 55)
    expected = np.hstack([spline(times), spline(times, 1), spline(times, 2)])
    # second derivatives are some thousand here
    assert np.abs(got - expected).max() < 1e-9
    assert np.abs(smooth.at(1.0) - np.hstack([spline(1.0), spline(1.0, 1), spline(1.0, 2)])).max() < 1e-9


@pytest.mark.grounds("closed form")
def test_quintic_reproduces_a_quintic():
    t = 0.1 * np.arange(20)
    smooth = Smooth((t**5)[:, None], 0.1, derivatives=2, degree=5)
    assert smooth.at(0.77)[2] == pytest.approx(20 * 0.77**3, rel=1e-9)


def test_stacked_keeps_columns_and_knots():
    both = StackedSignal((SampledSignal(RAMP, 0.1, held=True), Smooth(RAMP, 0.1, derivatives=2, degree=5)))
    assert both.channels == 8 and both.held and both.period == 0.1
    assert both.sample(0.0, 0.1, 10).shape == (10, 8)
    assert np.allclose(both.knots(0.35), [0.1, 0.2, 0.3])
