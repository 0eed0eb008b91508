"""Tables of contacts, solved by FASTSIM block by block: each row has an ellipse, a load, friction and creepages.

Columns in any order, each with its unit: either ``a``, ``b`` (semi-axes) or ``A``, ``B`` (curvatures of the undeformed
distance), and ``load``, ``friction``, ``xi_x``, ``xi_y``, ``spin``. The output has a row for each row of the input, in
the same order: forces, moment, errors and a status, which is ``ok`` or what is wrong with that row.
"""

import csv
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.accuracy import (
    cells_error,
    coarser_cells,
    force_error_band,
    friction_share_with_moment,
    moment_error_band,
    slenderness_factor,
    spin_weight_of_motion,
)
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_load
from models.contact.inputs import Array
from models.core.errors import InputError
from models.core.tables import METRES, NEWTONS, PER_METRE, SHARES, RowBlock, table_blocks
from models.core.whole_files import whole_file
from models.ensemble.runner import values_in_order
from models.ensemble.store import ArraysByName, BlockStore
from models.systems.contact.scene import ContactMethod

MOTION_COLUMNS = {"load": NEWTONS, "friction": SHARES, "xi_x": SHARES, "xi_y": SHARES, "spin": PER_METRE}
BY_AXES = {"a": METRES, "b": METRES, **MOTION_COLUMNS}
BY_CURVATURES = {"A": PER_METRE, "B": PER_METRE, **MOTION_COLUMNS}
"""Input columns with their units, where the ellipse is given by its semi-axes or by the curvatures."""
OUTPUT_HEADINGS = (
    "line [-]",
    "fx [N]",
    "fy [N]",
    "mz [N m]",
    "stick [-]",
    "dissipation [N]",
    "error_of_cells [N]",
    "error_of_theory [N]",
    "moment_error_of_cells [N m]",
    "moment_error_of_theory [N m]",
    "status",
)
OUTPUT_COLUMNS = tuple(head.partition(" ")[0] for head in OUTPUT_HEADINGS[1:-1])
"""Names of the output's columns of numbers, in the order of ``forces`` of ``solved_rows``."""
ROW_FORMAT = "{},{:.9g},{:.9g},{:.9g},{:.6g},{:.9g}", ",{:.4g},{:.4g},{:.4g},{:.4g}", ",ok\n"
"""Format of an output row: line number and forces, then errors if they are requested, then the status."""
ERROR_COLUMNS = slice(6, 10)
"""Columns of the output that hold errors."""
ROWS_PER_BLOCK = 10_000
"""Rows of an output file that are read at once, and most rows that a result contains."""
LARGEST_BLOCKS_IN_ADVANCE = 8
"""Most blocks of rows that are computed in advance of the block being written."""
BuildContacts = Callable[[Array, Array], Any]
"""Function that makes ``Built`` from the coefficients of friction and the loads (N) of some rows."""


def solve_table(
    cases_path: Path,
    output_path: Path,
    build_contacts: BuildContacts,
    contact_method: ContactMethod,
    report_row_count: Callable[[int], None] = lambda rows: None,
    *,
    with_errors: bool = True,
    executor: Executor | None = None,
    block_store: BlockStore | None = None,
) -> dict[str, int]:
    """Compute the creep forces of all contacts in the CSV file ``cases_path`` and write them to ``output_path``.
    Returns the numbers of all rows and of refused rows.

    with_errors : whether the output has columns of errors, for which forces are computed again on half the cells.
    executor : computes the blocks of rows; block_store : keeps the finished blocks (see ``models.ensemble.runner``).
    Raises InputError for a file or a header that cannot be used; a wrong row gets a status and stops nothing.
    """
    build_contacts(np.ones(1), np.ones(1)).pair.require_likeness()  # the scene's mistake, not that of every row
    counts = {"rows": 0, "wrong": 0}
    reading, solve = (
        table_blocks(cases_path, (BY_AXES, BY_CURVATURES)),
        partial(solved_rows, build_contacts=build_contacts, contact_method=contact_method, with_errors=with_errors),
    )
    first = list(islice(reading, 1))  # before the answer's file is made, so that a wrong header leaves none
    with whole_file(output_path) as partial_path, partial_path.open("w") as file:
        heads = (
            OUTPUT_HEADINGS
            if with_errors
            else tuple(head for head in OUTPUT_HEADINGS if head not in OUTPUT_HEADINGS[ERROR_COLUMNS])
        )
        file.write(",".join(heads) + "\n")
        for block, answers in values_in_order(
            solve, chain(first, reading), executor, block_store, LARGEST_BLOCKS_IN_ADVANCE
        ):
            wrong = dict(zip(answers["wrong"].tolist(), answers["why"].tolist(), strict=True))
            rows = enumerate(zip(block.lines, answers["forces"].tolist(), strict=True))
            file.writelines(_output_line(line, row, wrong.get(i)) for i, (line, row) in rows)
            counts["rows"] += len(block.lines)
            counts["wrong"] += len(wrong)
            report_row_count(counts["rows"])
    return counts


