"""A road's filter over a length of road, by its exact transition: many decays of its fastest part at once, too."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from models.ride.road_path import _transition_over

F, G = np.array([[-0.02, 1.0], [0.0, -200.0]]), np.array([[0.0], [1.0]])


@pytest.mark.parametrize("length", [0.01, 0.1, 0.3, 1.0, 2.0])
def test_noise_over_a_length_is_what_the_stationary_road_loses(length):
    stationary = solve_continuous_lyapunov(F, -G @ G.T)
    move, root = _transition_over(F, G, length)
    assert root @ root.T == pytest.approx(stationary - move @ stationary @ move.T, rel=1e-9)
