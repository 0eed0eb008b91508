"""The compiled Kalman filter of roll and pitch held to the textbook's matrices, all values of a sample at once."""

import numpy as np
import pytest

from models.multibody.cut_table import HubInputs
from models.systems.hub_forces.measurement import HubForces, MeasuredAngles
from models.systems.hub_forces.tilt_filter import (
    StatedDeviations,
    TiltFilter,
    _without_slope,
    estimate_tilt,
    inputs_with_moments,
)
from models.systems.hub_forces.tilt_march import TiltNoise, march
from models.vehicles.cut_vehicle import rigid_vehicle
from validation.spatial.cars import r19

pytestmark = pytest.mark.grounds("plain counterpart")
DT, SAMPLES = 0.02, 25


def by_the_book(x, p, turning, measured, noise):
    """States and deviations (n, 4), and the sum of the normalised innovations squared.

    x' = F x + G u, P' = F P F^T + Q; K = P H^T (H P H^T + R)^-1. Source: R. E. Kalman, J. Basic Eng. 82 (1960).
    """
    f, g = np.eye(4), np.zeros((4, 2))
    f[:2, 2:], g[:2], g[2:] = noise.dt * np.eye(2), 0.5 * noise.dt**2 * np.eye(2), noise.dt * np.eye(2)
    states, deviations, surprise = [x], [np.sqrt(np.diag(p))], 0.0
    for push, values in zip(turning[:-1], measured[1:], strict=True):
        x, p = f @ x + g @ push, f @ p @ f.T + noise.process
        h = np.eye(4)[~np.isnan(values)]
        off, covariance = values[~np.isnan(values)] - h @ x, h @ p @ h.T + h @ np.diag(noise.variances) @ h.T
        gain = p @ h.T @ np.linalg.inv(covariance)
        surprise += off @ np.linalg.solve(covariance, off)
        x, p = x + gain @ off, (np.eye(4) - gain @ h) @ p
        states.append(x)
        deviations.append(np.sqrt(np.diag(p)))
    return np.array(states), np.array(deviations), surprise


def test_states_deviations_and_innovations_are_those_of_the_matrices():
    """Values one after another are all at once, as their errors are independent; some are missing."""
    random = np.random.default_rng(12)
    push = np.vstack([np.eye(2) * DT**2 / 2, np.eye(2) * DT])
    noise = TiltNoise(DT, push @ np.array([[0.5, 0.1], [0.1, 0.3]]) @ push.T, np.array([1e-4, 2e-4, 3e-3, 4e-3]))
    turning, measured = random.normal(0.0, 1.0, (SAMPLES, 2)), random.normal(0.0, 0.1, (SAMPLES, 4))
    measured[random.uniform(size=measured.shape) < 0.3] = np.nan
    root = random.normal(0.0, 0.05, (4, 4))
    x, p, kept = random.normal(0.0, 0.1, 4), root @ root.T, np.empty((2, SAMPLES, 4))
    states, deviations, squares = by_the_book(x.copy(), p.copy(), turning, measured, noise)
    surprise, used = march(x, p, turning, measured, noise, np.zeros((5, 4)), kept)
    assert kept[0] == pytest.approx(states, rel=1e-9, abs=1e-11)
    assert kept[1] == pytest.approx(deviations, rel=1e-9)
    assert surprise == pytest.approx(squares, rel=1e-9) and used == np.isfinite(measured[1:]).sum()


@pytest.fixture(scope="module")
def measurement():
    """A car, hub forces that turn it to and fro, and rates that are the integrals of their moments, a little off."""
    car, random = r19(), np.random.default_rng(3)
    forces = HubForces(random.normal(0.0, 200.0, (SAMPLES, 24)), DT, "body")
    turning = np.linalg.solve(rigid_vehicle(car).inertia, rigid_vehicle(car).moments(forces.samples).T).T[:, :2]
    rates = np.vstack([np.zeros(2), np.cumsum(turning[1:] + turning[:-1], axis=0) * DT / 2.0])
    tilts = np.vstack([np.zeros(2), np.cumsum(rates[1:] + rates[:-1], axis=0) * DT / 2.0])
    angles = np.hstack([tilts, rates]) + random.normal(0.0, 1e-3, (SAMPLES, 4))
    return car, forces, turning, MeasuredAngles(angles, DT)


