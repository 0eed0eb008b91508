"""Attitude from noisy rates: the case's rows, the laws at their limits, and the recorded car where it is there."""

import numpy as np
import pytest

from models.core.noise import GYRO, normal_samples
from models.sensors import inertial_unit as unit
from models.sensors.rotations import quaternion_of_rotation_vector, rotation_matrix, rotation_vector
from validation.cases.inertial_unit import START_ATTITUDE, coning_motion, measure, turning_rates
from validation.measured import recording


def test_every_row_of_the_case_passes(tmp_path):
    rows, _ = measure(True, tmp_path)
    assert len(rows) > 25
    for row in rows:
        assert row.status != "not run" or "TWINRIG_DATA" in row.reason, f"{row.id}: {row.reason}"


def test_matrix_law_solves_its_differential_equation():
    """E[E]' = E[E] S (1/2 sum s^2 G^2) S^T, by central differences of the law between two periods."""
    walks, period, count = np.array([0.2, 0.5, 0.9]), 1e-4, 4000
    rates = turning_rates(count + 1, period)
    before, middle, after = (
        unit.mean_error_rotation(walks, rates[: count + i], period, START_ATTITUDE) for i in (-1, 0, 1)
    )
    true = rotation_matrix(unit.true_attitude(rates[:count], period, START_ATTITUDE)[-1])
    slope = middle @ true @ unit.noise_decay_matrix(walks) @ true.T
    # central differences: h^2 / 6 times the third derivative, and a rate that changes by 1e-4 from period to period
    assert np.abs((after - before) / (2 * period) - slope).max() < 2e-4 * np.abs(slope).max()


def test_matrix_law_at_rest_is_the_law_of_each_axis():
    """One noisy axis: cos of a normal angle, exp(-s^2 t / 2), across it and 1 along it."""
    law = unit.mean_error_rotation(np.array([0.0, 0.7, 0.0]), np.zeros((50, 3)), 0.02, START_ATTITUDE)
    across = np.exp(-0.49 / 2)
    assert law == pytest.approx(np.diag([across, 1.0, across]), abs=1e-14)


def test_turning_matters_for_unequal_noise_only():
    walks, rates = np.array([0.1, 0.3, 0.6]), turning_rates(400, 5e-3)
    resting, moving = (unit.mean_error_rotation(walks, own, 5e-3, START_ATTITUDE) for own in (0 * rates, rates))
    assert np.abs(moving - resting).max() > 0.05  # the noisy axis turns by a radian
    equal = unit.mean_error_rotation(np.full(3, 0.4), rates, 5e-3, START_ATTITUDE)
    assert equal == pytest.approx(np.exp(-0.16 * 2.0) * np.eye(3), abs=1e-13)


def test_noise_of_a_path_is_its_own_whoever_runs_beside_it():
    rates, deviation = turning_rates(40, 0.01), np.array([1.0, 2.0, 3.0])
    both = unit.measured_attitude(rates, 0.01, deviation, START_ATTITUDE, range(3, 5), 9)
    alone = unit.measured_attitude(rates, 0.01, deviation, START_ATTITUDE, range(4, 5), 9)
    assert np.array_equal(both[:, 1], alone[:, 0])
    first = quaternion_of_rotation_vector(
        0.01 * (rates[0] + deviation * normal_samples(9, 4, 1, 3, noise_source=GYRO)[0])
    )
    assert alone[1, 0] == pytest.approx(first, abs=1e-15)


def test_cone_is_a_motion_with_these_rates():
    rates, q = coning_motion(1e-5 * np.arange(3))
    turn = rotation_vector(unit.error_rotation(q[2], q[0])) / 2e-5
    assert rotation_matrix(q[1]).T @ turn == pytest.approx(rates[1], abs=1e-9)  # second order in 1e-5 s


def test_recorded_car():
    """A telephone's gyro and its camera see the same turns: without this, frames or signs are wrong."""
    path = recording.find_recording()
    if path is None:
        pytest.skip(f"needs {recording.RECORDING_FILE} in the folder that TWINRIG_DATA names")
    own = recording.read_recording(path)
    seen = rotation_vector(unit.error_rotation(own.pose[20:], own.pose[:-20])) / (20 * recording.SAMPLE_PERIOD)
    read = np.einsum("nij,nj->ni", rotation_matrix(own.pose[10:-10]), own.rates[10:-10])
    smooth = np.column_stack([np.convolve(read[:, i], np.ones(20) / 20, "same") for i in range(3)])
    assert all(np.corrcoef(seen[20:-20, i], smooth[20:-20, i])[0, 1] > 0.9 for i in range(3))
    assert np.degrees(recording.gyro_error(own)[-1]) < 10.0  # a wrong sign of one axis gives far more in a bend
