"""Writes ASAM MDF 4.10 by asammdf: one channel group per clock, records appended block by block.

asammdf takes spaces away from the ends of the lines of a file's comment; all else comes back as it was given.
"""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.measured.formats.mdf4 import unheard
from models.measured.formats.writing import Group


def write_mdf(path: Path, part: Path, groups: Sequence[Group], start: datetime | None, comment: str) -> None:
    """Append the blocks to a temporary file beside ``part``, then save it as a whole."""
    try:
        from asammdf import MDF
    except ImportError:
        raise InputError(path, "", None, "MDF files need asammdf: pip install 'twinrig[measured]'") from None
    mdf = MDF(version="4.10", temporary_folder=str(part.parent))
    try:
        if start is None:
            mdf.header.abs_time = 0
        else:
            mdf.header.start_time = start
        mdf.header.comment = comment
        for index, group in enumerate(groups):
            for first, values in group.rows(path):
                _append(mdf, index, group, group.period * np.arange(first, first + len(values)), values)
        with unheard():
            mdf.save(part)
    finally:
        mdf.close()


def _append(mdf: Any, index: int, group: Group, times: np.ndarray, values: np.ndarray) -> None:
    """Add a block to a group that the first one begins."""
    from asammdf import Signal

    columns = np.ascontiguousarray(values.T)
    if times[0] > 0.0:
        mdf.extend(index, [(times, None), *((column, None) for column in columns)])
        return
    texts = zip(columns, group.names, group.units, group.comments, strict=True)
    mdf.append(
        [Signal(column, times, name=name, unit=unit, comment=text) for column, name, unit, text in texts],
        common_timebase=True,
    )
