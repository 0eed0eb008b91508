"""Tyre table of a user as CSV file: a row for each slip angle, load and slip, with friction coefficients mu_x and mu_y.

Columns ``slip angle [deg], load [kN], slip [-], mu_x [-], mu_y [-]`` in any order, each with one of its units (rad, N,
%), all combinations once, rows in any order; without the column of the load friction is that of every load. mu_y is
brought to the product g h, which must meet it to ``PRODUCT_TOLERANCE``.
"""

from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.tables import NEWTONS, RADIANS, SHARES, ColumnUnits, RowBlock, table_blocks
from models.tyre.magic_formula import product_factors
from models.tyre.tyre_table import LARGEST_FRICTION, TyreTable

FRICTION_COLUMNS: ColumnUnits = {
    "slip angle": {"deg": RADIANS["deg"], "rad": 1.0},
    "slip": SHARES,
    "mu_x": SHARES,
    "mu_y": SHARES,
}
COLUMN_SETS: tuple[ColumnUnits, ...] = (FRICTION_COLUMNS, {**FRICTION_COLUMNS, "load": {"kN": NEWTONS["kN"], "N": 1.0}})
LOAD_OF_SINGLE_NODE = 1e4
"""Load (N) of the only node of a table whose file has no column of the load."""
PRODUCT_TOLERANCE = 0.03
"""Largest difference between the product g h and lateral friction mu_y, as a share of the largest friction."""
MOST_NODES = 3_000_000


def tyre_table(table_path: str | Path) -> TyreTable:
    """Tyre table from a CSV file. Raises InputError that names file, line, column, value and what is allowed."""
    lines, columns = _columns_in_si(Path(table_path))
    columns.setdefault("load", np.full(len(lines), LOAD_OF_SINGLE_NODE))
    _check_ranges(table_path, lines, columns)
    axes = [np.unique(columns[name], return_inverse=True) for name in ("slip angle", "load", "slip")]
    angles, loads, slips = (nodes for nodes, _ in axes)
    shape = angles.size, loads.size, slips.size
    if np.prod(shape) > MOST_NODES:
        raise InputError(
            table_path,
            "rows",
            int(np.prod(shape)),
            "combinations of slip angle, load and slip are too many: are the same values repeated with other digits?",
        )
    row = _row_of_each_combination(
        table_path, lines, np.ravel_multi_index([node_index for _, node_index in axes], shape), axes
    )
    mu_x, mu_y = (columns[name][row].reshape(shape) for name in ("mu_x", "mu_y"))
    g, h = product_factors(mu_y)
    _check_product(table_path, lines, row.reshape(shape), mu_x, mu_y, g[:, None, :] * h[:, :, None])
    return TyreTable(angles, slips, loads, mu_x, g, h, Path(table_path).name)


def _columns_in_si(table_path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Line number (n,) of every row of the file, and its columns (n,) in SI units. Raises InputError for the first row
    with an error."""
    parts: list[RowBlock] = []
    for block in table_blocks(table_path, COLUMN_SETS):
        for row, wrong in block.faulty_rows.items():
            raise InputError(table_path, f"line {block.lines[row]}", None, wrong)
        parts.append(block)
    if not parts:
        raise InputError(table_path, "rows", 0, "at least one row of numbers is needed")
    columns = {name: np.concatenate([row_block.values[name] for row_block in parts]) for name in parts[0].values}
    return np.concatenate([row_block.lines for row_block in parts]), columns


def _check_ranges(table_path: str | Path, line_numbers: np.ndarray, columns: dict[str, np.ndarray]) -> None:
    for name, least_value, largest_value, allowed in (
        ("slip angle", 0.0, np.pi / 2.0, "must be from 0 to 90 deg"),
        ("slip", 0.0, 1.0, "must be from 0 to 1"),
        ("load", 1.0, 1e6, "must be from 1 N to 1000 kN"),
        ("mu_x", 0.0, LARGEST_FRICTION, "must be from 0 to 3"),
        ("mu_y", 0.0, LARGEST_FRICTION, "must be from 0 to 3"),
    ):
        wrong = np.flatnonzero(~((columns[name] >= least_value) & (columns[name] <= largest_value * (1.0 + 1e-12))))
        if wrong.size:
            raise _error_in_row(table_path, line_numbers, name, wrong[0], columns[name][wrong[0]], allowed)
    for name, zero in (("mu_x", "slip"), ("mu_y", "slip angle")):
        wrong = np.flatnonzero((columns[zero] == 0.0) & (columns[name] != 0.0))
        if wrong.size:
            raise _error_in_row(
                table_path, line_numbers, name, wrong[0], columns[name][wrong[0]], f"must be 0 where {zero} is 0"
            )


def _error_in_row(
    table_path: str | Path,
    line_numbers: np.ndarray,
    column_name: str,
    row_index: int,
    wrong_value: float,
    allowed_text: str,
) -> InputError:
    return InputError(
        table_path,
        f"line {line_numbers[row_index]}, column {column_name!r}",
        float(wrong_value),
        f"{allowed_text} (in SI units)",
    )


def _row_of_each_combination(
    table_path: str | Path, line_numbers: np.ndarray, combination_number: np.ndarray, node_axes: list
) -> np.ndarray:
    """Index of the row for each combination of nodes; every combination must occur exactly once."""
    shape = tuple(nodes.size for nodes, _ in node_axes)
    order = np.argsort(combination_number, kind="stable")
    twice = np.flatnonzero(np.diff(combination_number[order]) == 0)
    if twice.size:
        first, repeated = line_numbers[order[twice[0]]], line_numbers[order[twice[0] + 1]]
        raise InputError(table_path, f"line {repeated}", None, f"has the slip angle, load and slip of line {first}")
    missing = np.flatnonzero(np.bincount(combination_number, minlength=int(np.prod(shape))) == 0)
    if missing.size:
        angle, load, slip = (
            nodes[i] for (nodes, _), i in zip(node_axes, np.unravel_index(missing[0], shape), strict=True)
        )
        raise InputError(
            table_path,
            "rows",
            None,
            f"{missing.size} of {np.prod(shape)} combinations are missing, the first: "
            f"slip angle {np.rad2deg(angle):g} deg, load {load / 1e3:g} kN, slip {slip:g}",
        )
    return order


def _check_product(
    table_path: str | Path,
    line_numbers: np.ndarray,
    row_indices: np.ndarray,
    mu_x: np.ndarray,
    mu_y: np.ndarray,
    mu_y_product: np.ndarray,
) -> None:
    deviation = np.abs(mu_y_product - mu_y)
    worst = int(deviation.argmax())
    if deviation.flat[worst] > PRODUCT_TOLERANCE * max(mu_x.max(), mu_y.max()):
        raise _error_in_row(
            table_path,
            line_numbers,
            "mu_y",
            row_indices.flat[worst],
            mu_y.flat[worst],
            "is no product of g(slip angle, slip) and "
            f"h(slip angle, load): the best has {mu_y_product.flat[worst]:.4g} here, more than "
            f"{PRODUCT_TOLERANCE:.0%} of the "
            "largest away",
        )
