"""An odd measurement file: how it is made, what must become of it, and how far what is read is from the truth."""

import hashlib
import time
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from models.core.errors import InputError
from models.measured.channel import Source
from models.measured.formats import open_source, write
from models.measured.formats.writing import ChannelGroup

Wanted = Literal["right", "named", "refused"]
"""Read right, read right as far as it goes with a sentence about it, or refused with a reason."""
Truth = Mapping[str, tuple[np.ndarray, np.ndarray]]
Make = Callable[[Path], Path]
"""Writes a file into a folder, and returns its path."""
Files = dict[str, tuple[Any, ...]]
"""By name: what makes a file hard, how it is made, a phrase of what is said of it, and its truth unless the usual one;
nothing is said of those that are read right."""
SAMPLE_COUNT, SAMPLE_PERIOD = 40, 0.01
"""Samples of the usual file, s between them."""
SAMPLE_TIMES = SAMPLE_PERIOD * np.arange(SAMPLE_COUNT)
FZ, FX = 1000.0 + 2.0**-6 * np.arange(SAMPLE_COUNT), -2.5 * np.arange(SAMPLE_COUNT)
"""Values with a few bits, which every format keeps exactly."""
SLOW_PERIOD = 0.05
"""s between samples of a channel of another rate."""
TWO_RATES = {"Fz": (SAMPLE_TIMES, FZ), "Fx": (SLOW_PERIOD * np.arange(SAMPLE_COUNT), FX)}
MANY_CHANNELS = {f"c{i}": (SAMPLE_TIMES, FZ + i) for i in range(300)}
"""Truth of files of two rates, and of 300 channels."""
REPEATED_NAME = {"Fz (1)": (SAMPLE_TIMES, FZ), "Fz (2)": (SAMPLE_TIMES, FX)}
"""Truth of a file that has the same name twice."""
TOLERANCE = 1e-12
"""Of times and values alike: CSV writes times with 15 digits, the values are kept to the last bit."""
MEMORY, SECONDS = 5e7, 10.0
"""Bytes and seconds that no file of some kilobytes may take, whatever it claims."""


def usual(**changed: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Expected times and values of the two channels of the usual file, or other values under a channel's name."""
    return {name: (SAMPLE_TIMES, changed.get(name, values)) for name, values in (("Fz", FZ), ("Fx", FX))}


@dataclass(frozen=True)
class OddFile:
    """An unusual or damaged file, and what reading it should give.

    make : writes it into a folder and returns its path. wanted, says : what must become of it, and a phrase of the
    refusal or of what is noticed. truth : channel -> times and values; a named file may give the first of them.
    greedy : whether it claims a size that must not be taken.
    """

    name: str
    hard: str
    make: Make
    wanted: Wanted
    says: str = ""
    truth: Truth = field(default_factory=usual)
    greedy: bool = False

    def error(self, folder: Path) -> float:
        """Largest difference of the values read from the expected ones; infinite if a channel or sample is missing. The
        reader's refusal passes through. Raises AssertionError where a refusal does not name the reason, the folder was
        changed, or reading took too much time or memory."""
        folder.mkdir(parents=True, exist_ok=True)
        path = self.make(folder)
        state_before = _state(folder)
        try:
            return self._measured(path)
        except InputError as refusal:
            if path.name not in str(refusal) or self.says not in str(refusal) or "\n" in str(refusal):
                raise AssertionError(f"{self.name}: {refusal} does not say {self.says!r}") from refusal
            raise
        finally:
            if _state(folder) != state_before:
                raise AssertionError(f"{self.name}: something was written beside {path} or into it")

    def _measured(self, path: Path) -> float:
        """Error of the values read, with a check that time and memory are those of a small file."""
        if not self.greedy:
            return difference(open_source(path), self.truth, self.says if self.wanted == "named" else "")
        tracemalloc.start()
        began = time.perf_counter()
        try:
            return difference(open_source(path), self.truth, self.says if self.wanted == "named" else "")
        finally:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            if peak > MEMORY or time.perf_counter() - began > SECONDS:
                raise AssertionError(f"{self.name}: {peak / 1e6:.0f} MB, {time.perf_counter() - began:.1f} s")


def every(
    refused: Files | None = None,
    named_files: Files | None = None,
    right_files: Files | None = None,
    greedy: Sequence[str] = (),
) -> tuple[OddFile, ...]:
    """All files of these three tables; greedy : names of files that claim a huge size, for which no memory may be
    allocated."""
    tables: tuple[tuple[Wanted, Files], ...] = (
        ("refused", refused or {}),
        ("named", named_files or {}),
        ("right", right_files or {}),
    )
    odds = list[OddFile]()
    for wanted, files in tables:
        for name, (hard, make, *expectation) in files.items():
            says, *truth = expectation if wanted != "right" else ("", *expectation)
            odds.append(OddFile(name, hard, make, wanted, says, truth[0] if truth else usual(), name in greedy))
    return tuple(odds)


def _state(folder: Path) -> dict[str, str]:
    """Digest of all files below a folder, to see whether any of them changed."""
    return {str(p): hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.rglob("*")) if p.is_file()}


