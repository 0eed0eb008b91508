"""The report: self-contained, honest in its order, repeatable, and a page whatever was saved."""

import csv
import json
import re
import shutil
import subprocess
import sys
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import pytest

from models.core.errors import InputError
from validation.cases import point_mass
from validation.common.changes import changed_rows
from validation.common.changes import read_results as read_earlier
from validation.common.rows import STATUSES, Observed, Row, behaviour_row, not_run
from validation.report import page as report
from validation.report import shares
from validation.report.numbers import (
    error_markup,
    margin_of_row,
    number_markup,
    numeric_columns,
    powers_markup,
    share_markup,
)
from validation.run import print_summary
from validation.run import save as _save

ODD = '<script>alert("1")</script> & "quotes" µ'
FAILED = Observed(
    "audit.mujoco.broken", "pitch-plane", "acceleration of a broken model", 3e-3, "of the largest"
).at_most(1e-12, "rounding", "native")


def rows() -> list[Row]:
    return [
        Observed("order.exudyn.RK44", "pitch-plane", "order of RK44", 3.93, "").within(
            4.0, 0.15, "theory", "closed form"
        ),
        Observed("audit.exudyn.twin", "pitch-plane", "acceleration", 2.5e-16, "1").at_most(1e-12, "rounding", "native"),
        FAILED,
        behaviour_row("guards.nan", "hard-cases", ODD, "raised", "raised", ODD),
        Observed("drift.noisy", "drift", "drift-off", 8.4, "s").beside("about 10", "one sample"),
        not_run("roads.measured", "pitch-plane", "measured roads", "no folder named"),
        Row("odd.<b>", "effects", "a case that nobody knows", None, "", "", None, "", "none", "failed", ODD),
    ]


def save(folder: Path, own: list[Row]) -> Path:
    (folder / "data").mkdir()
    source = {
        "commit": "abc",
        "versions": {"exudyn": "1"},
        "command": "twinrig validate --quick",
        "quick": True,
        "seconds": {"audit": 200.0, "order": 200.0},
        "wall": 301.0,
    }
    _save(folder, own, source)
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save(tmp_path, rows())
    steps = {"clean": [], "faults": []}
    (tmp_path / "data" / "planted_faults.json").write_text(json.dumps(steps))
    return tmp_path


@pytest.fixture
def page(folder: Path) -> str:
    return report.write(folder).read_text(encoding="utf-8")


class Outside(HTMLParser):
    """Everything that a browser would fetch, and whether every element is closed."""

    void = frozenset(("meta", "br", "img", "link", "hr", "input"))

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag, attributes):
        self.fetched += [
            value
            for name, value in attributes
            if name in ("src", "href", "xlink:href", "data") and not value.startswith(("#", "data:"))
        ]
        self.fetched += [tag] if tag in ("link", "iframe", "object") else []
        if tag not in self.void:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_nothing_is_fetched_and_every_element_is_closed(page):
    parser = Outside()
    parser.feed(page)
    assert parser.fetched == []
    assert parser.open == []
    assert "@import" not in page and "url(http" not in page


def test_verdict_comes_first_and_then_what_is_not_covered(page):
    text = page[page.index("<main>") :]
    before, heading, after = text.partition("<h2>What is not covered</h2>")
    assert heading and "<h2>" not in before
    assert "2 of 7 rows failed" in before and "nothing here is validation against a real one" in before
    assert "<h2>Pitch-plane</h2>" in after
    assert "<b>5 min</b><span>to measure it all" in before  # not the sum over cases that ran side by side


def test_each_system_has_a_stated_share_of_the_quick_minute(page):
    table = page[page.index('<section id="shares"') : page.index('<section id="independence"')]
    lines = [re.findall(r"<td[^>]*>([^<]*)</td>", line) for line in table.split("<tr>")]
    known = lines[[line[:1] for line in lines].index(["pitch-plane"])]
    assert [*known[:3], *known[4:6]] == ["pitch-plane", "3", "4", "400.0", "13 (over)"], "two cases of 200 s each"
    assert [line[0] for line in lines if line] == ["pitch-plane", "drift", "hard-cases", "effects"]


