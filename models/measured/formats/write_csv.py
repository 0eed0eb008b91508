"""Writes CSV that ``models.measured.formats.csv`` reads back to the last bit."""

import csv
import io
import json
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from models.core.csv_header import heading
from models.core.errors import InputError
from models.measured.formats.csv_layout import is_clock
from models.measured.formats.writing import Group, one_group


def write_csv(path: Path, part: Path, groups: Sequence[Group], start: datetime | None, comment: str) -> None:
    """Write the header to the file ``part``, then rows of shortest numbers, block by block."""
    group = one_group(path, groups, "CSV")
    for name, unit in zip(group.names, group.units, strict=True):
        if is_clock(name):
            raise InputError(path, "channel", name, "a CSV file has one column of times: give the channel another name")
        if heading(f"{name} [{unit}]") != (name, unit) or not unit.isprintable():
            raise InputError(path, f"channel {name!r}, unit", unit, "a unit in CSV has no brackets and no line ends")
    with part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(header(group, start, comment))
        for first, values in group.rows(path):
            times = [f"{t:.15g}" for t in (group.period * np.arange(first, first + len(values))).tolist()]
            file.writelines(f"{t},{','.join(map(repr, row))}\n" for t, row in zip(times, values.tolist(), strict=True))


def header(group: Group, start: datetime | None, comment: str) -> str:
    """Comment lines and headings; ``# samples:`` lets a reader see that the file was cut off."""
    lines = [f"comment: {line}" for line in comment.splitlines()]
    lines += [] if start is None else [f"start: {start.isoformat()}"]
    lines += [f"samples: {group.count}"]
    for name, text in zip(group.names, group.comments, strict=True):
        lines += [f"channel {json.dumps(name, ensure_ascii=False)}: {line}" for line in text.splitlines()]
    headings = io.StringIO()
    names = [f"{name} [{unit}]" for name, unit in zip(group.names, group.units, strict=True)]
    if ";" in "".join(names):  # it would look like a separator
        csv.writer(headings, lineterminator="\n", quoting=csv.QUOTE_ALL).writerow(["time [s]", *names])
    else:
        csv.writer(headings, lineterminator="\n").writerow(["time [s]", *names])
    return "".join(f"# {line}\n" for line in lines) + headings.getvalue()
