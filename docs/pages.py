"""Pages of the documentation and their fenced blocks.

A block is marked by a comment in the line before its fence:

- ``<!-- run -->``: a ``console`` block, whose lines after ``$`` are commands, or a ``python`` block; the build runs it
- ``<!-- run: fails -->``: a ``console`` block whose last command ends with an error that the page shows
- ``<!-- output -->``: a ``text`` block, what the block that ran last printed
- ``<!-- file: NAME -->``: the text of a file, written into the folder in which the page's examples run
- ``<!-- picture: NAME -->``: before an image of Markdown, a file that the examples drew in that folder
"""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
TOP_FOLDER_PAGES = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")
"""Pages in the top folder of the repository."""
MARK_PATTERN = re.compile(r"<!--\s*(run|run: fails|output|file: (?P<file>\S+)|picture: (?P<picture>\S+))\s*-->")
IMAGE_PATTERN = re.compile(r"!\[[^\]]*\]\(([^)\s]+)\)")


def pages(root: Path = ROOT) -> list[Path]:
    """Paths of all pages of the documentation, sorted; those in the top folder of the repository first."""
    outside = [root / name for name in TOP_FOLDER_PAGES if (root / name).is_file()]
    return [*outside, *sorted((root / "docs").rglob("*.md"))]


@dataclass(frozen=True)
class ExampleBlock:
    """A fenced block of a page, or an image that its examples draw.

    mark : text of the comment before it, "" where there is none; language : the word after the fence, "image" for an
    image; text : what stands between the fences, or the address of the image; first, last : its lines, counted from 0,
    the last one excluded.
    """

    mark: str
    language: str
    text: str
    first: int
    last: int

    @property
    def file(self) -> str:
        """Name of the file in the block's mark; "" if it names none."""
        return self.mark.partition(": ")[2] if self.mark.startswith(("file: ", "picture: ")) else ""


def example_blocks(text: str) -> list[ExampleBlock]:
    """All fenced blocks and marked images in the text of a page, in order."""
    from markdown_it import MarkdownIt

    lines, blocks_of_page, mark = text.splitlines(keepends=True), [], ""
    for token in MarkdownIt("commonmark").parse(text):
        if token.type == "html_block":
            matched = MARK_PATTERN.fullmatch(token.content.strip())
            mark = matched[1] if matched else ""
        elif token.type == "fence" and token.map:
            first, last = token.map
            blocks_of_page.append(
                ExampleBlock(mark, token.info.strip(), "".join(lines[first + 1 : last - 1]), first + 1, last - 1)
            )
            mark = ""
        elif token.type == "inline" and mark.startswith("picture: ") and token.map:
            names = IMAGE_PATTERN.findall(token.content)
            blocks_of_page += [ExampleBlock(mark, "image", name, *token.map) for name in names]
            mark = ""
    return blocks_of_page
