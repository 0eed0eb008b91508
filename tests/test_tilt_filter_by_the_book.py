"""The compiled Kalman filter of roll and pitch held to the textbook's matrices, all values of a sample at once."""

import numpy as np
import pytest

from models.systems.hub_forces.tilt_march import Noise, march

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
    noise = Noise(DT, push @ np.array([[0.5, 0.1], [0.1, 0.3]]) @ push.T, np.array([1e-4, 2e-4, 3e-3, 4e-3]))
    turning, measured = random.normal(0.0, 1.0, (SAMPLES, 2)), random.normal(0.0, 0.1, (SAMPLES, 4))
    measured[random.uniform(size=measured.shape) < 0.3] = np.nan
    root = random.normal(0.0, 0.05, (4, 4))
    x, p, kept = random.normal(0.0, 0.1, 4), root @ root.T, np.empty((2, SAMPLES, 4))
    states, deviations, squares = by_the_book(x.copy(), p.copy(), turning, measured, noise)
    surprise, used = march(x, p, turning, measured, noise, np.zeros((5, 4)), kept)
    assert kept[0] == pytest.approx(states, rel=1e-9, abs=1e-11)
    assert kept[1] == pytest.approx(deviations, rel=1e-9)
    assert surprise == pytest.approx(squares, rel=1e-9) and used == np.isfinite(measured[1:]).sum()
