"""The work-precision problem of an anti-lock stop, small: from 2 m/s, the wet road after 0.3 m."""

import numpy as np
import pytest

from models.advice.price import runner as cost
from models.engines.braking import EngineChassis
from models.systems.braking.march import BrakedVehicle
from models.tyre.tyre_table import stacked_tables
from validation.braking.quarter_stops import FRONT_WHEEL
from validation.price.problems import braking_stop
from validation.price.problems.braking_stop import (
    EULER,
    EXACT_WHEEL_METHOD,
    FULL_SUBSTEPS,
    LITERAL,
    QUICK_SUBSTEPS,
    RK4,
    BrakingStop,
    ReplayedController,
)


@pytest.fixture(scope="module")
def short():
    """The quick problem from a low speed, of which it takes half, its reference loose."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(braking_stop, "SPEED", 4.0)
        patch.setattr(braking_stop, "SURFACE_CHANGE", 1.2)
        patch.setattr(braking_stop, "REFERENCE_SOLVERS", {True: (("DOP853", 1e-8), ("LSODA", 1e-8))})
        yield BrakingStop(True)


@pytest.mark.parametrize(("method", "bound"), [(EXACT_WHEEL_METHOD, 1e-6), (RK4, 1e-6), (EULER, 1e-4), (LITERAL, 1e-3)])
def test_every_scheme_comes_to_the_reference(short, method, bound):
    """At 64 steps to a sample, of a distance of 1 m or so."""
    found = cost.attempt(short, short.setting("reference", method, 5.5e-3 / 64))
    assert found.status == "ok" and found.errors["stopping distance"] < bound


def test_the_reference_knows_itself_and_where_friction_changes(short, monkeypatch):
    assert short.uncertainty["stopping distance"] < 1e-6
    monkeypatch.setattr(short, "change", 0.31)
    moved = abs(short._distance_by_scipy("DOP853", 1e-8) - short.true)
    assert moved > 1e-5, "ten times the bound of the exact wheel: that test sees a change that is 1 cm off"


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_an_engine_that_carries_the_chassis_gives_the_digits_of_the_exact_wheel(short, engine):
    """What the problem's note says: rounding of some hundred steps of 10 mm, 1e-14 m each."""
    stop = BrakedVehicle(
        FRONT_WHEEL.plane,
        np.zeros(1, dtype=np.int64),
        stacked_tables(short._tables),
        1.0,
        short._road,
        short._brakes,
        short._chambers,
        np.zeros(1),
        substeps=2,
        engine=EngineChassis(engine, FRONT_WHEEL.plane),
    )
    path = stop.run(ReplayedController(short.valves), 2.0)
    assert path.ended_at_rest and path.states[-1, 0, 0] == pytest.approx(short._stop_by_twinrig(2).distance, abs=1e-12)


def test_a_step_is_the_longest_that_divides_a_sample(short):
    assert short.setting("reference", EXACT_WHEEL_METHOD, 1.2e-3).value == pytest.approx(5.5e-3 / 5)
    assert all(set(QUICK_SUBSTEPS[method]) <= set(FULL_SUBSTEPS[method]) for method in FULL_SUBSTEPS)
