"""Every hard case in every implementation, and proof that each family can find a fault."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from control import lyap

from models.core import signals
from models.engines import exudyn as exudyn_engine
from models.engines import protocol, stability
from models.rail import equations
from models.rail.equations import WheelsetEquations
from models.ride import covariance, marginal
from models.systems.pitch_plane.effects import contact_points as contact_effect
from models.systems.pitch_plane.effects import lift_off
from models.vehicles import pitch_plane
from validation.cases import hard_cases
from validation.hard_cases import (
    CASE_FAMILIES,
    cases_by_family,
    catalogue,
    contact_points,
    extremes,
    invariants,
    lifting,
    prescribed_pitch,
    ride,
    rolling,
    sampled_input,
    stepping,
)
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase, judge

ALL = tuple(case for _, case in cases_by_family())
QUICK = {case.name for _, case in hard_cases.cases_of_quick_run(cases_by_family())}
JUDGED = [
    pytest.param(case, name, id=f"{case.name}-{name}")
    for case in ALL
    if case.name in QUICK
    for name in case.judged_engines()
]
"""The quick share; all of them are rows of the full case ``hard_cases`` of tests/test_cases.py."""


@pytest.mark.parametrize(("case", "implementation"), JUDGED)
def test_outcome(case, implementation, tmp_path):
    outcome = judge(case, implementation, tmp_path)
    assert outcome.word == case.wanted_outcome(implementation), (outcome.error, case.tolerance, outcome.message)


def test_there_are_enough_cases_with_names_of_their_own():
    names = Counter(case.name for case in ALL)
    assert len(names) >= 14 and set(names.values()) == {1}
    assert all(case.tolerance_reason and case.difficulty and case.exact_answer for case in ALL)


def found(module, name: str, implementation: str, folder) -> str:
    """Outcome of one case of a family."""
    return judge(next(case for case in module.CASES if case.name == name), implementation, folder).word


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_without_the_step_check_a_short_unstable_run_is_silent(implementation, monkeypatch, tmp_path):
    monkeypatch.setattr(protocol, "check_step", lambda *_: None)
    assert found(stepping, "stiff damper, step just beyond the limit", implementation, tmp_path) == "SILENT"


def test_without_the_guard_a_huge_run_is_silent(monkeypatch, tmp_path):
    monkeypatch.setattr(exudyn_engine, "check_trajectory", lambda *_, **__: None)
    assert found(stepping, "finite but huge states", "exudyn", tmp_path) == "SILENT"


def test_a_clock_that_keeps_its_last_sample_is_found(monkeypatch, tmp_path):
    class Stale(exudyn_engine.SignalClock):
        def __setattr__(self, name, value):
            if not (name == "step" and value == 0 and getattr(self, "step", 0) > 0):
                super().__setattr__(name, value)

    monkeypatch.setattr(exudyn_engine, "SignalClock", Stale)
    assert found(stepping, "repeated run", "exudyn", tmp_path) == "SILENT"


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_a_sample_read_one_late_is_found(implementation, monkeypatch, tmp_path):
    right = signals._sample_and_fraction

    def late(*grid):
        index, part = right(*grid)
        return np.maximum(index - 1, 0), part

    monkeypatch.setattr(signals, "_sample_and_fraction", late)
    assert found(sampled_input, "replay of a ramp", implementation, tmp_path) == "SILENT"


def test_a_contact_point_that_forgets_its_past_is_found(monkeypatch, tmp_path):
    monkeypatch.setattr(contact_effect, "_start_compressions", lambda particular, first, period, tau: particular[0])
    assert found(contact_points, "contact point along an adaptive run", "exudyn", tmp_path) == "SILENT"


def test_without_the_balance_a_noisy_multiplier_is_silent(monkeypatch, tmp_path):
    monkeypatch.setattr(exudyn_engine, "check_balance", lambda *_: None)
    assert found(prescribed_pitch, "noise of 1e-6 rad on the pitch", "exudyn", tmp_path) == "SILENT"


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_an_equilibrium_off_by_a_micrometre_is_found(implementation, monkeypatch, tmp_path):
    right = pitch_plane.equilibrium
    monkeypatch.setattr(pitch_plane, "equilibrium", lambda p, geometry: right(p, geometry) + 1e-6 * np.eye(8)[2])
    assert found(invariants, "static equilibrium", implementation, tmp_path) == "SILENT"


def test_without_the_growth_check_an_undamped_run_is_silent(monkeypatch, tmp_path):
    monkeypatch.setattr(stability, "ALLOWED_GROWTH", np.inf)
    assert found(extremes, "no damping, first order", "exudyn", tmp_path) == "SILENT"


def test_a_refinement_that_takes_a_solution_for_symmetric_is_silent(monkeypatch, tmp_path):
    def askew(A, Q):
        P = lyap(A, Q, method="scipy").astype(np.longdouble)
        for _ in range(covariance.MOST_REFINEMENTS):
            half = A.astype(np.longdouble) @ P
            left = lyap(A, (half + half.T + Q).astype(float), method="scipy")
            P = P + left
        return P, left, 0.0

    monkeypatch.setattr(covariance, "lyapunov_solution", askew)
    assert found(ride, "next to no damping", "reference", tmp_path) == "SILENT"


def test_without_sizes_of_their_own_road_states_hide_an_undamped_motion(monkeypatch, tmp_path):
    def balanced(A):
        form, (scale, _) = marginal.matrix_balance(A, permute=False, separate=True)
        return form, scale, float(np.linalg.norm(form, 2))

    undamped = marginal._growth_by_undamped
    monkeypatch.setattr(marginal, "_balanced_matrix", balanced)
    monkeypatch.setattr(marginal, "_growth_by_undamped", lambda *own: undamped(*own[:-1], np.inf))
    assert found(ride, "no damping, road that next to walks", "reference", tmp_path) == "SILENT"


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_without_its_check_a_step_that_jumps_over_landings_is_silent(implementation, monkeypatch, tmp_path):
    monkeypatch.setattr(protocol, "check_resolved", lambda *_: None)
    assert found(lifting, "tyres of 20 kN/mm, step of 2 ms", implementation, tmp_path) == "SILENT"


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_tyres_that_pull_are_found(implementation, monkeypatch, tmp_path):
    monkeypatch.setattr(lift_off, "extend", lambda assembly, p: assembly)
    assert found(lifting, "both wheels in the air", implementation, tmp_path) == "SILENT"


@pytest.mark.parametrize("implementation", IMPLEMENTATIONS)
def test_a_hard_landing_is_silent_without_both_checks_that_see_it(implementation, monkeypatch, tmp_path):
    monkeypatch.setattr(WheelsetEquations, "check_loads", lambda *_: None)
    assert found(rolling, "step too large for a landing", implementation, tmp_path) == "raised"
    monkeypatch.setattr(equations, "check_resolved", lambda *_: None)
    assert found(rolling, "step too large for a landing", implementation, tmp_path) == "SILENT"


def broken(engine, folder):
    """Bug in a case, not an outcome."""
    raise KeyError("no outcome")


def test_a_bug_is_no_outcome(tmp_path):
    case = HardCase("", "", "", "", 0.0, "", broken)
    with pytest.raises(KeyError):
        judge(case, "reference", tmp_path)


def test_not_a_number_is_silent(tmp_path):
    case = HardCase("", "", "", "", 1.0, "", lambda engine, folder: np.nan)
    assert judge(case, "reference", tmp_path).word == "SILENT"


def test_a_silent_case_fails_its_row_and_the_total(monkeypatch, tmp_path):
    cases = (
        HardCase(
            "bad", "hard", "check", "m", 1.0, "why", lambda engine, folder: 2.0, naive_result=lambda folder: "worse"
        ),
    )
    monkeypatch.setattr(hard_cases, "cases_by_family", lambda: tuple(("bad", case) for case in cases))
    rows, data = hard_cases.measure(True, tmp_path)
    assert [row.status for row in rows] == ["failed"] * 6
    assert next(row for row in rows if row.id == "hard.silent").value == 3
    of_numbers, counts, table = hard_cases.tables(data)
    assert len(of_numbers.rows) == 54 and "missing" in of_numbers.rows[0][2]
    assert counts.rows[-1] == ("all", "1 of 1", "0", "0", "0", "3")
    assert table.rows[0][3:] == ("SILENT, 2.0e+00",) * 3 + ("worse",)


def test_every_file_of_the_folder_is_a_family_in_the_table():
    files = {path.stem for path in Path(invariants.__file__).parent.glob("*.py")}
    assert set(CASE_FAMILIES) == files - {"__init__", "case", "catalogue", "setups"} and len(CASE_FAMILIES) >= 25


def test_the_quick_share_has_cases_of_every_family():
    known = cases_by_family()
    own = hard_cases.cases_of_quick_run(known)
    assert {family for family, _ in own} == set(CASE_FAMILIES) and all(pair in known for pair in own)
    assert len(own) <= len(CASE_FAMILIES) + len(known) / hard_cases.QUICK_CASE_SPACING


def test_every_number_of_the_catalogue_has_its_cases():
    assert list(catalogue.COVERED_CLASSES) == list(range(1, 55))
    assert all(names for _, names in catalogue.COVERED_CLASSES.values())
    assert catalogue.missing_cases({case.name for case in ALL}) == []
    assert catalogue.missing_cases(set()) != []


def test_there_are_eighty_cases_without_the_measurement_files():
    assert (
        sum(family not in hard_cases.FAMILIES_OF_FILES for family, _ in cases_by_family())
        >= hard_cases.FEWEST_CASE_COUNT
    )


def test_a_refusal_that_is_wanted_passes_its_row_also_where_no_implementation_has_a_part():
    case = HardCase(
        "odd",
        "hard",
        "check",
        "",
        0.0,
        "why",
        broken,
        dict.fromkeys(IMPLEMENTATIONS, "refused"),
        is_without_engine=True,
    )
    row = hard_cases._outcome_row(case, "reference", hard_cases.CaseOutcome("refused"))
    assert (row.id, row.status) == ("hard.odd.any", "passed")