def compile_kernels(build_contacts: BuildContacts, contact_method: ContactMethod) -> None:
    """Compile the contact kernels or load them from the cache, so that a time measured later is that of the rows."""
    unit = np.ones(1)
    _forces({"A": unit, "B": unit, **dict.fromkeys(MOTION_COLUMNS, unit)}, build_contacts, contact_method)


def solved_rows(
    row_block: RowBlock, build_contacts: BuildContacts, contact_method: ContactMethod, with_errors: bool
) -> ArraysByName:
    """Solve a block of rows. Returns ``forces`` (rows, columns), the indices ``wrong`` (m,) of refused rows, and the
    reasons ``why`` (m,).
    """
    columns = len(OUTPUT_HEADINGS) - 2 - (0 if with_errors else ERROR_COLUMNS.stop - ERROR_COLUMNS.start)
    forces, wrong = _forces_or_refusals(
        row_block,
        partial(_forces, build_contacts=build_contacts, contact_method=contact_method, with_errors=with_errors),
        columns,
    )
    return {"forces": forces, "wrong": np.array([*wrong], dtype=int), "why": np.array([*wrong.values()], dtype=str)}


def _forces_or_refusals(
    row_block: RowBlock, solve_rows: Callable[[dict[str, Any]], Array], column_count: int
) -> tuple[Array, dict[int, str]]:
    """Solve the sound rows of a block. Returns forces (rows, columns), NaN in refused rows, and the reason for each
    refusal by row index.
    """
    answers, wrong = np.full((len(row_block.lines), column_count), np.nan), dict(row_block.faulty_rows)
    good = np.array([i for i in range(len(row_block.lines)) if i not in wrong], dtype=int)
    answers[good], refused = _forces_of_rows(
        {name: column[good] for name, column in row_block.values.items()}, solve_rows, column_count
    )
    return answers, wrong | {int(good[i]): text for i, text in refused.items()}


def _forces_of_rows(
    columns_by_name: dict[str, Array], solve_rows: Callable[[dict[str, Any]], Array], column_count: int
) -> tuple[Array, dict[int, str]]:
    """Solve all rows. Returns forces (rows, columns), and the reason for each row that the theory refuses, by row
    index. Refused rows are located by halving the block.
    """
    count = len(next(iter(columns_by_name.values())))
    if count == 0:
        return np.empty((0, column_count)), {}
    try:
        return solve_rows(columns_by_name), {}
    except InputError as error:
        if count == 1:
            return np.full((1, column_count), np.nan), {0: str(error).replace("[0]", "")}
    half = count // 2
    (low, wrong), (high, wrong_in_high) = (
        _forces_of_rows({name: column[rows] for name, column in columns_by_name.items()}, solve_rows, column_count)
        for rows in (slice(half), slice(half, None))
    )
    return np.concatenate([low, high]), wrong | {half + i: text for i, text in wrong_in_high.items()}


def _forces(
    columns_by_name: dict[str, Any],
    build_contacts: BuildContacts,
    contact_method: ContactMethod,
    with_errors: bool = True,
) -> Array:
    """Creep forces, moment, stick share, dissipation and errors by FASTSIM, shape (rows, columns). Raises InputError if
    a row is outside the range of the theory.
    """
    load, friction, xi_x, xi_y, spin = (columns_by_name[name] for name in MOTION_COLUMNS)
    touching = build_contacts(friction, load)
    load, friction, pair = touching.load, touching.friction, touching.pair
    if touching.falling is not None:
        raise InputError("", "effects", None, "make friction fall, and a table of cases has constant friction")
    if "A" in columns_by_name:
        area = by_load(columns_by_name["A"], columns_by_name["B"], load, pair)
        a, b = area.a, area.b
    else:
        a, b = columns_by_name["a"], columns_by_name["b"]
    choices: dict[str, Any] = contact_method.model_dump(include={"march", "bound", "flexibilities"})
    ellipses = RollingEllipse(a, b, load, friction, xi_x, xi_y, spin)
    fine = fastsim(ellipses, pair, cells=contact_method.cells, **choices)
    forces = [fine.fx, fine.fy, fine.mz, fine.stick, fine.dissipation]
    if with_errors:
        coarse = fastsim(ellipses, pair, cells=coarser_cells(contact_method.cells), **choices)
        limit = friction * np.maximum(load, 0.0)
        a, b = (np.where(limit > 0, axis, 1.0) for axis in (a, b))
        share = spin_weight_of_motion(a, b, np.array([xi_x, xi_y, spin]), pair.nu)
        forces += _force_errors(fine, coarse, limit, a, b, share, contact_method)
    return np.column_stack(forces) + 0.0