def test_the_filter_of_a_measurement_has_the_moments_and_deviations_of_its_vehicle(measurement):
    car, forces, turning, angles = measurement
    stated = StatedDeviations(np.full(24, 8.0), (2e-3, 3e-3), 0.7)
    push = np.vstack([np.eye(2) * DT**2 / 2, np.eye(2) * DT])
    variances = np.repeat([2e-3, 3e-3], 2) ** 2
    shaken = rigid_vehicle(car).turning(stated.forces)[:2, :2] + 0.49 * np.eye(2)
    noise = TiltNoise(DT, push @ shaken @ push.T, variances)
    first = angles.samples[0].copy(), np.diag(variances)
    states, deviations, squares = by_the_book(*first, turning, angles.samples, noise)
    tilt = estimate_tilt(car, forces, angles, stated)
    assert tilt.states == pytest.approx(states, rel=1e-9, abs=1e-12) and tilt.period == DT
    assert tilt.deviations == pytest.approx(deviations, rel=1e-9)
    assert tilt.normalised_innovation == pytest.approx(squares / (4 * (SAMPLES - 1)), rel=1e-9)
    whole = TiltFilter(car, forces.frame, DT, stated)
    assert whole.advance(forces.samples, angles.samples)[0] == pytest.approx(states, rel=1e-9, abs=1e-12)
    assert whole.normalised_innovation == pytest.approx(tilt.normalised_innovation, rel=1e-12)


def test_biases_are_means_of_the_innovations_with_fewer_of_them_where_they_hang_together(measurement):
    """Of 4 innovations 3, 1, -1, 3: mean 1.5, variance 5 - 2.25, and products of neighbours 3 - 1 - 3 by 20."""
    car, forces, *_ = measurement
    whole = TiltFilter(car, forces.frame, DT, StatedDeviations(np.full(24, 8.0), (2e-3, 3e-3), 0.7))
    whole.state.sums[:] = np.array([4.0, 6.0, 20.0, 5.0, 0.0])[:, None]
    mean, error = whole.innovation_biases()
    assert mean == pytest.approx([1.5] * 4, rel=1e-12)
    assert error == pytest.approx([np.sqrt(2.75 * 1.25 / 0.75 / 4.0)] * 4, rel=1e-12)


def test_a_slope_is_taken_off_and_nothing_else():
    line = np.linspace(-1.0, 1.0, 9)
    left = _without_slope(np.column_stack([2.5 * line + line**2, -0.5 * line + 0.25]))
    assert left == pytest.approx(np.column_stack([line**2, 0.25 + 0.0 * line]), abs=1e-14)


def test_what_pulls_to_the_estimate_is_a_spring_and_a_damper_of_its_bandwidth(measurement):
    """I wc^2 and 2 0.7 I wc of roll and pitch; between samples the guide goes along lines."""
    car, forces, _, angles = measurement
    tilt = estimate_tilt(car, forces, angles, StatedDeviations(np.full(24, 8.0), (2e-3, 3e-3), 0.7))
    given = inputs_with_moments(HubInputs(np.ones((5, 24))), car, tilt, DT, 0.35)
    roll, pitch, _ = np.diag(rigid_vehicle(car).inertia)
    corner = 2.0 * np.pi * 0.35
    stiff = (roll * corner**2, 1.4 * roll * corner, pitch * corner**2, 1.4 * pitch * corner)
    assert given.pull == pytest.approx(stiff, rel=1e-12)
    between = [tilt.states[0], 0.5 * (tilt.states[0] + tilt.states[1]), tilt.states[1]]
    assert given.guide[:3, :4] == pytest.approx(np.array(between), rel=1e-9)
    assert given.hubs.tolist() == np.ones((5, 24)).tolist()
