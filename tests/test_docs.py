"""The pages of the documentation: links, names, scenes and the reference are those of the repository."""

import ast
import re
import tomllib
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

import twinrig
from docs import scene_keys, validation_cases
from docs.pages import ROOT, example_blocks, pages
from models.core.errors import InputError
from models.core.systems import DEFAULT_SYSTEM, SYSTEMS, scene_of_table
from models.vehicles.vehicle_file import build_vehicle
from studies.command.asked import KNOWN_SYSTEMS, SCENES_FOLDER, plan_module_of, requested_engines

PAGES = {str(page.relative_to(ROOT)): page for page in pages()}
each_page = pytest.mark.parametrize("name", PAGES)


@cache
def tokens(page):
    return MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8"))


def links(page):
    """Targets of all links and images of a page."""
    inner = [child for token in tokens(page) for child in token.children or ()]
    kinds = {"link_open": "href", "image": "src"}
    return [str(child.attrs[kinds[child.type]]) for child in inner if child.type in kinds]


@cache
def anchors(page):
    """Anchors of the headings of a page, as a forge makes them."""
    found = tokens(page)
    heads = [found[i + 1].content for i, token in enumerate(found) if token.type == "heading_open"]
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@each_page
def test_every_link_leads_to_a_file_and_a_heading(name):
    for link in links(PAGES[name]):
        if re.match(r"https?:|mailto:", link):
            continue
        file, _, anchor = link.partition("#")
        target = (PAGES[name].parent / file).resolve() if file else PAGES[name]
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target), link


def test_every_page_is_reached_from_the_readme():
    """By links alone, so that whoever reads plain files finds all of them."""
    reached, left = set(), [ROOT / "README.md"]
    while left:
        page = left.pop()
        if page.suffix == ".md" and page not in reached:
            reached.add(page)
            left += [(page.parent / link.partition("#")[0]).resolve() for link in links(page) if ":" not in link]
    assert {page for page in PAGES.values() if page.parent.name != "systems"} <= reached


def test_every_public_name_is_on_the_page_of_the_api():
    shown = re.findall(r"^::: (\S+)$", (ROOT / "docs" / "reference" / "api.md").read_text(), re.MULTILINE)
    assert sorted(shown) == sorted(f"twinrig.{name}" for name in twinrig.__all__)
    for name in twinrig.__all__:
        assert getattr(twinrig, name).__doc__


def test_the_reference_of_scene_keys_is_what_the_models_read():
    assert scene_keys.PAGE.read_text(encoding="utf-8") == scene_keys.page(), "python -m docs.scene_keys"


def test_every_scene_key_has_a_meaning():
    for system in SYSTEMS:
        assert [key.name for key in scene_keys.keys_of(scene_keys.scene_class(system)) if not key.meaning] == []


@pytest.mark.parametrize("scene", sorted(path.stem for path in SCENES_FOLDER.glob("*.toml")))
def test_every_key_of_a_scene_that_comes_with_twinrig_is_in_the_reference(scene):
    table = tomllib.loads((SCENES_FOLDER / f"{scene}.toml").read_text())
    system = table.get("system", DEFAULT_SYSTEM)
    if system in SYSTEMS:
        section = scene_keys.PAGE.read_text().partition(f"\n## {system}\n")[2].partition("\n## ")[0]
        known = set(re.findall(r"^\| `([\w.\[\]-]+)` \|", section, re.MULTILINE))
        assert [key for key in table if key not in known] == []


def test_the_reference_of_cases_is_that_of_the_report():
    text = validation_cases.PAGE.read_text(encoding="utf-8")
    assert text == validation_cases.page(text), "python -m docs.validation_cases"


def toml_blocks():
    found = [(name, block) for name, page in PAGES.items() for block in example_blocks(page.read_text())]
    return [pytest.param(name, each.text, id=f"{name}:{each.first}") for name, each in found if each.language == "toml"]


@pytest.mark.parametrize(("name", "text"), toml_blocks())
def test_every_scene_and_vehicle_of_the_pages_is_valid(name, text, empty_folder):
    """Files that a scene names need not be there."""
    table = tomllib.loads(text)
    if "bodies" in table:
        build_vehicle(table, name)
    elif "title" in table:
        try:
            scene = scene_of_table(table, name, empty_folder, KNOWN_SYSTEMS)
            plan_module_of(scene).check(scene, requested_engines(None, scene.system)[:1])
        except InputError as refused:
            assert "no such file" in str(refused)


@each_page
def test_every_name_of_code_is_there(name):
    """Modules and what is in them, files, and commands."""
    text = PAGES[name].read_text()
    for dotted in set(re.findall(r"`((?:models|studies|validation|twinrig|docs)\.[\w.]+(?<!\.py))(?:\(.*?\))?`", text)):
        module, _, last = dotted.rpartition(".")
        try:
            import_module(dotted)
        except ImportError:
            assert hasattr(import_module(module), last), dotted
    for path in set(re.findall(r"`((?:models|studies|validation|twinrig|docs|tests|\.ci)/[\w/.-]+)`", text)):
        assert (ROOT / path).exists() or "NAME" in path or path in NEW_FILES, path
    for command in set(re.findall(r"(?:`|\$ )twinrig ([a-z]+)", text)):
        assert command in (
            "list",
            "show",
            "run",
            "price",
            "compare",
            "identify",
            "identify",
            "validate",
            "export",
            "twin",
        ), command


@each_page
def test_every_name_that_an_example_imports_is_there(name):
    """Names that ``from MODULE import ...`` takes from the project."""
    for block in example_blocks(PAGES[name].read_text()):
        for node in ast.walk(ast.parse(block.text)) if block.language == "python" else ():
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in TOP:
                missing = [each.name for each in node.names if not _is_there(node.module, each.name)]
                assert not missing, f"{node.module}: {missing}"


TOP = ("models", "studies", "validation", "twinrig", "docs")


def _is_there(module: str, name: str) -> bool:
    try:
        return hasattr(import_module(module), name) or bool(import_module(f"{module}.{name}"))
    except ImportError:
        return False


NEW_FILES = ("models/systems/handling/effects/side_wind.py",)
"""Files that a reader of the pages makes."""


def test_a_broken_link_is_seen(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# A page: here\n\n[there](no.md) and ![a](b.png) in | a\n|---|\n")
    assert links(page) == ["no.md", "b.png"] and anchors(page) == {"a-page-here"}
    assert not (Path(page).parent / "no.md").exists()