def test_gaps_name_systems_without_rows_and_rows_not_run(page):
    gaps = page[page.index('id="gaps"') : page.index('id="system-')]
    assert "No rows yet for contact, ride, rolling-vehicle, anti-lock, measured, cost<" in gaps
    assert "roads.measured" in gaps and "no folder named" in gaps
    assert "effects" not in gaps.split("No rows yet for")[1].split("<")[0], "it has a row, although a failed one"


def test_failed_rows_stand_at_the_top_with_their_reason(page):
    top = page[: page.index("What is not covered</h2>")]
    assert FAILED.id in top and FAILED.quantity in top
    assert "off by 0.003, allowed 1e-12" in top
    assert "2 of 7 rows failed" in top


def test_links_lead_to_places_on_the_page(page):
    targets = set(re.findall(r' id="([^"]*)"', page))
    assert set(re.findall(r'href="#([^"]*)"', page)) <= targets


def test_odd_text_is_text(page):
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(&#34;1&#34;)&lt;/script&gt; &amp; &#34;quotes&#34; µ" in page


def test_drawn_again_elsewhere_by_a_new_process_from_saved_files_it_is_the_same_to_the_byte(folder, tmp_path):
    own, data = point_mass.measure(True, folder)
    _save(folder, [*rows(), *own], {"command": "", "seconds": {"point_mass": 1.0}})
    (folder / "data" / "point_mass.json").write_text(json.dumps(data))
    first = report.write(folder).read_bytes()
    assert b"<svg role" in first, "there must be a figure to be drawn again"
    other = tmp_path / "elsewhere"
    shutil.copytree(folder / "data", other / "data")
    shutil.copy(folder / "results.json", other)
    done = subprocess.run(
        [sys.executable, "-m", "validation.report", str(other)], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.strip() == str(other / "report.html")
    assert (other / "report.html").read_bytes() == first
    assert not list(other.glob(".report*"))


def test_a_quick_report_tells_its_share_of_the_last_full_one(folder, tmp_path, monkeypatch):
    kept = tmp_path / "full_report.json"
    kept.write_text('{"order": {"rows": {"pitch-plane": 7}, "seconds": 30.0, "commit": "abc"}}')
    monkeypatch.setattr(shares, "FULL_REPORT_FILE", kept)
    with pytest.raises(InputError, match="full report"):
        shares.save_full_report(folder)
    results = report.read(folder / "results.json")
    results["rows"] = results["rows"][:3]
    results["provenance"]["quick"] = False
    shares.full_report_data.cache_clear()
    line = shares.report_sizes_of_systems(results)[0]
    assert (line["rows"], line["seconds"], line["full_rows"], line["full_seconds"]) == (3, 400.0, None, None)
    (folder / "results.json").write_text(json.dumps(results))
    shares.save_full_report(folder)
    shares.full_report_data.cache_clear()
    line = shares.report_sizes_of_systems(results)[0]
    assert (line["full_rows"], line["full_seconds"]) == (3, 400.0), "audit has two of the rows, order one and not seven"
    shares.full_report_data.cache_clear()


def test_missing_and_damaged_data_still_give_a_page(folder):
    own = [
        Observed(f"{case}.x", "pitch-plane", "q", 0.0, "").at_most(1.0, "w", "native") for case in ("order", "planted")
    ]
    _save(folder, own, {"command": ""})
    (folder / "data" / "planted_faults.json").write_text('{"faults": [{"no": "such key"}], "clean": []}')
    text = report.write(folder).read_text(encoding="utf-8")
    assert "data/order.json is missing or damaged" in text
    assert "cannot be shown from data/planted_faults.json" in text


def test_no_rows_at_all_still_give_a_page(tmp_path):
    text = report.write(save(tmp_path, [])).read_text(encoding="utf-8")
    assert "There are no rows" in text


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"rows": 3, "provenance": {}}'])
def test_a_file_that_is_no_result_is_one_message(tmp_path, content):
    (tmp_path / "results.json").write_text(content)
    with pytest.raises(InputError, match="not the results of a validation"):
        report.write(tmp_path)


def test_no_results_is_one_message_and_leaves_an_earlier_page(tmp_path):
    (tmp_path / "report.html").write_text("earlier")
    with pytest.raises(InputError, match="no such file"):
        report.write(tmp_path)
    assert (tmp_path / "report.html").read_text() == "earlier"


def test_csv_holds_the_rows_of_the_json(folder):
    with (folder / "results.csv").open(newline="") as file:
        found = list(csv.DictReader(file))
    saved = json.loads((folder / "results.json").read_text())["rows"]
    assert len(found) == len(saved) == len(rows())
    for line, row in zip(found, saved, strict=True):
        assert line == {key: "" if value is None else str(value) for key, value in row.items()}


def test_every_parameter_has_its_unit_and_source(page):
    section = page[page.index('id="parameters"') : page.index('id="provenance"')]
    assert "kg m^2" in section and "N s/m" in section
    assert "Fraunhofer ITWM" in section and "asymmetric_twin" in section


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (41, "41"),
        (3.14159, "3.142"),
        (-2.5, "-2.5"),
        (0.001, "0.001"),
        (99999.0, "99999"),
        (12345.6, "12346"),
        (2.5e-16, "2.5e-16"),
        (8.8817841970012523e-16, "8.882e-16"),
        (-3.125e-7, "-3.125e-7"),
        (1e-12, "1e-12"),
        (9.99999e-7, "1e-6"),
        (2e5, "2e5"),
        (100.0, "100"),
        (float("nan"), "not a number"),
        (None, "–"),
        ("<b>", "&lt;b&gt;"),
        (True, "True"),
    ],
)
def test_numbers_read_as_an_engineer_writes_them(value, text):
    assert number_markup(value) == text


