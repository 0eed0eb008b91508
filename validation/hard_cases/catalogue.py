"""The catalogue of 54 hard cases that practice and literature know, and the cases here that stand for each.

A number of the catalogue is a class of failures; a case is one scene with an answer.
"""

import tomllib
from pathlib import Path

COVERED_CLASSES = {
    int(number): (str(entry["what"]), tuple[str, ...](entry["cases"]))
    for number, entry in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")).items()
}
"""By number, the class of failures and the names of its cases."""


def missing_cases(names: set[str]) -> list[str]:
    """Cases that the catalogue names but that do not exist, with their catalogue number."""
    return [
        f"{number}: {name}" for number, (_, cases) in COVERED_CLASSES.items() for name in cases if name not in names
    ]


def cases_beyond_catalogue(names: list[str]) -> list[str]:
    """Cases that belong to no number of the catalogue."""
    named = {name for _, cases in COVERED_CLASSES.values() for name in cases}
    return [name for name in names if name not in named]
