"""The work-precision problem of an anti-lock stop, small: from 2 m/s, the wet road after 0.3 m."""

import pytest

from validation.price import runner as cost
from validation.price.problems import braking_stop
from validation.price.problems.braking_stop import EULER, FULL, LITERAL, OURS, QUICK, RK4, BrakingStop


@pytest.fixture(scope="module")
def short():
    """The problem from a low speed, its reference loose."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(braking_stop, "SPEED", 2.0)
        patch.setattr(braking_stop, "CHANGE", 0.3)
        patch.setattr(braking_stop, "SOLVERS", {True: (("DOP853", 1e-8), ("LSODA", 1e-8))})
        yield BrakingStop(True)


@pytest.mark.parametrize(("method", "bound"), [(OURS, 1e-6), (RK4, 1e-6), (EULER, 1e-4), (LITERAL, 1e-3)])
def test_every_scheme_comes_to_the_reference(short, method, bound):
    """At 64 steps to a sample, of a distance of 1 m or so."""
    found = cost.attempt(short, short.setting("reference", method, 5.5e-3 / 64))
    assert found.status == "ok" and found.errors["stopping distance"] < bound


def test_the_reference_knows_itself_and_where_friction_changes(short, monkeypatch):
    assert short.uncertainty["stopping distance"] < 1e-6
    monkeypatch.setattr(braking_stop, "CHANGE", 0.31)
    moved = abs(short._by("DOP853", 1e-8) - short._true)
    assert moved > 1e-5, "ten times the bound of the exact wheel: that test sees a change that is 1 cm off"


def test_a_step_is_the_longest_that_divides_a_sample(short):
    assert short.setting("reference", OURS, 1.2e-3).value == pytest.approx(5.5e-3 / 5)
    assert all(set(QUICK[method]) <= set(FULL[method]) for method in FULL)
