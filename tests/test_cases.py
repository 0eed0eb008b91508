"""The validation cases pass as tests, too; what they find is in the report."""

from functools import cache
from importlib import import_module

import pytest

from validation.run import CASES, seeds

QUICK = ("audit", "twin", "order", "tight", "enforced_moment", "roads", "motion", "score", "ensemble",
         "growth", "drift_off", "drift_solvers", "holding_spring")  # fmt: skip
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


@pytest.mark.full
@pytest.mark.parametrize("name", CASES)
def test_every_row_of_the_full_case_passes(name, tmp_path):
    rows, _ = import_module(f"validation.cases.{name}").measure(False, tmp_path)
    assert [row.id for row in rows if row.status == "failed"] == []


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
