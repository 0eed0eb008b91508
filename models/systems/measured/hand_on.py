"""Section forces into files for whoever goes on with them."""

from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from models.measured.channel import BLOCK
from models.measured.formats import write
from models.measured.formats.writing import Group
from models.systems.measured.section_run import Outcome
from models.systems.measured.sections import Answer

NAME = "section_forces"


def hand_on(
    run: Outcome,
    folder: Path,
    formats: Iterable[str],
    answers: Sequence[Answer] | None = None,
    start: datetime | None = None,
    comment: str = "",
) -> list[Path]:
    """Write forces and moments of a run, or the answers named, as ``section_forces.EXT`` for every extension.

    Names, units and comments (axes and signs) go along, block by block. Returns the paths; raises InputError where a
    file exists or a format has no room for a name.
    """
    asked = forces(run.answers) if answers is None else tuple(answers)
    return [write(folder / f"{NAME}.{extension}", [group(run, asked)], start, comment) for extension in formats]


def forces(answers: Iterable[Answer]) -> tuple[Answer, ...]:
    """Those answers that are section forces and moments."""
    return tuple(answer for answer in answers if answer.section and answer.unit in ("N", "N m"))


def group(run: Outcome, answers: Sequence[Answer]) -> Group:
    """Answers of a run as channels of one clock."""
    return Group(
        tuple(answer.name for answer in answers),
        tuple(answer.unit for answer in answers),
        tuple(answer.comment for answer in answers),
        run.period,
        run.done,
        _blocks(run, answers),
    )


def _blocks(run: Outcome, answers: Sequence[Answer]) -> Iterator[np.ndarray]:
    names = tuple(answer.name for answer in answers)
    for first in range(0, run.done, BLOCK):
        yield run.columns.block(names, first, min(BLOCK, run.done - first))
