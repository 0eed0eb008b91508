"""Pages of the systems: one for each, each with the same headings, with rows and scenes that exist."""

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "systems"
PAGES = {path.stem: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.md"))}
SYSTEMS = sorted(path.parent.name for path in (ROOT / "models" / "systems").glob("*/scene.py"))
HEADINGS = ("What it takes for granted", "What it costs", "What it was held to", "What it cannot do")
ROWS = re.compile(r"`([a-z]\w*\.[\w.*-]+)`")
FINDINGS = {path.stem: path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs" / "findings").glob("*.md"))}


@cache
def validation() -> str:
    """All sources of the validation cases, in which the beginnings of row names stand."""
    return "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "validation").rglob("*.py")))


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_system_has_a_page_that_the_index_names(system: str) -> None:
    assert system in PAGES
    assert f"({system}.md)" in PAGES["index"]


@pytest.mark.parametrize("name", sorted(set(PAGES) - {"index", "README-moved"}))
def test_every_page_answers_the_same_questions(name: str) -> None:
    text = PAGES[name]
    assert "**Question.**" in text
    headings = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert [heading for heading in headings if heading in HEADINGS] == list(HEADINGS)


@pytest.mark.parametrize("name", sorted({**PAGES, **FINDINGS}))
def test_every_row_that_a_page_names_begins_as_a_case_writes_it(name: str) -> None:
    """A row's first word must be that of rows in some case; a case that was renamed is noticed."""
    for row in ROWS.findall({**PAGES, **FINDINGS}[name]):
        first = row.split(".")[0]
        if first in ("models", "studies", "validation", "twinrig", "docs", "run", "vehicle", "reduced", "mine"):
            continue
        if re.search(r"\.(md|toml|csv|py|html|json|fmu|nc)$", row):
            continue
        assert re.search(rf'"{first}[.{{"]', validation()), f"{row}: no case writes rows that begin with {first}"


@pytest.mark.parametrize("name", sorted({**PAGES, **FINDINGS}))
def test_every_scene_that_a_page_runs_comes_with_twinrig(name: str) -> None:
    scenes = {path.stem for path in (ROOT / "studies" / "scenes").glob("*.toml")}
    named = set(re.findall(r"twinrig (?:run|show|price) ([a-z]\w*)", {**PAGES, **FINDINGS}[name]))
    assert named <= scenes, named - scenes
