"""Shared kernels held to what follows from their definition by hand: no engine, and no other kernel, takes part."""

import math

import numpy as np
import pytest
from numpy.polynomial import polynomial

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.controllers.five_phase_cycle import CycleWheelState, time_to_corner
from models.core.piecewise import interpolated_rows, piecewise_values
from models.multibody.tree import add_three, cross, dot, plus, times
from models.road.kernels import cubics_uniform

pytestmark = pytest.mark.grounds("closed form")
ROUNDING = 1e-14
"""Relative; some ten operations."""
CLOSE = pytest.approx


def rolling_at(pressure, torque):
    """A state of a wheel of which only its brake counts."""
    return CycleWheelState(pressure, torque, 50.0, 0.0, 0.0)


def test_corners_of_the_brake_s_loop_lie_where_its_two_lines_meet_the_torque():
    """The upward line gives 1500 N m at 0.75 + 1500/1500 bar, the downward one at 0.5 + 1500/2000 bar."""
    brakes = brakes_of_wheels(Brake(push_out=0.75, release=0.5, rising=1500.0, falling=2000.0))
    assert time_to_corner(rolling_at(1.0, 1500.0), 10.0, brakes) == CLOSE(0.075, rel=ROUNDING)
    assert time_to_corner(rolling_at(1.5, 1500.0), -10.0, brakes) == CLOSE(0.025, rel=ROUNDING)
    assert time_to_corner(rolling_at(1.0, 1000.0), -10.0, brakes) == CLOSE(0.05, rel=ROUNDING)
    assert time_to_corner(rolling_at(0.4, 0.0), -10.0, brakes) == CLOSE(0.04, rel=ROUNDING)
    assert time_to_corner(rolling_at(2.0, 1500.0), 10.0, brakes) == math.inf


def test_pieces_of_a_polynomial_and_their_derivatives():
    """Cubic pieces of two columns, 0.5 s long, by numpy's polynomials; the last one goes on beyond its end."""
    coefficients = np.random.default_rng(1).normal(size=(4, 3, 2))
    computed = piecewise_values(coefficients, 0.5, 0.11, 0.3, 7, 2)
    for row, time in enumerate(0.11 + 0.3 * np.arange(7)):
        piece = min(int(time / 0.5), 2)
        for order in range(3):
            law = polynomial.polyder(coefficients[:, piece], order)
            by_hand = polynomial.polyval(time - 0.5 * piece, law)
            assert computed[row, 2 * order : 2 * order + 2] == CLOSE(by_hand, rel=1e-12, abs=1e-13)


def test_lines_between_samples():
    values = np.random.default_rng(2).normal(size=(5, 2))
    index, part = np.array([0, 2, 3, 4]), np.array([0.25, 0.5, 0.75, 0.5])
    computed = interpolated_rows(values, index, part)
    for column in range(2):
        assert computed[:, column] == CLOSE(np.interp(index + part, np.arange(5), values[:, column]), rel=ROUNDING)


def test_a_cubic_is_filled_in_at_equal_steps_as_the_polynomial_that_it_is():
    """One cubic of the station, cut into pieces of unequal length; slopes by its derivative."""
    station, law = np.array([0.0, 0.7, 1.5, 4.0]), np.polynomial.Polynomial([0.3, -0.2, 0.05, 0.4])
    pieces = [[law.deriv(k)(s) / math.factorial(k) for k in (3, 2, 1, 0)] for s in station[:-1]]
    height, slope = np.empty(12), np.empty(12)
    cubics_uniform(0.1, 0.3, station, np.array(pieces), 0.0, height, slope)
    at = 0.1 + 0.3 * np.arange(12)
    assert height == CLOSE(law(at), rel=1e-13) and slope == CLOSE(law.deriv()(at), rel=1e-13)


def test_vectors_of_three_numbers():
    a, b = np.random.default_rng(3).normal(size=(2, 3))
    left, right = tuple(a), tuple(b)
    assert dot(left, right) == CLOSE(a @ b, rel=1e-13)
    assert cross(left, right) == CLOSE(tuple(np.cross(a, b)), rel=1e-13)
    assert times(left, 0.7) == CLOSE(tuple(0.7 * a)) and plus(left, right) == CLOSE(tuple(a + b))
    numbers = np.arange(6.0)
    add_three(numbers, 2, left)
    assert numbers == CLOSE(np.arange(6.0) + np.array([0, 0, *a, 0]))
