"""Loops of bare scenes make no arrays, and the count that says so sees one that is made."""

import pytest

from models.rail.wheel_forces import WheelForcesWorkspace, rails_of, workspace_for
from models.rail.wheelset import CHOSEN_WHEELSET
from validation.absence.machinery import allocated_arrays, ratio_of_wheelsets, rows


def test_loops_of_bare_scenes_make_no_arrays():
    assert [(row.id, row.reason) for row in rows() if row.status in ("failed", "not run")] == []


def test_an_array_that_is_made_is_counted():
    profile = rails_of(CHOSEN_WHEELSET).profile
    assert allocated_arrays(lambda: [workspace_for(profile) for _ in range(10)]) >= 10 * len(
        WheelForcesWorkspace._fields
    )  # each call has six


@pytest.mark.full
def test_the_wheelset_written_by_hand_moves_as_the_bare_one():
    gap, _ = ratio_of_wheelsets(200, 1)
    assert gap < 1e-11  # the same operations in the same order give 0
