"""Small pictures of the studies' figures, inserted beside their names into a copy of the gallery page.

``python -m docs.gallery RESULTS PAGE`` reads the page, looks for each listed figure below the folder RESULTS, writes a
small picture of it into the folder ``gallery`` beside the page, and shows it in the page. A figure that is not there
stays a name, so that the page can be built before any study ran.
"""

import argparse
import re
from pathlib import Path

PICTURE_WIDTH = 480
"""Width (pixels) of a small picture: half a page, so that outlines are readable."""
COLOUR_COUNT = 64
"""Number of colours of a small picture: enough for lines and text, with a third of the file size."""
FIGURE_LINE_PATTERN = re.compile(r"^\| `(?P<figure>[\w/]+\.png)` \|", re.MULTILINE)


def listed_figures(text: str) -> list[str]:
    """Figures that the gallery page lists, as ``SCENE/NAME.png``, in the order of the page."""
    return FIGURE_LINE_PATTERN.findall(text)


def shrink_picture(figure: Path, target: Path) -> Path:
    """Write a small picture (PNG, at most ``PICTURE_WIDTH`` pixels wide) of a figure; returns its path."""
    from PIL import Image

    target.parent.mkdir(parents=True, exist_ok=True)
    with Image.open(figure) as image:
        small = image.convert("RGB")
        small.thumbnail((PICTURE_WIDTH, 10 * PICTURE_WIDTH))
        small.quantize(COLOUR_COUNT).save(target, optimize=True)
    return target


def add_pictures(results: Path, page: Path) -> list[str]:
    """Insert small pictures into a gallery page, which is changed; returns the names of figures that are missing in
    ``results``."""
    text, missing = page.read_text(encoding="utf-8"), list[str]()
    for name in listed_figures(text):
        figure = results / name
        if not figure.is_file():
            missing.append(name)
            continue
        small = shrink_picture(figure, page.parent / "gallery" / name.replace("/", "_"))
        shown = f"![{name}](gallery/{small.name})<br>`{name}`"
        text = text.replace(f"| `{name}` |", f"| {shown} |")
    page.write_text(text, encoding="utf-8")
    return missing


def main() -> None:
    """Command: insert small pictures of the studies' figures into a gallery page."""
    parser = argparse.ArgumentParser(description="Put small pictures of the studies' figures into a gallery page.")
    parser.add_argument("results", type=Path, help="folder in which the studies left their results")
    parser.add_argument("page", type=Path, help="copy of docs/gallery.md, which is changed")
    asked = parser.parse_args()
    missing = add_pictures(asked.results, asked.page)
    print(f"{len(missing)} figures are not there: {', '.join(missing)}" if missing else "all figures are shown")


if __name__ == "__main__":
    main()
