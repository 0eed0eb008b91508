"""What the writers of all formats share: groups of channels, checked beforehand; files whole or not at all."""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.whole_files import FULL


@dataclass(frozen=True)
class Group:
    """Channels to be written that share one clock; the first sample is at the file's start.

    names, units, comments : one text per channel. period : s. count : samples. blocks : arrays (n, channels) that
    follow each other and have ``count`` rows together, NaN where there is no value; taken once.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    comments: tuple[str, ...]
    period: float
    count: int
    blocks: Iterable[np.ndarray]

    def rows(self, path: Path) -> Iterator[tuple[int, np.ndarray]]:
        """First sample and values of every block; InputError where a value is infinite, ValueError for wrong shapes."""
        first = 0
        for block in self.blocks:
            values = np.asarray(block, float)
            if values.ndim != 2 or values.shape[1] != len(self.names) or first + len(values) > self.count:
                raise ValueError(f"a block of shape {values.shape} at sample {first} of {self.count}")
            if np.isinf(values).any():
                row, column = (int(i[0]) for i in np.nonzero(np.isinf(values)))
                raise InputError(
                    path,
                    f"channel {self.names[column]!r}, sample {first + row}",
                    None,
                    "an infinite value cannot be written",
                )
            yield first, values
            first += len(values)
        if first != self.count:
            raise ValueError(f"{first} samples instead of {self.count}")


def check_names(path: Path, groups: Sequence[Group]) -> None:
    """Refuse channels that a reader could not tell apart or a header could not hold."""
    names = [name for group in groups for name in group.names]
    for name in names:
        if not name.strip() or name != name.strip() or not name.isprintable():
            raise InputError(path, "channel", name, "a name of printable characters without spaces around is needed")
        if names.count(name) > 1:
            raise InputError(path, "channel", name, "every name may occur once in a file")
    if not names or any(group.count < 1 or not group.period > 0.0 for group in groups):
        raise InputError(path, "groups", len(groups), "channels with samples and a period above 0 are needed")


def one_group(path: Path, groups: Sequence[Group], form: str) -> Group:
    """Return the only group of a format with one clock."""
    if len(groups) != 1:
        raise InputError(path, "groups", len(groups), f"{form} has one sampling rate: write a file for each, or MDF 4")
    return groups[0]


def check_start(path: Path, start: datetime | None) -> None:
    """Refuse a start that does not name its zone."""
    if start is not None and start.tzinfo is None:
        raise InputError(path, "start", str(start), "a start with its time zone is needed")


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Path to write to, beside ``path`` and with its extension; ``path`` itself appears when all is written.

    Raises InputError where ``path`` exists, before or after, or nothing can be written; then nothing is left behind.
    """
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    if path.exists():
        raise _exists(path)
    if not path.parent.is_dir():
        raise InputError(path, "", None, "the file cannot be written: its folder does not exist")
    try:
        part.unlink(missing_ok=True)
        yield part
        os.link(part, path)  # unlike a rename, it never replaces what came into being meanwhile
    except FileExistsError:
        raise _exists(path) from None
    except OSError as error:
        if error.errno in FULL:
            raise
        raise InputError(path, "", None, f"the file cannot be written: {error.strerror or error}") from None
    finally:
        part.unlink(missing_ok=True)


def _exists(path: Path) -> InputError:
    return InputError(path, "", None, "the file exists already: name another one, as nothing is overwritten")
