"""Tables of contacts: a row each with an ellipse, a load, friction and creepages; answered block by block.

Columns in any order, each with its unit: either ``a``, ``b`` (semi-axes) or ``A``, ``B`` (curvatures of the undeformed
distance), and ``load``, ``friction``, ``xi_x``, ``xi_y``, ``spin``. The answer has a row for each row, in the same
order: forces, moment, errors and a status, which is ``ok`` or what is wrong with that row.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from models.contact.accuracy import band, cells_error, halved, moment_band, slenderness, spin_share, used_with_moment
from models.contact.fastsim import fastsim
from models.contact.hertz import by_load
from models.contact.material import Pair
from models.core.errors import InputError
from models.core.table_stream import Block, blocks
from models.core.tables import METRES, NEWTONS, PER_METRE, SHARES
from models.core.whole_files import whole_file
from models.systems.contact.built import Built
from models.systems.contact.scene import Method

MOTION = {"load": NEWTONS, "friction": SHARES, "xi_x": SHARES, "xi_y": SHARES, "spin": PER_METRE}
BY_AXES = {"a": METRES, "b": METRES, **MOTION}
BY_CURVATURES = {"A": PER_METRE, "B": PER_METRE, **MOTION}
HEADER = (
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
ANSWERS = 9
"""Columns of numbers behind the line."""
Progress = Callable[[int], None]
Extend = Callable[[Built], Built]
"""What the effects of a scene make of the rows of a block."""


def answer(
    path: Path,
    out: Path,
    pair: Pair,
    method: Method,
    progress: Progress = lambda rows: None,
    extend: Extend = lambda built: built,
) -> dict[str, int]:
    """Answer the table at ``path`` into ``out``; returns how many rows there are and how many were wrong.

    Raises InputError for a file or a header that cannot be used; a wrong row gets a status and stops nothing.
    """
    pair.require_likeness()  # the scene's mistake, not that of every row
    counts = {"rows": 0, "wrong": 0}
    reading = blocks(path, (BY_AXES, BY_CURVATURES))
    first = next(reading, None)
    with whole_file(out) as part, part.open("w") as file:
        file.write(",".join(HEADER) + "\n")
        for block in _with(first, reading):
            found, wrong = _answered(block, pair, method, extend)
            _write(file, block, found, wrong)
            counts["rows"] += len(block.lines)
            counts["wrong"] += len(wrong)
            progress(counts["rows"])
    return counts


def compile_first(pair: Pair, method: Method, extend: Extend = lambda built: built) -> None:
    """Have the kernels behind ``answer`` compiled or loaded, for times that are those of the rows."""
    one = np.ones(1)
    _forces({"A": one, "B": one, **dict.fromkeys(MOTION, one)}, pair, method, extend)


def _with(first: Block | None, others: Iterator[Block]) -> Iterator[Block]:
    """All blocks; the first was read before the answer's file was made, so that a wrong header leaves none."""
    if first is not None:
        yield first
    yield from others


def _answered(block: Block, pair: Pair, method: Method, extend: Extend) -> tuple[np.ndarray, dict[int, str]]:
    """Answers (rows, ANSWERS), NaN where a row is wrong, and what is wrong there."""
    found, wrong = np.full((len(block.lines), ANSWERS), np.nan), dict(block.wrong)
    good = np.array([i for i in range(len(block.lines)) if i not in wrong], dtype=int)
    values = {name: column[good] for name, column in block.values.items()}
    found[good], refused = _sound(values, lambda some: _forces(some, pair, method, extend))
    wrong |= {int(good[i]): text for i, text in refused.items()}
    return found, wrong


def _sound(
    values: dict[str, np.ndarray], solve: Callable[[dict[str, Any]], np.ndarray]
) -> tuple[np.ndarray, dict[int, str]]:
    """Answers of all rows; rows that are refused are found by halving, and the others answered without them."""
    count = len(next(iter(values.values())))
    if count == 0:
        return np.empty((0, ANSWERS)), {}
    try:
        return solve(values), {}
    except InputError as error:
        if count == 1:
            return np.full((1, ANSWERS), np.nan), {0: str(error).replace("[0]", "")}
    half = count // 2
    low, wrong = _sound({name: column[:half] for name, column in values.items()}, solve)
    high, others = _sound({name: column[half:] for name, column in values.items()}, solve)
    return np.concatenate([low, high]), wrong | {half + i: text for i, text in others.items()}


def _forces(values: dict[str, Any], pair: Pair, method: Method, extend: Extend) -> np.ndarray:
    """Answers (rows, ANSWERS); raises InputError if a row is out of what the theory takes."""
    load, friction, xi_x, xi_y, spin = (values[name] for name in MOTION)
    built = extend(Built(pair, friction, load))
    load, friction, pair = built.load, built.friction, built.pair
    if built.falling is not None:
        raise InputError("", "effects", None, "make friction fall, and a table of cases has constant friction")
    if "A" in values:
        touching = by_load(values["A"], values["B"], load, pair)
        a, b = touching.a, touching.b
    else:
        a, b = values["a"], values["b"]
    choices: dict[str, Any] = method.model_dump(include={"march", "bound", "flexibilities"})
    fine, coarse = (
        fastsim(a, b, load, friction, xi_x, xi_y, spin, pair, cells=n, **choices)
        for n in (method.cells, halved(method.cells))
    )
    limit = friction * np.maximum(load, 0.0)
    a, b = (np.where(limit > 0, axis, 1.0) for axis in (a, b))
    most, share = limit * np.maximum(a, b), spin_share(a, b, np.array([xi_x, xi_y, spin]), pair.nu)
    relative, other = (
        np.divide([one.fx, one.fy, one.mz], [limit, limit, most], out=np.zeros((3, limit.size)), where=limit > 0)
        for one in (fine, coarse)
    )
    left = cells_error(relative, other, method.cells, method.order)
    used, wider = np.hypot(relative[0], relative[1]), slenderness(a, b)
    theory = wider * limit * band(method.band, used, share)
    moment = wider * most * moment_band(method.band, used_with_moment(used, relative[2]), share)
    return (
        np.column_stack(
            [fine.fx, fine.fy, fine.mz, fine.stick, fine.dissipation, limit * left, theory, most * left, moment]
        )
        + 0.0
    )


def _write(file: TextIO, block: Block, found: np.ndarray, wrong: dict[int, str]) -> None:
    for i, (line, row) in enumerate(zip(block.lines, found.tolist(), strict=True)):
        if i in wrong:
            file.write(f'{line}{"," * (ANSWERS + 1)}"{_plain(wrong[i])}"\n')
        else:
            file.write(f"{line}," + "%.9g,%.9g,%.9g,%.6g,%.9g,%.4g,%.4g,%.4g,%.4g,ok\n" % tuple(row))  # noqa: UP031


def _plain(text: str) -> str:
    """A text for within quotation marks."""
    return text.replace('"', "'")