@pytest.mark.parametrize(
    ("value", "text"), [(8.88e-16, "8.9e-16"), (1e-12, "1e-12"), (0.012345, "0.01235"), (0.0, "0"), (None, "–")]
)
def test_errors_beyond_plain_numbers_are_told_by_their_size(value, text):
    assert error_markup(value) == text


def test_margin_needs_numbers_and_a_tolerance():
    assert margin_of_row(rows()[0].as_dict()) == pytest.approx(0.07 / 0.15)
    assert margin_of_row(rows()[3].as_dict()) is None
    assert margin_of_row(Observed("a.b", "cost", "q", 1, "").within(1, 0, "w", "none").as_dict()) is None


def test_shares_and_powers():
    assert [share_markup(x) for x in (0.0, 0.5, 1e-9, None, float("nan"))] == ["0 %", "50 %", "&lt; 0.01 %", "–", "–"]
    assert share_markup(3e9) == "3e9 times"
    assert powers_markup("within 2e-06 of it") == "within 2e-6 of it" and powers_markup("1.7e+02") == "170"
    assert powers_markup("exudyn-1e5x") == "exudyn-1e5x", "a name is no number"


def test_columns_of_numbers_go_to_the_right():
    lines = [("1", "1e-06", "not so", "+1.5 +/- 0.2"), ("2", "–", "3", "72.4*")]
    assert numeric_columns(lines, 4) == [False, True, False, True]
    assert numeric_columns([], 2) == [False, False], "a table without lines"


def test_page_json_and_csv_say_the_same_of_every_row(tmp_path):
    missed = Observed("fastsim.speed", "contact", "one call", 7.25, "us").aim(5.0, "asked")
    reached = Observed("braking.speed", "anti-lock", "the truck", 210.0, "times real time").aim(
        100.0, "asked", "at least"
    )
    own = [*rows(), missed, reached, Observed("odd.nan", "cost", "nothing", float("nan"), "s").aim(1.0, "asked")]
    save(tmp_path, own)
    page = report.write(tmp_path).read_text(encoding="utf-8")
    row = r'<tr id="row-.*?<span class="id">([^<]*)</span>.*?<span class="chip [^"]*">([^<]*)</span>'
    shown = re.findall(row, page, re.DOTALL)
    with (tmp_path / "results.csv").open(newline="") as file:
        table = [(line["id"], line["status"]) for line in csv.DictReader(file)]
    saved = [(row["id"], row["status"]) for row in json.loads((tmp_path / "results.json").read_text())["rows"]]
    assert sorted((unescape(id), status) for id, status in shown) == sorted(saved) == sorted(table)
    assert {status for _, status in saved} == set(STATUSES)
    counts = re.findall(r"<b>(\d+)</b><span>(passed|failed|missed|reported|not run)", page)
    wanted = {status: str(sum(row.status == status for row in own)) for status in STATUSES}
    assert {status: count for count, status in counts} == wanted


