"""Planted faults: every one is caught, none is left behind, and nothing is seen where there is none.

The full case of the report is measured once, as a slow and busy machine does, and every full test reads its answer.
"""

import numpy as np
import pytest
import slow_machine

from models.engines import exudyn, mujoco, reference
from models.vehicles import pitch_plane_equations as equations
from validation.cases import planted_faults
from validation.common import checks
from validation.faults import pitch_plane as case
from validation.faults.bench import CHECKS, Bench, size_of_error
from validation.faults.planting import CONTROLS_WITHOUT_FAULT, FAULTS, planted_builder


@pytest.fixture(scope="module")
def full_case(elsewhere, tmp_path_factory):
    """Every fault of every system: id, status and reason of all rows, and the data."""
    return elsewhere(slow_machine.answer, "planted_faults", False, tmp_path_factory.mktemp("planted_faults"))


@pytest.fixture(scope="module")
def measured(full_case):
    """Every fault of the pitch plane."""
    return full_case[1]["pitch-plane"]


@pytest.fixture(scope="module")
def found(measured):
    return {record["fault"]: record for record in measured["faults"]}


def fault(name):
    return next(fault for fault in FAULTS if fault.name == name)


def test_there_are_enough_and_each_has_a_name_of_its_own():
    assert len(FAULTS) >= 16
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)


@pytest.mark.parametrize("own", planted_faults.FAULT_CAMPAIGNS, ids=lambda own: own.id)
def test_what_a_fault_changes_is_there(own):
    """What it is planted in has not been renamed since; the full campaigns run it."""
    for each in own.faults:
        with each.patch()():
            pass


@pytest.mark.parametrize("own", planted_faults.FAULT_CAMPAIGNS, ids=lambda own: own.id)
def test_a_campaign_has_several_faults_with_names_of_their_own(own):
    assert len({(fault.planted_in, fault.name) for fault in own.faults}) == len(own.faults) >= 6


@pytest.mark.full
@pytest.mark.parametrize("id", ["planted", *(own.id for own in planted_faults.FAULT_CAMPAIGNS)])
def test_every_fault_is_caught_and_nothing_else(id, full_case):
    """planted : rows of the pitch plane and of all systems together; the others are those of a campaign."""
    statuses = {row: (status, reason) for row, status, reason in full_case[0] if row.rpartition(".")[0] == id}
    assert {f"{id}.caught", f"{id}.false_alarms"} <= {*statuses}
    assert {row: reason for row, (status, reason) in statuses.items() if status in ("failed", "not run")} == {}


@pytest.mark.full
def test_no_other_row_of_the_full_case_fails(full_case):
    assert [(row, reason) for row, status, reason in full_case[0] if status in ("failed", "not run")] == []


@pytest.mark.full
def test_one_table_has_the_faults_of_all_systems(full_case):
    whole, *_ = planted_faults.tables(full_case[1])
    assert len(whole.rows) >= 120 and len({line[0] for line in whole.rows}) >= 6
    assert all(line[3] != "none" for line in whole.rows)
    assert sum(line[4] != "" for line in whole.rows) > len(whole.rows) / 2  # no one check would do


def test_the_quick_share_plants_in_every_system_and_says_of_how_many(tmp_path):
    rows, data = planted_faults.measure(True, tmp_path)
    assert [row.reason for row in rows if row.status in ("failed", "not run")] == []
    assert set(data) == {"pitch-plane", *(own.id for own in planted_faults.FAULT_CAMPAIGNS)}
    assert all(len(data[own.id]) > 1 for own in planted_faults.FAULT_CAMPAIGNS)
    assert "2 of 47 were planted" in next(row.why for row in rows if row.id == "planted.caught")


@pytest.mark.full
def test_every_fault_is_caught_in_every_engine_that_has_it(found):
    assert [name for name, record in found.items() if not case.is_caught(record)] == []


@pytest.mark.full
def test_the_symmetric_vehicle_hides_exactly_what_symmetry_says(found):
    assert {name for name, record in found.items() if not case.is_caught(record, case.SYMMETRIC_SET)} == set(
        case.HIDDEN_BY_SYMMETRY
    )


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "blind"),
    [
        ("road held at the middle stages", "audit"),  # an acceleration knows no stage
        ("start from zero heave", "audit"),  # states are given to it
        ("held sample of the step's end", "linear twin"),
        ("front suspension 1 % too stiff", "momentum"),  # inner forces cancel
        ("pitch inertia about the front axle", "equilibrium"),  # nothing moves
        ("wheel forces in kN", "road twin"),
    ],
)
def test_no_check_is_enough_alone(found, name, blind):
    assert not case.is_seen(found[name], blind)
    assert case.is_caught(found[name])


def test_a_late_read_or_a_held_stage_loses_three_orders():
    """Runge-Kutta of order 4 falls to 1; the check sees the difference of 3."""
    bench = Bench("asymmetric_twin", 0.1)
    loss = size_of_error(
        CHECKS["order"], bench, "mujoco", planted_builder(fault("road held at the middle stages"), "mujoco")
    )
    assert loss == pytest.approx(3.0, abs=0.2)


def test_a_fault_lives_only_while_its_model_works():
    watched = [
        (exudyn.SignalClock, "advance"),
        (exudyn.SignalClock, "reader"),
        (exudyn.ExudynModel, "_enforced"),
        (mujoco, "specification"),
        (mujoco, "_add_suspension"),
        (mujoco, "_guidance_forces"),
        (equations, "suspension_forces"),
        (equations, "newton_euler"),
        (reference, "njit"),
        (reference, "_FIXED"),
    ]
    before = [getattr(owner, name) for owner, name in watched]
    bench = Bench("asymmetric_twin", 0.02)
    for own in FAULTS:
        for engine in own.engines:
            model = planted_builder(own, engine)(bench.road, bench.settings(engine))
            assert [getattr(owner, name) for owner, name in watched] == before, own.name
            model.acceleration(0.01, np.zeros(4), np.zeros(4))
    assert [getattr(owner, name) for owner, name in watched] == before


def test_interpreted_equations_are_the_compiled_ones():
    """Faults in the equations are planted into the interpreted reference: without one it is the same to rounding."""
    bench = Bench("asymmetric_twin", 0.1)
    assert (
        size_of_error(CHECKS["road twin"], bench, "reference", planted_builder(CONTROLS_WITHOUT_FAULT[1], "reference"))
        <= 1e-15
    )


def test_a_run_that_fails_is_infinitely_far():
    bench = Bench("itwm_drift", 0.1)

    def refuses(assembly, settings):
        raise checks.RunFailed("nobody", "refused")

    assert checks.trajectory_gap(refuses, bench.road, bench.settings("exudyn")) == float("inf")
    assert size_of_error(CHECKS["audit"], bench, "exudyn", refuses) == float("inf")


@pytest.mark.full
def test_tables_name_every_fault_and_every_check(measured):
    checks_table, faults_table = case.tables(measured)
    assert [line[0] for line in checks_table.rows] == list(CHECKS)
    assert [line[0] for line in faults_table.rows] == [fault.name for fault in FAULTS]
    assert all(line[2] for line in faults_table.rows), "each is caught by something"


@pytest.mark.full
def test_figure_draws_from_saved_data(measured):
    ((caption, figure),) = case.draw(measured)
    assert "5 faults" in caption
    figure.canvas.draw()
