"""Ride and the pitch plane by the free vehicles' builder: the same accelerations, with none of today's own springs."""

from unittest.mock import patch

import pytest

from models.engines.assembly import Settings
from models.engines.spatial_protocol import build
from validation.price import one_builder
from validation.price.one_builder import STEP, pitch_plane_builds, ride_builds, ride_vehicle, single_tree_context

INSTANT = 1e-12
"""By the largest acceleration of a state: no more than rounding, as the law is the same."""


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
@pytest.mark.parametrize("system", [ride_builds, pitch_plane_builds])
def test_the_free_builder_moves_both_as_their_own_builders(system, engine):
    assert system(engine).gap(10) < INSTANT


def test_an_axis_that_turns_with_its_body_is_noticed():
    with patch.object(
        one_builder, "AXIS_JOINT", one_builder.FIRST_BODY
    ):  # the axis keeps to the body of the second end
        assert ride_builds("mujoco").gap(2) > 1e-4


def test_in_exudyn_it_would_take_every_spring_from_the_engine():
    """Ride has the ground, 6 trees, 2 sliders, 19 springs and the tyres; the free builder the ground and one tree."""
    sides = ride_builds("exudyn")
    assert sides.free_model.plan()["native items"] == 2
    assert sides.system_model.plan()["native items"] == 29
    settings = Settings("RK44", STEP, STEP)
    with single_tree_context():
        joined = one_builder.TwoBuilds(build("exudyn", ride_vehicle(), settings), sides.free_model)
    assert joined.gap(5) < INSTANT
    assert joined.system_model.plan()["native items"] < sides.system_model.plan()["native items"]