def test_missed_aims_are_counted_and_told_in_the_verdict_and_fail_nothing(tmp_path, capsys):
    own = [rows()[0], Observed("fastsim.speed", "contact", "one call", 7.25, "us").aim(5.0, "asked")]
    top = report.write(save(tmp_path, own)).read_text(encoding="utf-8").partition("What is not covered</h2>")[0]
    assert "No row failed; 1 stated aim was missed." in top and "7.25 us; the aim is at most 5" in top
    assert print_summary(own, None, tmp_path) == 0
    assert "1 passed, 0 reported, 0 not run, 1 missed, 0 failed" in capsys.readouterr().out


def test_the_first_screen_tells_version_commit_date_machine_and_data(tmp_path):
    save(tmp_path, rows())
    found = json.loads((tmp_path / "results.json").read_text())
    found["provenance"] |= {
        "twinrig": "1.2",
        "date": "2026-01-02 03:04 UTC",
        "machine": "x86_64, 2 cores",
        "data": "3 files",
    }
    (tmp_path / "results.json").write_text(json.dumps(found))
    top = report.write(tmp_path).read_text(encoding="utf-8").partition('id="search"')[0]
    told = dict(re.findall(r"<dt>(\w+)</dt><dd>([^<]*)</dd>", top))
    assert told == {
        "version": "1.2",
        "commit": "abc",
        "date": "2026-01-02 03:04 UTC",
        "machine": "x86_64, 2 cores",
        "data": "3 files",
    }


def test_rows_that_an_older_report_called_passed_without_judging_them_are_reported(folder):
    found = json.loads((folder / "results.json").read_text())
    for row in found["rows"]:
        if row["status"] == "reported":
            row |= {"status": "passed", "reason": "reported, not judged"}
    (folder / "old.json").write_text(json.dumps(found))
    assert changed_rows(read_earlier(folder / "old.json")["rows"], {row.id: row.as_dict() for row in rows()}) == []
    assert report.read(folder / "old.json")["rows"] == [row.as_dict() for row in rows()]


def test_what_nothing_independent_notices_stands_under_what_is_not_covered_by_name(folder, tmp_path, monkeypatch):
    from functools import partial

    from validation.blind_spots.table import Line, write_table
    from validation.report.blind_spots import blind_spots

    seen = Line("models.tyre.bristles:_blend_directions", "whole", 3, 0, "handling.a", "", "handling.a", "abc1234")
    unseen = Line(
        "models.tyre.bristles:tyre_forces", "whole", 3, 1, "handling.b", "tests/test_a.py::test_b", "", "abc1234"
    )
    write_table([seen, unseen], tmp_path / "table.csv")
    monkeypatch.setattr(report, "blind_spots", partial(blind_spots, tmp_path / "table.csv"))
    page = report.write(folder).read_text(encoding="utf-8")
    gaps = page[page.index('id="gaps"') : page.index('id="system-')]
    folds = dict(
        re.findall(r"<summary>\d+ shared functions? (?:is|are) ([^<]*)</summary>(.*?)</details>", gaps, re.DOTALL)
    )
    independent, unaudited = folds["noticed by nothing independent"], folds["not audited"]
    assert "models.tyre.bristles:tyre_forces" in independent and "models.tyre.bristles:_blend_directions" not in gaps
    assert "models.tyre.bristles:_creepages" in unaudited
    section = page[page.index('<section id="blind-spots"') : page.index('<section id="assumptions"')]
    assert "commit abc1234" in section and "test_a.py::test_b" in section and "2 of 3" in section
