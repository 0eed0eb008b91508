"""Kernels of what a vehicle tows, by hand: axles that turn with it, headings that add up, and how a train ends."""

import math

import numpy as np
import pytest
from numba import njit

from models.brake.advance import FINE, FOLDED
from models.brake.sprung_step import OVER, TrainUnits, fill_unit_values, status_at_end
from models.machine.stack import start
from models.multibody.forces import _axle_of_towed_wheel
from models.multibody.tree import PER_LINK, TURNED

pytestmark = pytest.mark.grounds("closed form")


@njit
def turned_to(link, axle):
    return _axle_of_towed_wheel(start(link), axle)


@njit
def ending(q, units, fold):
    return status_at_end(q, units, fold)


@pytest.mark.parametrize("heading", [-2.5, 0.0, 0.3])
def test_an_axle_beside_a_towed_body_is_turned_by_its_heading_whatever_it_pitches(heading):
    link, axle = np.zeros(PER_LINK), (0.2, 0.9, 0.1)
    pitch = 0.4
    link[TURNED : TURNED + 3] = (
        math.cos(pitch) * math.cos(heading),
        math.cos(pitch) * math.sin(heading),
        -math.sin(pitch),
    )
    flat = complex(*axle[:2]) * complex(math.cos(heading), math.sin(heading))
    assert turned_to(link, axle) == pytest.approx((flat.real, flat.imag, 0.1), rel=1e-14)


def test_headings_of_units_are_the_sums_of_what_they_yaw_beside_one_another():
    whole, turns, plane = np.array([3.0, 4.0, 0.5, 7.0, 0.25, 9.0, -0.125]), np.array([4, 6]), np.zeros(5)
    fill_unit_values(whole, turns, plane)
    assert plane.tolist() == [3.0, 4.0, 0.5, 0.75, 0.625]


def test_a_train_ends_where_it_folds_or_leans_beyond_half_a_radian():
    units = TrainUnits(np.array([3]), np.array([4, 5]), np.zeros((2, 4)))
    for turn, lean, end in ((0.9, 0.4, FINE), (-1.1, 0.0, FOLDED), (math.nan, 0.0, FOLDED), (0.0, -0.6, OVER)):
        assert ending(np.array([0.0, 0.0, 2.0, turn, 0.0, lean]), units, 1.0) == end
