"""Long tables read block by block: a row that is wrong is told, and all others go on.

The text is that of ``models.core.tables``. What is wrong with the header is the user's to repair before anything is
computed; what is wrong with a row is told beside that row.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from models.core.errors import InputError
from models.core.tables import Columns, headings, number

BLOCK = 20_000
"""Rows of a block."""


@dataclass(frozen=True)
class Block:
    """Successive rows of a table.

    lines : (rows,) line of the file, counted from 1. values : name -> (rows,) in SI, NaN throughout a wrong row.
    wrong : row of the block -> what is wrong with it.
    """

    lines: list[int]
    values: dict[str, np.ndarray]
    wrong: dict[int, str]


def blocks(path: Path, columns: tuple[Columns, ...], rows: int = BLOCK) -> Iterator[Block]:
    """Blocks of at most ``rows`` rows of a CSV table.

    columns : the accepted sets of columns, of which the header must name one in full, each with its accepted units
    and their factors to SI. Raises InputError for a file or a header that cannot be used.
    """
    with _opened(path) as file:
        lines = ((i, line) for i, line in enumerate(file, start=1) if line.strip() and not line.startswith("#"))
        header = next(lines, None)
        if header is None:
            raise InputError(path, "", None, "the file is empty: a header line and rows of numbers are needed")
        names, factors = headings(path, (header[0], header[1].strip()), _nearest(header[1], columns))
        while part := list(islice(lines, rows)):
            yield _block(path, part, names, np.array(factors), header[1].split(","))


def _opened(path: Path) -> TextIO:
    try:
        return path.open(encoding="utf-8-sig", errors="replace")  # a byte that is no text spoils its row alone
    except OSError as error:
        raise InputError(path, "", None, f"the file cannot be read: {error.strerror}") from None


def _nearest(header: str, columns: tuple[Columns, ...]) -> Columns:
    """The set of columns that shares most names with the header."""
    found = {cell.partition("[")[0].strip().strip('"') for cell in header.split(",")}
    return max(columns, key=lambda wanted: len(found & set(wanted)))


def _block(path: Path, part: list[tuple[int, str]], names: list[str], factors: np.ndarray, titles: list[str]) -> Block:
    lines, wrong = [line for line, _ in part], {}
    values = _all(part, len(names))
    if values is None:
        values = np.full((len(part), len(names)), np.nan)
        for i, (line, text) in enumerate(part):
            try:
                values[i] = _row(path, line, text, titles)
            except InputError as error:
                wrong[i] = str(error).partition(f"line {line}")[2].lstrip(":, ")
    values = values * factors
    return Block(lines, {name: values[:, j] for j, name in enumerate(names)}, wrong)


def _all(part: list[tuple[int, str]], width: int) -> np.ndarray | None:
    """All rows at once, where none of them needs a closer look."""
    text = "".join(line for _, line in part)
    if not (text.isascii() and text.endswith("\n")) or "_" in text:
        return None
    try:
        values = np.loadtxt([line for _, line in part], delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.shape == (len(part), width) and np.isfinite(values).all() else None


def _row(path: Path, line: int, text: str, titles: list[str]) -> list[float]:
    """The numbers of one row; raises InputError that names its line."""
    cells = text.split(",")
    if len(cells) != len(titles):
        raise InputError(path, f"line {line}", text.strip(), f"{len(titles)} values are needed, found {len(cells)}")
    return [number(path, line, title, cell) for title, cell in zip(titles, cells, strict=True)]
