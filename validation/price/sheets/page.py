"""A problem sheet: a page of Markdown, its input numbers as CSV files, and the end values of the reference."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np


class ReferenceValue(NamedTuple):
    """A value of the reference solution with its problem, quantity, unit, time (s) and uncertainty."""

    problem: str
    quantity: str
    unit: str
    time: float
    value: float
    uncertainty: float

    def cells(self) -> tuple[str, ...]:
        """Cells of the value's line in ``reference_values.csv``, with all digits."""
        return (*self[:3], f"{self.time:.17g}", f"{self.value:.16e}", f"{self.uncertainty:.1e}")


def write_columns(folder: Path, name: str, headings: Sequence[str], values: np.ndarray) -> None:
    """Write columns (n, c) with headings (c,) to the file ``name``.csv, with all digits."""
    np.savetxt(folder / f"{name}.csv", values, fmt="%.17g", delimiter=",", header=",".join(headings), comments="")


def write_matrices(folder: Path, name: str, arrays: dict[str, np.ndarray]) -> None:
    """Write the nonzero entries of matrices to the file ``name``.csv: matrix, row, column (counted from 1),
    value."""
    lines = ["matrix,row,column,value"]
    for key, values in arrays.items():
        lines += [f"{key},{i + 1},{j + 1},{values[i, j]:.17g}" for i, j in np.argwhere(values != 0.0)]
    (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


def vector_text(values: Sequence[float] | np.ndarray) -> str:
    """Text of a vector with all digits of its numbers, in brackets."""
    return "(" + ", ".join(f"{value:.17g}" for value in values) + ")"


def write(
    folder: Path, key: str, title: str, body: str, reference_text: str, values: list[ReferenceValue]
) -> list[ReferenceValue]:
    """Write the problem sheet ``key``.md: the problem, how its reference was computed, and the reference values, which
    are returned."""
    lines = "\n".join(f"| {v.quantity} | {v.value:.16e} | {v.unit} | {v.uncertainty:.1e} |" for v in values)
    (folder / f"{key}.md").write_text(f"""# {title}

{body}

{reference_text}

| quantity | value | unit | uncertainty |
|---|---|---|---|
{lines}
""")
    return values