def read(measurement_source: Source) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Times and values of every channel, read in several blocks."""
    channels: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for group in {channel.group for channel in measurement_source.channels}:
        names = [channel.name for channel in measurement_source.channels if channel.group == group]
        count = next(channel.count for channel in measurement_source.channels if channel.group == group)
        blocks = list(measurement_source.blocks(names, 1 + count // (6 if len(names) < 100 else 1)))
        sample_times, values = (
            np.concatenate([getattr(block, key) for block in blocks]) for key in ("times", "values")
        )
        channels |= {name: (sample_times, values[:, i]) for i, name in enumerate(names)}
    return channels


def difference(measurement_source: Source, truth: Truth, expected_text: str) -> float:
    """Largest difference between a file and the expected values; infinite if a channel, a sample or the reader's
    message is missing."""
    channels, finding_texts = (
        read(measurement_source),
        [finding.text for finding in measurement_source.findings if finding.weight != "note" or expected_text],
    )
    if set(channels) != set(truth) or not (
        any(expected_text in text for text in finding_texts) if expected_text else not finding_texts
    ):
        return np.inf
    return max(_largest_difference(channels[name], truth[name], bool(expected_text)) for name in truth)


def _largest_difference(
    read_channel: tuple[np.ndarray, np.ndarray], truth: tuple[np.ndarray, np.ndarray], partial_allowed: bool
) -> float:
    """Largest difference of times and values. With ``partial_allowed`` the first samples alone may have been read."""
    count = len(read_channel[0])
    if count == 0 or count > len(truth[0]) or (count < len(truth[0]) and not partial_allowed):
        return np.inf
    true_times, values = truth[0][:count], truth[1][:count]
    if not np.array_equal(np.isnan(read_channel[1]), np.isnan(values)):
        return np.inf
    return float(
        max(np.abs(read_channel[0] - true_times).max(), np.nanmax(np.abs(read_channel[1] - values), initial=0.0))
    )


def written(path: Path, names: tuple[str, ...] = ("Fz", "Fx"), values: np.ndarray | None = None) -> Path:
    """Write channels (by default those of the usual file) in the format that the extension of ``path`` names."""
    table = np.column_stack((FZ, FX)) if values is None else values
    group = ChannelGroup(names, ("N",) * len(names), ("",) * len(names), SAMPLE_PERIOD, len(table), [table])
    return write(path, [group])


def raw(raw_bytes: bytes, name: str = "odd.csv") -> Make:
    """Make a file of bytes."""

    def make(folder: Path) -> Path:
        (folder / name).write_bytes(raw_bytes)
        return folder / name

    return make


def plain(file_extension: str) -> Make:
    """Make the usual file."""
    return lambda folder: written(folder / f"odd{file_extension}")


def wide(file_extension: str) -> Make:
    """Make a file of 300 channels."""
    table = np.column_stack([values for _, values in MANY_CHANNELS.values()])
    return lambda folder: written(folder / f"odd{file_extension}", tuple(MANY_CHANNELS), table)


def altered(make_file: Make, change: Callable[[bytes], bytes], name: str = "") -> Make:
    """Function that makes a file with changed bytes or another name."""

    def altered_file(folder: Path) -> Path:
        path = make_file(folder)
        path.write_bytes(change(path.read_bytes()))
        return path.rename(folder / name) if name else path

    return altered_file


def patched(raw_bytes: bytes, byte_offset: int, new_bytes: bytes) -> bytes:
    """Bytes of a file, in which ``new_bytes`` replaces those from an offset on."""
    return raw_bytes[:byte_offset] + new_bytes + raw_bytes[byte_offset + len(new_bytes) :]


def two_rates(file_extension: str) -> Make:
    """Make a file of two groups of different rates."""
    clocks = (("Fz", SAMPLE_PERIOD, FZ), ("Fx", SLOW_PERIOD, FX))

    def make(folder: Path) -> Path:
        groups = [
            ChannelGroup((name,), ("N",), ("",), period, SAMPLE_COUNT, [samples[:, None]])
            for name, period, samples in clocks
        ]
        return write(folder / f"odd{file_extension}", groups)

    return make


def called(file_extension: str, name: str) -> Make:
    """Make the usual file under another name."""
    return altered(plain(file_extension), bytes, name)


@dataclass(frozen=True)
class CutSweep:
    """A file cut off at many places. Each must be refused, or its remaining samples must be read right and reported as
    incomplete.

    cuts : number of places, spread evenly over the file; 0 for every byte.
    """

    extension: str
    cuts: int = 40

    def silent(self, folder: Path) -> int:
        """Number of cuts after which wrong values are read, or the cut is not reported."""
        folder.mkdir(parents=True, exist_ok=True)
        count = 7000 if self.extension == ".rsp" else SAMPLE_COUNT  # three groups of RPC III and a half
        table = np.column_stack((FZ, FX)) if count == SAMPLE_COUNT else np.arange(float(count))[:, None] * [1.0, -2.5]
        path = written(folder / f"cut{self.extension}", values=table)
        truth = {
            name: (SAMPLE_PERIOD * np.arange(count), column) for name, column in zip(("Fz", "Fx"), table.T, strict=True)
        }
        data = path.read_bytes()
        cut_lengths = (
            range(len(data)) if self.cuts == 0 else np.linspace(0, len(data) - 1, self.cuts).astype(int).tolist()
        )
        return sum(self._is_silent(path, data[:cut_length], truth) for cut_length in cut_lengths)

    def _is_silent(self, path: Path, raw_bytes: bytes, truth: Truth) -> bool:
        """Whether one cut is not noticed by the reader."""
        path.write_bytes(raw_bytes)
        try:
            source = open_source(path)
            complete_truth = {
                name: truth[name] for name in truth if name in {channel.name for channel in source.channels}
            }
            return difference(source, complete_truth, "cut off") > TOLERANCE
        except InputError as refusal:
            return path.name not in str(refusal)
