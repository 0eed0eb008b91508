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


class ReadableSamples(ABC):
    """Interface of the samples of several signals, each of which can be read by its name."""

    @abstractmethod
    def read(self, signal_name: str, first_sample: int = 0, sample_count: int | None = None) -> np.ndarray:
        """Samples (n,) of one signal from sample ``first_sample`` on; all that follow if ``sample_count`` is None."""

    def block(self, signal_names: tuple[str, ...], first_sample: int, sample_count: int) -> np.ndarray:
        """Samples (n, names) of several signals."""
        return np.column_stack([self.read(name, first_sample, sample_count) for name in signal_names])


class SampleFile(ReadableSamples):
    """Samples (signals, count) as doubles in one file on disk; NaN marks missing measurements."""

    def __init__(self, sample_path: Path, signal_names: tuple[str, ...], sample_count: int) -> None:
        """Continue the file that was begun with the same names and count, or begin a new one; InputError where the file
        belongs to other names or another count."""
        self.path, self.names, self.count = sample_path, signal_names, sample_count
        self._journal = sample_path.with_suffix(".json")
        described = {"names": list(signal_names), "count": sample_count}
        if self._journal.is_file():
            journal = json.loads(self._journal.read_text())
            if {key: journal.get(key) for key in described} != described:
                raise InputError(sample_path, "", None, "holds other signals: choose another folder")
            self.done = int(journal["done"])
        else:
            with sample_path.open("wb") as file:
                file.truncate(len(signal_names) * sample_count * SAMPLE_TYPE.itemsize)
            self.close(0)

    def close(self, completed_count: int) -> None:
        """Record in the file's journal that the first ``completed_count`` samples of every signal are complete."""
        self.done = completed_count
        text = json.dumps({"names": list(self.names), "count": self.count, "done": completed_count})
        write_whole(self._journal, text)

    def put(self, signal_names: tuple[str, ...], first_sample: int, samples: np.ndarray) -> None:
        """Store samples (n, names) of some signals from sample ``first_sample`` on, without recording them as
        complete.
        """
        with self.path.open("r+b") as file:
            for name, column in zip(signal_names, np.asarray(samples, SAMPLE_TYPE).T, strict=True):
                file.seek((self.names.index(name) * self.count + first_sample) * SAMPLE_TYPE.itemsize)
                file.write(np.ascontiguousarray(column).tobytes())
            file.flush()
            os.fsync(file.fileno())

    def write(self, first_sample: int, samples: np.ndarray) -> None:
        """Store samples (n, signals) of all signals from sample ``first_sample`` on, and record all samples up to their
        end as complete."""
        self.put(self.names, first_sample, samples)
        self.close(first_sample + len(samples))

    def read(self, signal_name: str, first_sample: int = 0, sample_count: int | None = None) -> np.ndarray:
        """Samples (n,) of one signal from sample ``first_sample`` on; all that follow if ``sample_count`` is None."""
        n = self.count - first_sample if sample_count is None else min(sample_count, self.count - first_sample)
        offset = (self.names.index(signal_name) * self.count + first_sample) * SAMPLE_TYPE.itemsize
        return np.fromfile(self.path, SAMPLE_TYPE, n, offset=offset)

    def remove(self) -> None:
        """Delete the file of samples and its journal."""
        self.path.unlink()
        self._journal.unlink()


class SamplesInMemory(ReadableSamples):
    """Samples (count, signals) of several signals in memory, read only."""

    def __init__(self, signal_names: tuple[str, ...], samples: np.ndarray) -> None:
        self.names, self.count, self._samples = signal_names, len(samples), samples

    def read(self, signal_name: str, first_sample: int = 0, sample_count: int | None = None) -> np.ndarray:
        """Samples (n,) of one signal from sample ``first_sample`` on; all that follow if ``sample_count`` is None."""
        last = self.count if sample_count is None else first_sample + sample_count
        return np.array(self._samples[first_sample:last, self.names.index(signal_name)])