def _force_errors(
    fine_forces: Any,
    coarse_forces: Any,
    friction_limit: Array,
    a: Array,
    b: Array,
    spin_share_of_creepage: Array,
    contact_method: ContactMethod,
) -> list[Array]:
    """Errors of the cells and of the theory in the forces (N), then in the moments (N m). friction_limit : mu N; share
    : share of the creepage that is due to spin.
    """
    moment_limit = friction_limit * np.maximum(a, b)
    relative, relative_coarse = (
        np.divide(
            [creep.fx, creep.fy, creep.mz],
            [friction_limit, friction_limit, moment_limit],
            out=np.zeros((3, friction_limit.size)),
            where=friction_limit > 0,
        )
        for creep in (fine_forces, coarse_forces)
    )
    left = cells_error(relative, relative_coarse, contact_method.cells, contact_method.order)
    used, wider = np.hypot(relative[0], relative[1]), slenderness_factor(a, b)
    theory = wider * friction_limit * force_error_band(contact_method.error_band_name, used, spin_share_of_creepage)
    moment = (
        wider
        * moment_limit
        * moment_error_band(
            contact_method.error_band_name, friction_share_with_moment(used, relative[2]), spin_share_of_creepage
        )
    )
    return [friction_limit * left, theory, moment_limit * left, moment]


def _output_line(line_number: int, force_row: list[float], refusal_reason: str | None) -> str:
    """Returns a line of the output file; the reason for a refused row is put into quotation marks."""
    if refusal_reason is None:
        numbers, errors, status = ROW_FORMAT
        return (numbers + (errors if len(force_row) > ERROR_COLUMNS.start else "") + status).format(
            line_number, *force_row
        )
    text = refusal_reason.replace('"', "'")
    return f'{line_number}{"," * (len(force_row) + 1)}"{text}"\n'


def column_sizes(output_path: Path) -> dict[str, dict[str, Any]]:
    """Largest magnitude and root mean square of every column of an output file, with its unit, over the rows with
    status ``ok``. The file is read block by block.
    """
    with output_path.open(newline="") as file:
        rows = csv.reader(file)
        heads = [_name_and_unit(head) for head in next(rows)[1:-1]]
        largest, squares, count = np.zeros(len(heads)), np.zeros(len(heads)), 0
        while block := list(islice(rows, ROWS_PER_BLOCK)):
            sound = np.array([row[1:-1] for row in block if row[-1] == "ok"], float).reshape(-1, len(heads))
            largest = np.maximum(largest, np.abs(sound).max(axis=0, initial=0.0))
            squares, count = squares + (sound**2).sum(axis=0), count + len(sound)
    return {
        name: {"unit": unit, "largest": float(largest_magnitude), "rms": float(np.sqrt(square / count))}
        for (name, unit), largest_magnitude, square in zip(heads, largest, squares, strict=True)
        if count
    }


def first_rows(output_path: Path) -> dict[str, tuple[str, np.ndarray]]:
    """Columns of the first ROWS_PER_BLOCK rows of an output file, as name -> (unit, values); NaN in refused rows."""
    with output_path.open(newline="") as file:
        heads, *rows = islice(csv.reader(file), ROWS_PER_BLOCK + 1)
    *columns, status = np.array(rows, dtype=object).reshape(-1, len(heads)).T
    columns = [np.array([float(cell or "nan") for cell in column]) for column in columns]
    named = {name: (unit, values) for (name, unit), values in zip(map(_name_and_unit, heads), columns, strict=False)}
    return named | {"status": ("", status.astype(str))}


def _name_and_unit(heading: str) -> tuple[str, str]:
    """Name and unit of a column with the heading "name [unit]"."""
    name, _, unit = heading.rstrip("]").partition(" [")
    return name, unit
