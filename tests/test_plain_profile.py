"""A wheel's profile on its rail against plain numpy, both wheels at random poses, one patch and several."""

import numpy as np
import pytest

from models.rail.laid_profiles import Profiles, laid_profile
from models.rail.profile_contact import TOUCH, Pose, pressed, profile_on_rail
from validation.contact import plain_profile as plain

pytestmark = pytest.mark.grounds("plain counterpart")
RADIUS, MODULUS = 0.46, 1.13e11
SHIFTS = (0.0, 3e-3, 5e-3, -5e-3, 7e-3, -9e-3)
DEEP = 2e-10
"""m, of depths of some 1e-4 m: six sweeps leave less than 1e-11 of the patches' pushes."""


@pytest.mark.parametrize("side", [1, -1])
def test_touches_at_random_poses(side):
    profiles, draw, several = Profiles(), np.random.default_rng(1), 0
    profile = laid_profile(profiles, RADIUS)
    touches = np.zeros(int(profile.head[0].zones), TOUCH)
    for shift in SHIFTS:
        z, roll = profiles.touching(RADIUS, shift)
        for _ in range(4):
            pose = Pose(shift, z + draw.uniform(4e-5, 1.5e-4), roll + draw.normal(0.0, 2e-5), draw.uniform(-0.02, 0.02))
            profile_on_rail(side, pose, profile, MODULUS, touches)
            expected = plain.touches_of(side, pose, profile, MODULUS)
            assert touches["depth"] == pytest.approx(expected["depth"], abs=DEEP)
            for name in ("n_y", "n_z", "x", "y", "z"):
                assert touches[name] == pytest.approx(expected[name], abs=1e-11), name
            for name in ("along", "across"):  # the second from a variance, less a square a thousand times as large
                assert touches[name] == pytest.approx(expected[name], rel=1e-8), name
            several += np.count_nonzero(touches["depth"] > 0.0) > 1
    assert 3 <= several <= 20


def test_force_and_axes_of_a_touch():
    draw = np.random.default_rng(2)
    for depth, along, across in 10.0 ** draw.uniform((-6.0, 0.0, 0.0), (-4.0, 2.0, 2.0), (10, 3)):
        assert pressed(depth, along, across, MODULUS) == pytest.approx(
            plain.pressed(depth, along, across, MODULUS), rel=1e-10
        )
    assert pressed(0.0, 1.0, 2.0, MODULUS) == pressed(-1e-5, 1.0, 2.0, MODULUS) == (0.0, 0.0, 0.0)
