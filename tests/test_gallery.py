"""The gallery lists figures that studies draw, and shows small pictures of those that are there."""

from pathlib import Path

import pytest
from PIL import Image

from docs.gallery import PICTURE_WIDTH, add_pictures, listed_figures

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "gallery.md"
FIGURES = listed_figures(PAGE.read_text(encoding="utf-8"))
SCENES = ROOT / "studies" / "scenes"


@pytest.fixture(scope="module")
def sources() -> str:
    return "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "studies").rglob("*.py")))


@pytest.mark.parametrize("figure", FIGURES)
def test_a_study_draws_it(figure: str, sources: str) -> None:
    """Its name stands in a study, or names a drive of its scene."""
    scene, name = figure.removesuffix(".png").split("/")
    text = (SCENES / f"{scene}.toml").read_text(encoding="utf-8")
    assert f'"{name}.png"' in sources or f'"{name}"' in sources or f".{name}]" in text, figure


def test_every_shipped_scene_with_figures_is_listed() -> None:
    """Scenes that only vary another one, and those without a figure of their own, are named here."""
    others = {"choice_hub_forces", "choice_road", "choice_wheelset", "contact_profiles", "contact_table", "iso_road"}
    others |= {"recording", "release"}
    assert {path.stem for path in SCENES.glob("*.toml")} - others == {figure.split("/")[0] for figure in FIGURES}


def test_small_pictures_are_shown_and_the_others_stay_names(tmp_path: Path) -> None:
    page = tmp_path / "pages" / "gallery.md"
    page.parent.mkdir()
    page.write_text(
        "| figure | what |\n|---|---|\n| `a/b.png` | there |\n| `a/c.png` | not there |\n", encoding="utf-8"
    )
    (tmp_path / "results" / "a").mkdir(parents=True)
    Image.new("RGB", (1600, 800), "white").save(tmp_path / "results" / "a" / "b.png")
    assert add_pictures(tmp_path / "results", page) == ["a/c.png"]
    text = page.read_text(encoding="utf-8")
    assert "| ![a/b.png](gallery/a_b.png)<br>`a/b.png` | there |" in text and "| `a/c.png` | not there |" in text
    with Image.open(page.parent / "gallery" / "a_b.png") as small:
        assert small.size == (PICTURE_WIDTH, PICTURE_WIDTH // 2)
