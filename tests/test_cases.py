"""The validation cases pass as tests, too; what they find is in the report."""

from functools import cache
from importlib import import_module

import pytest
import slow_machine

from validation.cases import CASES
from validation.run import seeds_of_rows

QUICK = (
    "audit",
    "twin",
    "order",
    "tight",
    "enforced_moment",
    "roads",
    "motion",
    "score",
    "ensemble",
    "growth",
    "drift_off",
    "drift_solvers",
    "holding_spring",
)
"""Cases whose rows no other test file runs as a whole."""
WHOLE = ("absent", "contact_coefficients", "measured_formats")
"""Cases whose every row is run in full, wherever that is."""
ELSEWHERE = ("planted_faults",)
"""Cases that another test file measures in full, on the same machine: tests/test_planted_faults.py."""
FEWER = {
    "price": {"TIMING_ROUNDS": {True: 1, False: 5}},
    "effect_prices": {"RATIO_ROUNDS": {True: 7, False: 20}},
    "ensemble": {"LARGE_ENSEMBLE_PATHS": 2000},
    "kalman": {"SAMPLE_COUNT": 8},
    "stated_errors": {"LEAST_ERROR_SAMPLE_COUNT": 36},
    "recommendation": {"SCENE_COUNTS_BY_SYSTEM": {"pitch-plane": 44, "braking": 4, "wheelset": 2, "handling": 1}},
    "braking_limits": {"STOP_COUNTS": {True: 3, False: 100}},
    "choice_linear": {"SCENE_COUNT": 24},
}
"""What the tests have fewer of than the report: rounds of seconds, which are not judged, and random samples. The first
samples are the same, and so are the bounds; the report draws all of them."""


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Function from a case's name to its quick rows, each case measured once."""

    @cache
    def rows(name):
        return import_module(f"validation.cases.{name}").measure(True, tmp_path_factory.mktemp(name))[0]

    return rows


@pytest.mark.parametrize("name", QUICK)
def test_every_row_of_the_quick_case_passes(name, measured):
    rows = measured(name)
    assert rows
    for row in rows:
        assert row.status != "failed", f"{row.id}: {row.reason}"
        assert row.status != "not run" or "TWINRIG_DATA" in row.reason


@pytest.mark.parametrize("name", FEWER)
def test_what_the_tests_have_fewer_of_has_not_been_renamed(name):
    """The long tests alone use these names, and would fail half an hour later."""
    assert [key for key in FEWER[name] if not hasattr(import_module(f"validation.cases.{name}"), key)] == []


def test_a_row_that_is_judged_by_seconds_fails_on_the_planted_machine(elsewhere):
    """Positive control of the test below: without it nobody would see such a row."""
    for kind in ("perf_counter", "process_time"):
        row = elsewhere(slow_machine.judged, kind)
        assert row.status == "failed" and 2.0 < row.value < 8.0


@pytest.mark.full
@pytest.mark.parametrize("name", [name for name in CASES if name not in ELSEWHERE])
def test_no_row_of_the_full_case_fails_on_a_slow_and_busy_machine(name, elsewhere, tmp_path):
    """What is judged can be judged anywhere."""
    rows, wrong = elsewhere(slow_machine.rows, name, False, tmp_path, FEWER.get(name)), {"failed"}
    if name in WHOLE:
        wrong.add("not run")
    assert rows and [(id, reason) for id, status, reason in rows if status in wrong] == []


def test_the_runner_names_every_case_file():
    from pathlib import Path

    import validation.cases

    files = {path.stem for path in Path(validation.cases.__file__).parent.glob("*.py")} - {"__init__"}
    assert files == set(CASES)


def test_row_ids_are_unique(measured):
    ids = [row.id for name in QUICK for row in measured(name)]
    assert len(set(ids)) == len(ids)


def test_seeds_are_named():
    assert all(isinstance(seed, int) for seed in seeds_of_rows().values())
