"""Samples of many signals in one file on disk: each signal can be read alone, or all signals block by block.

Nothing but the part asked for is in memory. What is written is counted in a journal beside it, written whole or not at
all, so that whoever is interrupted goes on where the journal says.
"""

import json
import os
from abc import ABC, abstractmethod
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.whole_files import write_whole

SAMPLE_TYPE = np.dtype("<f8")


class Readable(ABC):
    """Interface of the samples of several signals, each of which can be read by its name."""

    @abstractmethod
    def read(self, name: str, first: int = 0, count: int | None = None) -> np.ndarray:
        """Samples (n,) of one signal from sample ``first`` on; all that follow if ``count`` is None."""

    def block(self, names: tuple[str, ...], first: int, count: int) -> np.ndarray:
        """Samples (n, names) of several signals."""
        return np.column_stack([self.read(name, first, count) for name in names])


class Columns(Readable):
    """Samples (signals, count) as doubles in one file on disk; NaN marks missing measurements."""

    def __init__(self, path: Path, names: tuple[str, ...], count: int) -> None:
        """Continue the file that was begun with the same names and count, or begin a new one; InputError where the file
        belongs to other names or another count."""
        self.path, self.names, self.count = path, names, count
        self._journal = path.with_suffix(".json")
        described = {"names": list(names), "count": count}
        if self._journal.is_file():
            journal = json.loads(self._journal.read_text())
            if {key: journal.get(key) for key in described} != described:
                raise InputError(path, "", None, "holds other signals: choose another folder")
            self.done = int(journal["done"])
        else:
            with path.open("wb") as file:
                file.truncate(len(names) * count * SAMPLE_TYPE.itemsize)
            self.close(0)

    def close(self, completed: int) -> None:
        """Record in the file's journal that the first ``completed`` samples of every signal are complete."""
        self.done = completed
        text = json.dumps({"names": list(self.names), "count": self.count, "done": completed})
        write_whole(self._journal, text)

    def put(self, names: tuple[str, ...], first: int, values: np.ndarray) -> None:
        """Store samples (n, names) of some signals from sample ``first`` on, without recording them as complete."""
        with self.path.open("r+b") as file:
            for name, column in zip(names, np.asarray(values, SAMPLE_TYPE).T, strict=True):
                file.seek((self.names.index(name) * self.count + first) * SAMPLE_TYPE.itemsize)
                file.write(np.ascontiguousarray(column).tobytes())
            file.flush()
            os.fsync(file.fileno())

    def write(self, first: int, values: np.ndarray) -> None:
        """Store samples (n, signals) of all signals from sample ``first`` on, and record all samples up to their end as
        complete."""
        self.put(self.names, first, values)
        self.close(first + len(values))

    def read(self, name: str, first: int = 0, count: int | None = None) -> np.ndarray:
        """Samples (n,) of one signal from sample ``first`` on; all that follow if ``count`` is None."""
        n = self.count - first if count is None else min(count, self.count - first)
        offset = (self.names.index(name) * self.count + first) * SAMPLE_TYPE.itemsize
        return np.fromfile(self.path, SAMPLE_TYPE, n, offset=offset)

    def remove(self) -> None:
        """Delete the file of samples and its journal."""
        self.path.unlink()
        self._journal.unlink()


class MemoryColumns(Readable):
    """Samples (count, signals) of several signals in memory, read only."""

    def __init__(self, names: tuple[str, ...], samples: np.ndarray) -> None:
        self.names, self.count, self._samples = names, len(samples), samples

    def read(self, name: str, first: int = 0, count: int | None = None) -> np.ndarray:
        """Samples (n,) of one signal from sample ``first`` on; all that follow if ``count`` is None."""
        last = self.count if count is None else first + count
        return np.array(self._samples[first:last, self.names.index(name)])
