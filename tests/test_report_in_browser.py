"""The report in a real browser: what the first screen tells, the search, a telephone, how long the page is."""

import json
from pathlib import Path

import pytest
from browser import browser, tab

from validation.cases import CASES, point_mass
from validation.common.rows import Observed, Row, failed_row, not_run
from validation.report.page import write
from validation.run import save

pytestmark = pytest.mark.skipif(browser() is None, reason="there is no Chromium on the path")
DESKTOP, PHONE = (1280, 800), (400, 800)
"""Width and height of a screen in px."""
ROWS_OF_A_CASE = 30
LONG = "a_name_that_has_no_place_to_break_it_" * 4
ASKED_SECONDS = 0.2
SOUGHT = "guards.7.mujoco"

LEAVES_THE_SCREEN = """[...document.querySelectorAll("body *")].filter(each =>
  !each.parentElement.closest(".scroll, .card, pre, option, optgroup, nav") &&
  each.getBoundingClientRect().right > 400.5).map(each => each.outerHTML.slice(0, 100))"""
"""Elements that reach beyond the right edge of a telephone, but for what scrolls within itself."""
SHOWN_ROWS = """[...document.querySelectorAll("tr[id^=row-]")].filter(row => row.checkVisibility({
  contentVisibilityAuto: true })).map(row => row.querySelector(".id").textContent)"""
TYPED = """(async words => {
  const field = document.querySelector("#find input"), times = [];
  for (let i = 0; i < 5; i++) {
    for (const text of ["", words]) {
      const start = performance.now();
      field.value = text;
      field.dispatchEvent(new Event("input", { bubbles: true }));
      document.body.getBoundingClientRect();
      if (text) times.push((performance.now() - start) / 1e3);
    }
    await new Promise(done => setTimeout(done, 20));
  }
  return Math.min(...times);
})"""
"""Least seconds of five searches, each until the page is laid out."""


def rows() -> list[Row]:
    many = [
        Observed(f"{case}.{i}.{engine}", "pitch-plane", f"Error {i} of {engine} in {case}", 8.9e-16, "m/s^2").at_most(
            1e-12, f"reason {i // 5}", "native"
        )
        for case in CASES
        for i in range(ROWS_OF_A_CASE // 2)
        for engine in ("exudyn", "mujoco")
    ]
    odd = [
        failed_row("audit.broken", "The case of the audit ends", "the engine stopped"),
        failed_row(f"twin.{LONG}", LONG, LONG),
        not_run("roads.measured", "pitch-plane", "The measured road is read", LONG),
        Observed("order.aim", "cost", "Seconds of one call", 7.25, "us").aim(5.0, LONG),
    ]
    return [*many, *odd]


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    (folder / "data").mkdir()
    drawn, data = point_mass.measure(True, folder)
    (folder / "data" / "point_mass.json").write_text(json.dumps(data))
    save(folder, [*rows(), *drawn], {"command": "twinrig validate", "commit": "abc", "quick": True, "wall": 90.0})
    return write(folder)


@pytest.fixture(scope="module")
def shown():
    with tab() as opened:
        yield opened


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_the_first_screen_tells_the_verdict_failed_rows_and_what_is_not_covered(page, shown, size):
    shown.open(page, *size, phone=size == PHONE)
    bottom = "document.querySelector('{}').getBoundingClientRect().bottom"
    for part in (".sentence", ".alarm li", ".tiles", "#gaps > ul > li:last-child"):
        assert 0 < shown.value(bottom.format(part)) <= size[1], part


def test_the_search_finds_a_row_by_its_id_in_the_time_asked_for(page, shown):
    shown.open(page, *DESKTOP)
    assert SOUGHT not in shown.value(SHOWN_ROWS), "its case is folded"
    seconds = shown.value(f"{TYPED}({json.dumps(SOUGHT)})")
    assert shown.value(SHOWN_ROWS) == [SOUGHT]
    assert seconds < ASKED_SECONDS


def test_filters_leave_the_rows_that_they_name_and_clearing_them_brings_all_back(page, shown):
    shown.open(page, *DESKTOP)
    before = shown.value(SHOWN_ROWS)
    shown.value("document.querySelector('a.tile[data-status=missed]').click()")
    assert shown.value(SHOWN_ROWS) == ["order.aim"]
    choose = "form.elements.{}.value = '{}'; find()"
    shown.value("form.elements.status.value = ''")
    shown.value(choose.format("place", "case-pitch-plane-guards"))
    assert shown.value(SHOWN_ROWS) == [row.id for row in rows() if row.id.startswith("guards.")]
    shown.value(choose.format("grounds", "closed form"))
    assert shown.value(SHOWN_ROWS) == []
    assert "No row fits" in shown.value("document.querySelector('#find output').textContent")
    shown.value("document.querySelector('#find button').click()")
    assert shown.value(SHOWN_ROWS) == before


def test_a_link_to_a_row_shows_it_also_while_a_search_hides_it(page, shown):
    shown.open(page, *DESKTOP)
    shown.value("form.elements.text.value = 'audit.broken'; find()")
    shown.value(f"location.hash = 'row-{SOUGHT}'")
    shown.value("new Promise(done => setTimeout(done, 50))")  # the event comes after the change
    assert SOUGHT in shown.value(SHOWN_ROWS)
    assert 0 <= shown.value(f"document.getElementById('row-{SOUGHT}').getBoundingClientRect().top") < DESKTOP[1]


@pytest.mark.parametrize("folded", [True, False])
def test_nothing_is_wider_than_a_telephone(page, shown, folded):
    shown.open(page, *PHONE, phone=True)
    if not folded:
        shown.value("document.querySelectorAll('details').forEach(box => box.open = true)")
    assert shown.value(LEAVES_THE_SCREEN) == []
    assert shown.value("innerWidth") == PHONE[0], "a wider page would be shown smaller"
    shown.value("document.querySelector('.tiles').style.width = '500px'")
    assert shown.value(LEAVES_THE_SCREEN), "what is wider is noticed"


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_the_page_has_at_most_60_screens_while_rows_are_folded(page, shown, size):
    shown.open(page, *size, phone=size == PHONE)
    assert shown.value("document.documentElement.scrollHeight / innerHeight") <= 60
