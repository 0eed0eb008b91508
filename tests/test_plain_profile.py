"""A wheel's profile on its rail against plain numpy, both wheels at random poses, one patch and several."""

import numpy as np
import pytest

from models.rail.laid_profiles import CrossSections, laid_profile
from models.rail.profile_contact import (
    _SUMS,
    TOUCH_RECORD,
    WHEEL_NODE_RECORD,
    WheelPose,
    _add_node,
    normal_force_and_axes,
    profile_on_rail,
)
from validation.contact import plain_profile as plain

pytestmark = pytest.mark.grounds("plain counterpart")
RADIUS, MODULUS = 0.46, 1.13e11
SHIFTS = (0.0, 3e-3, 5e-3, -5e-3, 7e-3, -9e-3)
DEEP = 2e-10
"""m, of depths of some 1e-4 m: six sweeps leave less than 1e-11 of the patches' pushes."""


@pytest.mark.parametrize("side", [1, -1])
def test_touches_at_random_poses(side):
    profiles, draw, several = CrossSections(), np.random.default_rng(1), 0
    profile = laid_profile(profiles, RADIUS)
    touches = np.zeros(int(profile.head[0].zones), TOUCH_RECORD)
    for shift in SHIFTS:
        z, roll = profiles.first_touch_pose(RADIUS, shift)
        for _ in range(4):
            pose = WheelPose(
                shift, z + draw.uniform(4e-5, 1.5e-4), roll + draw.normal(0.0, 2e-5), draw.uniform(-0.02, 0.02)
            )
            profile_on_rail(side, pose, profile, MODULUS, touches)
            expected = plain.contacts_of_wheel(side, pose, profile, MODULUS)
            assert touches["depth"] == pytest.approx(expected["depth"], abs=DEEP)
            for name in ("n_y", "n_z", "x", "y", "z"):
                assert touches[name] == pytest.approx(expected[name], abs=1e-11), name
            for name in ("along", "across"):  # the second from a variance, less a square a thousand times as large
                assert touches[name] == pytest.approx(expected[name], rel=1e-8), name
            several += np.count_nonzero(touches["depth"] > 0.0) > 1
    assert 3 <= several <= 20


def test_a_node_between_two_zones_adds_to_both():
    """A factor common to all sums would leave every mean: here they are told. Depth 2e-5 m, slope 3/4, zone 1.3."""
    node, sums = np.array([(0.01, 0.45, 0.0, 1.3)], WHEEL_NODE_RECORD), np.zeros(3, _SUMS)
    at = 2e-5, 1e-3, 0.7, 0.44, 0.75, 4
    for _ in range(2):
        _add_node(node[0], at, 0.02, sums)
    for zone, share in ((0, 0.0), (1, 0.7), (2, 0.3)):
        each = np.array([1.0, 2e-5, 0.02, 4e-4, -0.6, 0.8, 1e-3, 0.7, 0.44, 0.45])
        assert sums[zone].tolist() == pytest.approx(2.0 * share * 4e-10 * each, rel=1e-12, abs=0.0)


def test_force_and_axes_of_a_touch():
    draw = np.random.default_rng(2)
    for depth, along, across in 10.0 ** draw.uniform((-6.0, 0.0, 0.0), (-4.0, 2.0, 2.0), (10, 3)):
        assert normal_force_and_axes(depth, along, across, MODULUS) == pytest.approx(
            plain.hertz_force(depth, along, across, MODULUS), rel=1e-10
        )
    assert (
        normal_force_and_axes(0.0, 1.0, 2.0, MODULUS)
        == normal_force_and_axes(-1e-5, 1.0, 2.0, MODULUS)
        == (0.0, 0.0, 0.0)
    )
