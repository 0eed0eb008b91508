"""What changed between two reports: each kind is found, rounding is not, and what is no report is refused."""

import json

import pytest

from models.core.errors import InputError
from validation.common.changes import CHANGE_KINDS, change_lines, changed_rows, comparison_with_earlier, read_results
from validation.common.rows import Observed, behaviour_row
from validation.report.page import write

ERROR = Observed("a.error", "drift", "an error", 1e-6, "m").at_most(1e-5, "why", "native")
VALUE = Observed("a.value", "drift", "a value", 2.0, "m").within(2.0, 0.5, "why", "native")
WORD = behaviour_row("a.word", "drift", "a word", "refused", "refused", "why")


def table(*rows):
    return {row.id: row.as_dict() for row in rows}


def changed(row, **keys):
    return {row.id: {**row.as_dict(), **keys}}


@pytest.mark.parametrize(
    ("before", "after", "kinds"),
    [
        (table(ERROR), changed(ERROR, value=1e-4, status="failed"), ["status", "value"]),
        (table(VALUE), changed(VALUE, value=2.1), ["value"]),
        (table(VALUE), changed(VALUE, tolerance=5.0), ["expected"]),
        (table(WORD), changed(WORD, value="silent", status="failed"), ["status", "value"]),
        (table(VALUE), changed(VALUE, value=float("nan")), ["value"]),
        (table(VALUE), changed(VALUE, value=None, status="not run"), ["status", "value"]),
        (table(VALUE, WORD), table(VALUE), ["gone"]),
        (table(VALUE), table(VALUE, WORD), ["new"]),
        (table(VALUE), changed(VALUE, value=2.0 * (1 + 1e-12)), []),  # rounding
        (table(ERROR), changed(ERROR, value=1.001e-6), []),  # an error by 1e-4 of its tolerance
        (changed(VALUE, value=float("nan")), changed(VALUE, value=float("nan")), []),
        (table(ERROR, VALUE, WORD), table(WORD, VALUE, ERROR), []),
    ],
)
def test_every_kind_of_change_is_found_and_rounding_is_none(before, after, kinds):
    assert [one["kind"] for one in changed_rows(before, after)] == kinds


def test_what_fails_now_comes_first():
    before = table(ERROR, VALUE, WORD)
    after = changed(VALUE, value=2.2) | changed(WORD, status="failed", reason="found 'silent'")
    found = changed_rows(before, after)
    assert [one["id"] for one in found] == ["a.word", "a.error", "a.value"]
    assert [CHANGE_KINDS.index(one["kind"]) for one in found] == sorted(
        CHANGE_KINDS.index(one["kind"]) for one in found
    )


def test_the_report_tells_changes_and_is_drawn_again_from_its_results(tmp_path):
    (tmp_path / "old.json").write_text(
        json.dumps(
            {
                "provenance": {
                    "quick": True,
                    "commit": "abc",
                    "python": "3.11",
                    "versions": {"numpy": "1", "scipy": "1"},
                },
                "rows": [*table(VALUE, WORD).values()],
            }
        )
    )
    rows = [*changed(VALUE, value=2.25).values()]
    found = comparison_with_earlier(
        read_results(tmp_path / "old.json"),
        rows,
        {"quick": False, "versions": {"numpy": "2", "scipy": "1"}, "python": "3.12"},
    )
    assert found["note"] == (
        "the earlier report is the quick one and this the full one; version of numpy 1 -> 2; python 3.11 -> 3.12"
    )
    assert "2 changes: 0 of status, 1 gone, 0 new, 0 judged otherwise, 1 of value" in change_lines(found)[0]
    (tmp_path / "results.json").write_text(json.dumps({"provenance": {}, "rows": rows, "against": found}))
    first = write(tmp_path).read_bytes()
    assert b"What changed" in first and b"a.word" in first and write(tmp_path).read_bytes() == first


@pytest.mark.parametrize("content", [None, "{", "[]", '{"rows": [{"id": "a"}], "provenance": {}}', '{"rows": 3}'])
def test_what_is_no_report_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "results.json").write_text(content)
    with pytest.raises(InputError, match="--against") as told:
        read_results(tmp_path)
    assert "Error" not in str(told.value)


@pytest.mark.parametrize(
    ("rows", "provenance"),
    [([ERROR, ERROR], {}), ([ERROR], {"versions": "numpy 2"}), ([ERROR], {"seeds": [1, 2]}), ([ERROR], "none")],
)
def test_a_doctored_report_is_refused_before_anything_runs(tmp_path, rows, provenance):
    """An id that stands there twice would hide one of two rows; versions that are no table would end the report."""
    content = {"rows": [row.as_dict() for row in rows], "provenance": provenance}
    (tmp_path / "results.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="--against"):
        read_results(tmp_path)
