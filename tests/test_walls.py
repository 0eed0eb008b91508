"""How folders import each other: layers without a circle, no private names across files, studies below nothing."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("models", "studies", "validation", "twinrig")


def files() -> list[Path]:
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))


def imported(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """Module and name of every import, those within functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from ((node.module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)


@cache
def imports() -> dict[Path, list[tuple[str, str]]]:
    return {
        path: [pair for pair in imported(ast.parse(path.read_text())) if pair[0].split(".")[0] in FOLDERS]
        for path in files()
    }


def folder_of(module: str, name: str) -> str:
    """The folder of two levels that an import reaches into."""
    place = ROOT.joinpath(*module.split("."))
    if (place / name).with_suffix(".py").is_file() or (name and (place / name).is_dir()):
        place = place / name
    folder = place if place.is_dir() else place.parent
    return ".".join(folder.relative_to(ROOT).parts[:2])


def reached(edges: dict[str, set[str]], start: str) -> set[str]:
    seen, left = set[str](), [start]
    while left:
        for place in edges[left.pop()] - seen:
            seen.add(place)
            left.append(place)
    return seen


def test_folders_form_no_circle():
    edges: dict[str, set[str]] = defaultdict(set)
    for path, pairs in imports().items():
        here = ".".join(path.parent.relative_to(ROOT).parts[:2])
        edges[here] |= {folder_of(*pair) for pair in pairs} - {here}
    circles = {folder for folder in list(edges) if folder in reached(edges, folder)}
    assert not circles


def test_no_file_takes_private_names_of_another():
    private = [
        (str(path.relative_to(ROOT)), module, name)
        for path, pairs in imports().items()
        for module, name in pairs
        if name.startswith("_") and not name.startswith("__")
    ]
    assert not private


def test_studies_are_imported_by_studies_and_the_library_alone():
    users = {
        str(path.relative_to(ROOT))
        for path, pairs in imports().items()
        for module, _ in pairs
        if module.split(".")[0] == "studies" and path.relative_to(ROOT).parts[0] not in ("studies", "twinrig")
    }
    assert not users
