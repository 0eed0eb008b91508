"""Catalogue of 54 classes of failures known from practice and literature, and the hard cases that cover each.

A number of the catalogue is a class of failures; a case is one scene with an answer.
"""

import tomllib
from pathlib import Path

COVERED_CLASSES = {
    int(number): (str(entry["what"]), tuple[str, ...](entry["cases"]))
    for number, entry in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")).items()
}
"""Number in the catalogue -> description of the class of failures, and names of the hard cases that cover it."""


def missing_cases(case_names: set[str]) -> list[str]:
    """Cases that the catalogue names but that do not exist, each with its catalogue number."""
    return [
        f"{number}: {name}"
        for number, (_, cases) in COVERED_CLASSES.items()
        for name in cases
        if name not in case_names
    ]


def cases_beyond_catalogue(case_names: list[str]) -> list[str]:
    """Names of the cases that the catalogue does not contain."""
    named = {name for _, cases in COVERED_CLASSES.values() for name in cases}
    return [name for name in case_names if name not in named]
