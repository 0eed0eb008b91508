"""What the site is built from: copies of all pages where their links lead, and the rows of the newest report."""

import json
import os
from fnmatch import fnmatchcase

import pytest
import yaml

from docs.mathml import on_page_content
from docs.pages import ROOT, pages
from docs.validation_cases import counts_table, newest_report, rows_table
from docs.website import copy_pages

ROW = {
    "id": "audit.one",
    "quantity": "a | b [1] [2]",
    "expected": 0.0,
    "tolerance": 1e-12,
    "independence": "native",
    "system": "wheelset",
    "status": "passed",
}


def test_every_page_is_copied_with_the_pictures_that_it_shows(tmp_path):
    copy_pages(tmp_path)
    assert [page.relative_to(tmp_path) for page in pages(tmp_path)] == [page.relative_to(ROOT) for page in pages()]
    assert (tmp_path / "studies" / "readme_pictures.png").is_file() and (tmp_path / "nav.yml").is_file()
    assert not [*tmp_path.rglob("*.py")]


def test_the_rows_are_those_of_the_newest_report(tmp_path):
    assert newest_report(tmp_path) is None
    for age, (name, content) in enumerate({"new": {"rows": [ROW]}, "old": {"rows": []}, "other": {}}.items()):
        (tmp_path / name).mkdir()
        path = tmp_path / name / "results.json"
        path.write_text(json.dumps(content))
        os.utime(path, (1e9 - age, 1e9 - age))
    report = newest_report(tmp_path)
    assert report == tmp_path / "new" / "results.json"
    assert (
        rows_table(report).splitlines()[-1] == "| `audit.one` | a \\| b \\[1\\] \\[2\\] | 0 | 1e-12 | native | passed |"
    )
    assert counts_table(report).splitlines()[-1] == "| wheelset | 1 | 0 | 0 | 0 | 0 | 0 | 0 |"


def entries(nav):
    """All paths and patterns of a navigation."""
    for entry in nav:
        for value in [entry] if isinstance(entry, str) else entry.values():
            yield from [value] if isinstance(value, str) else entries(value)


def test_every_page_has_a_place_in_the_navigation():
    paths = [*entries(yaml.safe_load((ROOT / "docs" / "nav.yml").read_text())["nav"])]
    for path in paths:
        assert "*" in path or (ROOT / path).is_file(), path
    for page in pages():
        name = str(page.relative_to(ROOT))
        assert any(fnmatchcase(name, path) for path in paths), name


def test_formulas_are_drawn_without_a_script():
    line, display = r'<span class="arithmatex">\(a &lt; b_1\)</span>', r'<div class="arithmatex">\[\frac{1}{2}\]</div>'
    drawn = on_page_content(f"<p>{line}</p>{display}", page="x.md")
    assert drawn.count("<math") == 2 and "arithmatex" not in drawn and 'display="block"' in drawn
    for formula, said in (("x^", "cannot be read"), (r"\fraction{1}{2}", "a command that is not known")):
        with pytest.raises(ValueError, match=rf"^x\.md: the formula .* {said}"):
            on_page_content(rf'<div class="arithmatex">\[{formula}\]</div>', page="x.md")
