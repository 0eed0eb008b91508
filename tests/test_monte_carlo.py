"""Monte Carlo of a ride: its cells of road against Van Loan's integral, its copies against the covariance."""

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

from models.core.errors import InputError
from models.ride.covariance import stationary_covariance
from models.ride.monte_carlo import (
    LEGENDRE_MODES,
    _PathCells,
    path_cell,
    variances_along_drive,
    variances_at_constant_speed,
)
from models.ride.road_in_path import system_at_speed
from models.ride.speed_profile import SpeedProfile
from models.ride.varying_speed import varying_speed
from validation.cases.ride_varying_speed import vehicle_and_road

SEED = 3


def test_both_axles_answer_to_a_cell_with_their_joint_covariance():
    vehicle, road = vehicle_and_road("half_car")
    cells = _PathCells(vehicle, road, None, 6.0)
    front, rear = cells.length / 6.0, cells.length / 9.0  # the rear axle comes by faster
    first, second = (cells._cell_transition(duration)[1] for duration in (front, rear))
    modes = np.vstack([first[:, : 2 * LEGENDRE_MODES], second[:, 2 * LEGENDRE_MODES :]])
    A = block_diag(*(duration * cells.at_rest + cells.length * cells.per_speed for duration in (front, rear)))
    B = np.vstack(cells.at_unit_speed.B) * cells.length**0.5
    n = len(A)
    block = expm(np.block([[-A, B @ B.T], [np.zeros((n, n)), A.T]]))
    joint = block[n:, n:].T @ block[:n, n:]
    found = modes @ modes.T
    scale = np.sqrt(np.diag(found))
    own = scale > 0.0  # an axle's noise does not reach the other one's road
    off = np.abs(found - joint)[np.ix_(own, own)] / np.outer(scale[own], scale[own])
    assert off.max() < 1e-8  # what the series leaves out is 1e-9 of a cell's variance at its longest
    assert np.abs(found[: n // 2, n // 2 :]).max() > 0.0


def test_a_cell_fits_all_distances():
    assert path_cell((0.0, 3.6, 4.95), 0.2) == (pytest.approx(0.15), pytest.approx([0, 24, 33]))
    cell, behind = path_cell((0.0, 1.0, 2.0**0.5), 0.1)
    assert np.abs(cell * behind - [0.0, 1.0, 2.0**0.5]).max() <= 1e-3
    assert path_cell((0.0, 0.0), 0.1) == (0.1, pytest.approx([0, 0]))


def test_copies_along_a_drive_agree_with_the_covariance():
    vehicle, road = vehicle_and_road("half_car")
    brake = SpeedProfile((0.0, 1.0), (16.0, 8.0))
    found = variances_along_drive(vehicle, road, brake, (0.5, 0.9), copy_count=1000, seed=SEED)
    exact = varying_speed(vehicle, road, brake, instants=found.time).at(found.time)
    assert np.abs(found.z(exact)).max() < 4.0  # sixteen values: one run in a thousand would fail
    assert found.error / found.variance == pytest.approx(np.full((2, 8), (2.0 / 1000) ** 0.5), rel=0.15)
    again = variances_along_drive(vehicle, road, brake, (0.5, 0.9), copy_count=1000, seed=SEED)
    assert np.array_equal(found.variance, again.variance)


@pytest.mark.parametrize("case", ["delayed", "uncorrelated"])
def test_copies_at_constant_speed_agree_with_the_covariance(case):
    vehicle, road = vehicle_and_road("half_car")
    road = road if case == "delayed" else type(road)(road.F, road.G, road.heights, road.lengths, independent=True)
    found = variances_at_constant_speed(vehicle, road, 15.0, 6.0, copy_count=512, seed=SEED)
    exact = stationary_covariance(system_at_speed(vehicle, road, 15.0))
    assert (found.error / found.variance).max() < 0.03  # sharp enough to tell the two cases, 30 % apart at the centre
    assert np.abs(found.z(exact.deviation[None])).max() < 4.0


def test_outputs_with_white_noise_have_no_variance_and_no_z():
    found = variances_at_constant_speed(*vehicle_and_road("half_car", 100.0), 15.0, 0.1, copy_count=16, seed=SEED)
    force = found.names.index("tyre force front left")
    assert np.isinf(found.variance[0, force])
    assert np.isnan(found.z(np.full((1, len(found.names)), np.inf))[0, force])


def test_a_standstill_is_refused():
    with pytest.raises(InputError, match="steps along the road"):
        variances_along_drive(*vehicle_and_road("half_car"), SpeedProfile((0.0, 1.0), (3.0, 0.0)), (0.5,))
