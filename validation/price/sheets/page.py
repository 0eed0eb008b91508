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


def write_columns(output_folder: Path, file_name: str, headings: Sequence[str], column_values: np.ndarray) -> None:
    """Write columns (n, c) with headings (c,) to the file ``file_name``.csv, with all digits."""
    np.savetxt(
        output_folder / f"{file_name}.csv",
        column_values,
        fmt="%.17g",
        delimiter=",",
        header=",".join(headings),
        comments="",
    )


def write_matrices(output_folder: Path, file_name: str, matrices: dict[str, np.ndarray]) -> None:
    """Write the nonzero entries of matrices to the file ``file_name``.csv: matrix, row, column (counted from 1),
    value."""
    lines = ["matrix,row,column,value"]
    for key, values in matrices.items():
        lines += [f"{key},{i + 1},{j + 1},{values[i, j]:.17g}" for i, j in np.argwhere(values != 0.0)]
    (output_folder / f"{file_name}.csv").write_text("\n".join(lines) + "\n")


def vector_text(components: Sequence[float] | np.ndarray) -> str:
    """Text of a vector with all digits of its numbers, in brackets."""
    return "(" + ", ".join(f"{value:.17g}" for value in components) + ")"


def write(
    output_folder: Path,
    sheet_name: str,
    sheet_title: str,
    problem_text: str,
    reference_text: str,
    reference_values: list[ReferenceValue],
) -> list[ReferenceValue]:
    """Write the problem sheet ``sheet_name``.md: the problem, how its reference was computed, and the reference values,
    which are returned."""
    lines = "\n".join(f"| {v.quantity} | {v.value:.16e} | {v.unit} | {v.uncertainty:.1e} |" for v in reference_values)
    (output_folder / f"{sheet_name}.md").write_text(f"""# {sheet_title}

{problem_text}

{reference_text}

| quantity | value | unit | uncertainty |
|---|---|---|---|
{lines}
""")
    return reference_values
