"""What a scene of braking does not name is not there, and what it names is all that changes."""

import pytest

from validation.absence.braking import ALONE, EFFECTS, changes, counted, rows

OF_A_PROCESS = ("imported", "compiled")
"""Counts that only a fresh process tells; the test of the rows runs one."""


@pytest.fixture(scope="module")
def bare():
    """Counts and path of the scene without effects."""
    return counted({})


def test_a_bare_scene_is_made_of_no_effect(bare):
    assert changes(ALONE, {**bare[0], **{key: [] for key in OF_A_PROCESS}}) == {}


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_changes_what_it_declares_and_a_port_alone_not_a_bit(name, bare):
    says, declared = EFFECTS[name]
    found, path = counted(says)
    kept = [{key: value for key, value in one.items() if key not in OF_A_PROCESS} for one in (found, declared)]
    assert changes(ALONE, kept[0]) == kept[1]
    assert (path == bare[1]) == (name == "port")


@pytest.mark.full
def test_nothing_that_is_absent_is_imported_or_compiled():
    assert [(row.id, row.reason) for row in rows() if row.status != "passed"] == []
