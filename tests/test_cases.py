"""The validation cases pass as tests, too; what they find is in the report."""

from concurrent.futures import ProcessPoolExecutor
from functools import cache
from importlib import import_module
from multiprocessing import get_context

import pytest
import slow_machine

from validation.cases import CASES
from validation.run import seeds

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


@pytest.fixture(scope="module")
def elsewhere():
    """Function that gives the rows of a case as another machine finds them, slow and busy by its clocks."""
    with ProcessPoolExecutor(1, get_context("spawn"), slow_machine.begin) as machine:
        yield lambda *asked: machine.submit(*asked).result()


def test_a_row_that_is_judged_by_seconds_fails_on_the_planted_machine(elsewhere):
    """Positive control of the test below: without it nobody would see such a row."""
    for kind in ("perf_counter", "process_time"):
        row = elsewhere(slow_machine.judged, kind)
        assert row.status == "failed" and 2.0 < row.value < 8.0


@pytest.mark.full
@pytest.mark.parametrize("name", CASES)
def test_no_row_of_the_full_case_fails_on_a_slow_and_busy_machine(name, elsewhere, tmp_path):
    """What is judged can be judged anywhere."""
    rows = elsewhere(slow_machine.rows, name, False, tmp_path)
    assert rows and [(id, reason) for id, status, reason in rows if status == "failed"] == []


def test_the_runner_names_every_case_file():
    from pathlib import Path

    import validation.cases

    files = {path.stem for path in Path(validation.cases.__file__).parent.glob("*.py")} - {"__init__"}
    assert files == set(CASES)


def test_row_ids_are_unique(measured):
    ids = [row.id for name in QUICK for row in measured(name)]
    assert len(set(ids)) == len(ids)


def test_seeds_are_named():
    assert all(isinstance(seed, int) for seed in seeds().values())
